"""Process of one robot of a live run."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from . import _engine
from ._engine import ScenarioError
from ._controllers import Agent, Allocator
from ._plain import shown
from ._run import name_of

USAGE = """\
usage: {program} [--robot NAME] [--run ID] [--twice]

Run one robot of a live run, with the controller '{controller}'.

    --robot NAME  robot of the scenario; default: the environment variable ALLIANCE_ROBOT, which `alliance run --controller` sets
    --run ID      id of the run; default: ALLIANCE_RUN if ALLIANCE_ROBOT is used, too, else the newest live run of this user
    --twice       repeat each step on a copy, and exit if the results differ: finds steps that depend on more than their inputs"""


def main(controller: type[Allocator] | type[Agent]) -> NoReturn:
    """Runs one robot of a live run, with the arguments `--robot NAME [--run ID]`, as `alliance cluster agent` does.

    The process joins the run and exits with it. Exit statuses: 0 when the run is over or after SIGTERM, 2 for wrong arguments,
    3 when the run refused the robot or the world is lost, 101 when the controller failed. For the team and the world it is a robot
    like any other: `kill -9` is a crash, SIGSTOP a silence.
    """
    if not (isinstance(controller, type) and issubclass(controller, (Allocator, Agent))):
        raise TypeError(f"main: {shown(controller)} is not a class derived from Allocator or Agent")
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(USAGE.format(program=os.path.basename(sys.argv[0]), controller=name_of(controller)))
        raise SystemExit(0)
    if sys.flags.hash_randomization and "PYTHONHASHSEED" not in os.environ:
        # A fixed hash seed: the same inputs must give the same bytes, even if a controller iterates over a set of texts.
        os.execve(sys.executable, sys.orig_argv, {**os.environ, "PYTHONHASHSEED": "0"})
    words = [word for word in sys.argv[1:] if word != "--twice"]
    try:
        status = _engine.run_agent(["agent", *words], name_of(controller), controller, len(words) < len(sys.argv) - 1)
    except ScenarioError as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        status = 2
    sys.exit(status)
