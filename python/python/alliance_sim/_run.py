"""Runs of whole missions in this process."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

from . import _engine
from ._engine import ControllerError, ScenarioError
from ._controllers import Agent, Allocator
from ._isolation import SharedVariables
from ._plain import flag, items, path, plain, seconds, shown, text, whole
from ._results import Results, load

#: Controller of a robot: a class, or the name of a built-in allocator.
Controller = type[Allocator] | type[Agent] | str
#: Name of a built-in scenario, TOML file, or a scenario's keys and values.
Scenario = str | os.PathLike[str] | Mapping[str, Any] | None


@dataclass(frozen=True)
class Run:
    """Result of a run.

    - `hash`: hash of the run. It depends on scenario, seed and controllers only, not on the number of processes.
    - `outcome`: `complete`, `time-limit`, `no-robot-left`, or `expired` (no work is left, but some of it expired).
    - `result`: figures: `ticks`, `sim_time_ms`, those of the mission by name, and `robots` with those of each robot. Names that end with
      `_ms` are times in ms.
    - `file`: content of run.json.
    - `folder`: run folder, or `None` without a log.
    """

    hash: str
    outcome: str
    result: dict[str, Any] = field(repr=False)
    file: dict[str, Any] = field(repr=False)
    folder: Path | None = None

    @property
    def complete(self) -> bool:
        """True if the mission was completed."""
        return self.outcome == "complete"

    @property
    def seconds(self) -> float:
        """Simulated time of the run, s."""
        return float(self.result["sim_time_ms"] / 1000)

    def _repr_html_(self) -> str:
        """Returns a table of the run for a notebook."""
        figures = {"outcome": self.outcome, "time, s": self.seconds, "hash": self.hash, "folder": self.folder}
        figures |= {name: value for name, value in self.result.items() if isinstance(value, int | float) and name not in ("ticks", "sim_time_ms")}
        rows = (f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in figures.items() if value is not None)
        return f"<table>{''.join(rows)}</table>"

    def load(self) -> Results:
        """Returns the tables of the run's log."""
        if self.folder is None:
            raise ValueError("this run has no log; call run() with a folder: log='runs/mine'")
        return load(self.folder)


def run(
    scenario: Scenario = None,
    controllers: Mapping[str, Controller] | None = None,
    seed: int = 1,
    log: str | os.PathLike[str] | None = None,
    faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
    *,
    robots: int | None = None,
    size: int | None = None,
    limit: float | None = None,
    level: str = "full",
    twice: bool = False,
    randomise: Iterable[str] = (),
) -> Run:
    """Runs a mission to its end in this process. The result is identical to that of a run in processes.

    `scenario`: name of a built-in one, TOML file, or dict; default: the default mission.
    `controllers`: by robot, or `"*"` for all others: an `Allocator` or `Agent` class, or the name of a built-in allocator.
    `log`: new run folder, for `load` and for `alliance report`, `watch` and `export`; `level` selects the amount of data: `full`,
    `compact`, `summary` or `off`.
    `faults`: replaces the scenario's faults; a list of orders, or `{"timeline": […], "random": {…}}`.
    `twice`: repeats each step of these classes on a copy. The run fails if a step depends on more than its inputs.
    `robots`, `size`: for missions of variable size. `limit`: time limit, simulated seconds.
    `randomise`: what the seed draws: `start` (poses of the robots), `layout` (places of the mission). `Run.file` has the drawn scenario.

    Raises `ScenarioError` for a wrong argument and `ControllerError` if a controller fails, both with one line. A
    `KeyboardInterrupt` and a `SystemExit` of a controller pass unchanged.
    """
    folder = None if log is None else path(log, "log")
    request = asked(scenario, controllers, seed, faults, robots, size, limit, twice, randomise)
    classes = dict.fromkeys(controller for _, _, controller in request["controllers"] if controller is not None)
    shared = [SharedVariables(controller) for controller in classes]
    file = json.loads(_engine.run(request, folder, text(level, "level")))
    for variables in shared:
        # The steps compare large values rarely.
        try:
            variables.check_all()
        except RuntimeError as error:
            raise ControllerError(f"end of the run: RuntimeError: {error}") from error
    return Run(file["hash"], file["outcome"], file["result"], file, folder)


def asked(
    scenario: Scenario,
    controllers: Mapping[str, Controller] | None,
    seed: int,
    faults: Mapping[str, Any] | list[Mapping[str, Any]] | None,
    robots: int | None,
    size: int | None,
    limit: float | None,
    twice: bool = False,
    randomise: Iterable[str] = (),
) -> dict[str, Any]:
    """Returns the arguments in the engine's format."""
    document, words = None, ["run"]
    if isinstance(scenario, Mapping):
        document = json.dumps(plain(scenario, "scenario"))
    elif isinstance(scenario, str | os.PathLike):
        words.append(text(os.fsdecode(scenario), "scenario"))
    elif scenario is not None:
        raise ScenarioError(f"scenario: {shown(scenario)} is neither a name, nor a file, nor a dict")
    seed = whole(seed, "seed", 0, 2**64 - 1)
    robots = None if robots is None else whole(robots, "robots", 1)
    size = None if size is None else whole(size, "size", 1)
    limit = None if limit is None else seconds(limit, "limit")
    given = {"seed": seed, "robots": robots, "size": size, "limit": limit}
    words += [f"--{word}={value}" for word, value in given.items() if value is not None]
    if document and (robots or size):
        raise ScenarioError("robots and size: a scenario in a dict already has them")
    if faults is not None and not isinstance(faults, Mapping):
        faults = {"timeline": items(faults, "faults", "a list of orders or a dict")}
    names = [randomise] if isinstance(randomise, str) else items(randomise, "randomise", "a list of texts; write ['start', 'layout']")
    return {
        "arguments": words,
        "document": document,
        "faults": None if faults is None else json.dumps(plain(faults, "faults")),
        "controllers": _named(by_robot(controllers)),
        "twice": flag(twice, "twice"),
        "randomise": [text(name, "randomise") for name in names],
    }


def by_robot(controllers: Mapping[str, Controller] | None) -> dict[str, Controller]:
    """Returns a copy of the controllers. Raises `ScenarioError` for a value that is no dict."""
    if controllers is not None and not isinstance(controllers, Mapping):
        raise ScenarioError(f"controllers: {shown(controllers)} is not a dict; write {{'*': …}} for all robots")
    return dict(controllers or {})


def _named(controllers: Mapping[str, Controller]) -> list[tuple[str, str, type | None]]:
    """Returns the controllers with their names in the run."""
    named: list[tuple[str, str, type | None]] = []
    classes: dict[str, type] = {}
    for robot, controller in controllers.items():
        if not isinstance(robot, str):
            raise ScenarioError(f"controllers: {shown(robot)} is not the name of a robot; write the names as texts, or '*' for all others")
        text(robot, "controllers")
        if isinstance(controller, str):
            named.append((robot, text(controller, "controllers"), None))
        elif isinstance(controller, type) and issubclass(controller, (Allocator, Agent)):
            name = name_of(controller)
            if classes.setdefault(name, controller) is not controller:
                raise ScenarioError(f"controllers: two classes have the name '{name}'; rename one of them")
            named.append((robot, name, controller))
        else:
            raise ScenarioError(
                f"controllers: {shown(controller)} of '{robot}' is neither a class derived from Allocator or Agent nor the name of an allocator"
            )
    return named


def name_of(controller: type) -> str:
    """Returns the name of a controller in scenario and log: `MyGreedy` becomes `my-greedy`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", controller.__name__).lower()
