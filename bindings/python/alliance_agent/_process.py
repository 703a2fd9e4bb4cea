"""One robot as a process of its own."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from . import _engine
from ._engine import ScenarioError
from ._minds import Agent, Allocator
from ._run import name_of

USAGE = """\
usage: {program} [--robot NAME] [--run ID] [--twice]

Be one robot of a live run, with the mind '{mind}'.

  --robot NAME  robot to be, one of the scenario's; default: ALLIANCE_ROBOT of the environment, as `alliance run --mind` sets it
  --run ID      run to join, by its id; default: ALLIANCE_RUN, if that named the robot too; else the newest live run of this user
  --twice       make each step twice, from a copy, and end where the two differ: what else than its inputs decides is found so"""


def main(mind: type[Allocator] | type[Agent]) -> NoReturn:
    """The process of one robot with that mind: `--robot NAME [--run ID]`, as `alliance agent`, or as `alliance run --mind` starts it.

    It joins the run, lives until that ends, and exits: with status 0 when the run is over or SIGTERM has come, 2 for a mistake in
    the arguments, 3 when it was refused or the world is gone, 101 when the mind fails. To the team and the world it is a robot like
    any other: `kill -9` is its death, SIGSTOP its silence.
    """
    if not (isinstance(mind, type) and issubclass(mind, (Allocator, Agent))):
        raise TypeError(f"main: {mind!r} is no class derived from Allocator or Agent")
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(USAGE.format(program=os.path.basename(sys.argv[0]), mind=name_of(mind)))
        raise SystemExit(0)
    if sys.flags.hash_randomization and "PYTHONHASHSEED" not in os.environ:
        # The same inputs shall give the same bytes, even where a mind walks through a set of texts.
        os.execve(sys.executable, sys.orig_argv, {**os.environ, "PYTHONHASHSEED": "0"})
    words = [word for word in sys.argv[1:] if word != "--twice"]
    try:
        status = _engine.live(["agent", *words], name_of(mind), mind, len(words) < len(sys.argv) - 1)
    except ScenarioError as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        status = 2
    sys.exit(status)
