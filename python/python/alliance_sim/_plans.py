"""Comparisons, sweeps and searches, which the program executes in a process of its own."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ._controllers import Agent, Allocator
from ._engine import AllianceError, ScenarioError
from ._plain import items, path, plain, shown, whole
from ._results import Results, load
from ._run import name_of

#: Plan of runs: a TOML file, or its keys and values.
Plan = str | os.PathLike[str] | Mapping[str, Any]
Controllers = Iterable[type[Allocator] | type[Agent]]

#: Exit status of a command whose runs are done, some of them with an error.
FAILED_RUNS = 1


def compare(plan: Plan, controllers: Controllers = (), *, out: str | os.PathLike[str], jobs: int | None = None) -> Results:
    """Compares allocators and controllers in Python under the same faults, as `alliance compare` does.

    `plan`: a TOML file, or its keys and values, for example `{"scenario": "janitorial", "seeds": [1, 2], "grid": {"allocator": ["alliance",
    "greedy"]}}`. It names a controller as an allocator: `MyGreedy` is `my-greedy`.
    `controllers`: classes in files of Python. The runs import the file in other processes, so it calls `main` only below
    `if __name__ == "__main__":`.
    `out`: folder of the tables, figures and pages. An interrupted comparison resumes there.
    `jobs`: number of concurrent runs; default: one per core.

    Raises `ScenarioError` for a mistake in the plan, with one line. Warns about failed runs, which the results contain.
    """
    return _execute("compare", plan, controllers, path(out, "out"), jobs)


def sweep(plan: Plan, controllers: Controllers = (), *, out: str | os.PathLike[str], jobs: int | None = None) -> Results:
    """Runs many variants of a mission with many seeds, as `alliance sweep` does. See `compare` for the arguments."""
    return _execute("sweep", plan, controllers, path(out, "out"), jobs)


def tune(plan: Plan, controllers: Controllers = (), *, out: str | os.PathLike[str], jobs: int | None = None) -> Results:
    """Searches for good parameters, as `alliance tune` does. See `compare` for the arguments.

    The parameters of a controller in Python are those that its class declares in `parameters`.
    """
    return _execute("tune", plan, controllers, path(out, "out"), jobs)


def _execute(command: str, plan: Plan, controllers: Controllers, out: Path, jobs: int | None) -> Results:
    options = [f"--out={out}"]
    if jobs is not None:
        options.append(f"--jobs={whole(jobs, 'jobs', 1)}")
    for controller in items(controllers, "controllers", "a list of classes"):
        controller_file = _file_of(controller)
        options += ["--controller", f"{name_of(controller)}={controller_file}"]
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(plan, Mapping):
            file = Path(folder) / f"{out.name}.toml"
            file.write_text(_toml(_with_absolute_paths(plain(plan, "plan"))), encoding="utf-8")
        else:
            file = path(plan, "plan")
        words = [sys.executable, "-m", "alliance_sim", command, *options, "--", str(file)]
        done = subprocess.run(words, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONHASHSEED": "0"})
    errors = done.stderr
    if isinstance(plan, Mapping):
        # The file is deleted.
        errors = re.sub(rf"{re.escape(str(file))}(:\d+)?(?=:)", "plan", errors)
    lines = errors.strip().splitlines() or [f"exit status {done.returncode}"]
    if done.returncode == FAILED_RUNS:
        failed = [line for line in lines if " failed: " in line]
        warnings.warn("; ".join(failed[:3]) or lines[-1], RuntimeWarning, stacklevel=3)
    elif done.returncode:
        kind = ScenarioError if done.returncode == 2 else AllianceError
        raise kind(lines[-1].removeprefix(f"alliance {command}: ").removeprefix("alliance: "))
    return load(out)


def _with_absolute_paths(plan: dict[str, Any]) -> dict[str, Any]:
    """Returns a plan whose scenario files do not depend on its folder. Those of a dict are relative to the working directory."""
    missions = plan.get("missions")
    if isinstance(missions, dict):
        plan = {**plan, "missions": {name: _with_absolute_paths(mission) if isinstance(mission, dict) else mission for name, mission in missions.items()}}
    scenario = plan.get("scenario")
    # The name of a built-in scenario has neither a folder nor an ending.
    if isinstance(scenario, str) and (os.sep in scenario or Path(scenario).suffix):
        plan = {**plan, "scenario": str(Path(scenario).resolve())}
    return plan


def _file_of(controller: type) -> Path:
    """Returns the file of a class, which another process can import."""
    if not (isinstance(controller, type) and issubclass(controller, (Allocator, Agent))):
        raise ScenarioError(f"controllers: {shown(controller)} is not a class derived from Allocator or Agent")
    file = getattr(sys.modules.get(controller.__module__), "__file__", None)
    if file is None or not file.endswith(".py") or controller.__qualname__ != controller.__name__:
        raise ScenarioError(
            f"controllers: {controller.__qualname__} is not at the top level of a file of Python, "
            "so that other processes cannot import it; write it into a file"
        )
    return Path(file)


def _toml(plan: Mapping[str, Any]) -> str:
    """Returns a plan as TOML: one line per key. Texts in TOML are those of JSON."""

    def value(of: Any) -> str:
        if isinstance(of, Mapping):
            return "{" + ", ".join(f"{text(key)} = {value(below)}" for key, below in of.items()) + "}"
        if isinstance(of, list):
            return "[" + ", ".join(map(value, of)) + "]"
        return text(of)

    def text(of: Any) -> str:
        return json.dumps(of, ensure_ascii=False).replace("\x7f", "\\u007f")

    return "".join(f"{text(key)} = {value(below)}\n" for key, below in plan.items())
