"""A whole mission in this process."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import _engine
from ._engine import ScenarioError
from ._minds import Agent, Allocator
from ._results import Results, load

#: Who decides for a robot: a class of one's own, or one of the simulator's allocators by its name.
Mind = type[Allocator] | type[Agent] | str
#: A built-in scenario's name or a TOML file, or a scenario's keys and values.
Scenario = str | os.PathLike[str] | Mapping[str, Any] | None


@dataclass(frozen=True)
class Run:
    """What came of a run."""

    #: The same for the same scenario, seed and minds, by processes or in one.
    hash: str
    #: `complete`, `time-limit` or `no-robot-left`.
    outcome: str
    #: Figures: `ticks`, `sim_time_ms`, those of the mission and of each robot.
    result: dict[str, Any] = field(repr=False)
    #: All of run.json.
    file: dict[str, Any] = field(repr=False)
    #: Folder of the log, if there is one.
    folder: Path | None = None

    @property
    def complete(self) -> bool:
        """Whether all is done."""
        return self.outcome == "complete"

    @property
    def seconds(self) -> float:
        """Simulated time that it took."""
        return self.result["sim_time_ms"] / 1000

    def load(self) -> Results:
        """The tables of its log."""
        if self.folder is None:
            raise ValueError("this run has no log; give run() a folder: log='runs/mine'")
        return load(self.folder)


def run(
    scenario: Scenario = None,
    minds: Mapping[str, Mind] | None = None,
    seed: int = 1,
    log: str | os.PathLike[str] | None = None,
    faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
    *,
    robots: int | None = None,
    size: int | None = None,
    limit: float | None = None,
    level: str = "full",
    twice: bool = False,
) -> Run:
    """Runs a mission to its end in this process; the same bytes as by processes.

    `scenario`: the name of a built-in one, a TOML file, or a scenario as a dict; without one the default mission.
    `minds`: by robot, or `"*"` for all others, an `Allocator` or `Agent` class or the name of one of the simulator's allocators.
    `log`: a new folder, which `load` reads and `alliance report`, `view` and `export` open; `level` says how much is in it.
    `faults`: in the place of the scenario's own; a list of orders, or `{"timeline": […], "random": {…}}`.
    `twice`: each step of these classes is made twice, and the run ends where the two differ: what else than its inputs decides.
    `robots`, `size`: of a mission that comes in any size. `limit`: simulated seconds.

    Raises `ScenarioError` for a mistake in these, `MindError` when a mind fails, both with one line.
    """
    folder = None if log is None else Path(log)
    file = json.loads(_engine.run(asked(scenario, minds, seed, faults, robots, size, limit, twice), folder, level))
    return Run(file["hash"], file["outcome"], file["result"], file, folder)


def asked(
    scenario: Scenario,
    minds: Mapping[str, Mind] | None,
    seed: int,
    faults: Mapping[str, Any] | list[Mapping[str, Any]] | None,
    robots: int | None,
    size: int | None,
    limit: float | None,
    twice: bool = False,
) -> dict[str, Any]:
    """What is asked for, as the engine takes it."""
    document = json.dumps(scenario) if isinstance(scenario, Mapping) else None
    words = ["run"] if scenario is None or document else ["run", os.fspath(scenario)]
    given = {"seed": seed, "robots": robots, "size": size, "limit": limit}
    words += [f"--{word}={value}" for word, value in given.items() if value is not None]
    if document and (robots or size):
        raise ScenarioError("robots and size: a scenario given as a dict has its own")
    if faults is not None and not isinstance(faults, Mapping):
        faults = {"timeline": list(faults)}
    return {
        "words": words,
        "document": document,
        "faults": None if faults is None else json.dumps(faults),
        "minds": _named(minds or {}),
        "twice": twice,
    }


def _named(minds: Mapping[str, Mind]) -> list[tuple[str, str, type | None]]:
    """The minds with the names under which the run knows them."""
    named: list[tuple[str, str, type | None]] = []
    classes: dict[str, type] = {}
    for robot, mind in minds.items():
        if isinstance(mind, str):
            named.append((robot, mind, None))
        elif isinstance(mind, type) and issubclass(mind, (Allocator, Agent)):
            name = name_of(mind)
            if classes.setdefault(name, mind) is not mind:
                raise ScenarioError(f"minds: two classes are called '{name}'; give each its own name")
            named.append((robot, name, mind))
        else:
            raise ScenarioError(
                f"minds: {mind!r} of '{robot}' is neither a class derived from Allocator or Agent nor the name of an allocator"
            )
    return named


def name_of(mind: type) -> str:
    """The name of a mind in scenario and log: `MyGreedy` is `my-greedy`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", mind.__name__).lower()
