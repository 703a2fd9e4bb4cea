"""Learning environments over the engine in this process: no zenoh, no other process, and the same bytes as a run.

- `parallel_env`: PettingZoo's parallel API, which SuperSuit, TorchRL and others wrap; it needs `pip install alliance-agent[env]`.
- `VecEnv`: a batch of environments in arrays, stepped by one call without the GIL.

At level `decide` a step is a second or until a behavior set ends, and an action is one of the robot's sets or to be idle. At level
`drive` a step is a tick, and an action drives the body.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _engine
from ._run import Mind, Scenario, asked

#: The texts of an event.
TEXTS = ("kind", "robot", "subject", "reason", "detail")

#: In the place of a mind: the robot is decided for by whoever steps the environment.
ENVIRONMENT = "environment"

#: What has happened: a row of events.csv, with its time in s.
Event = dict[str, Any]
#: By the columns of mission.csv before and after a step, and by what has happened in it.
Reward = Callable[[dict[str, float | None], dict[str, float | None], list[Event]], float]


class VecEnv:
    """A batch of environments of one scenario.

    All arrays are made once and written in place by each call. By environment and agent: `observation` [B, N, F],
    `action_mask` [B, N, A] (level `decide`), `alive` [B, N]; by environment: `reward` [B], the team's, and `done` [B]: 0 it goes on,
    1 all is done or nobody is left, 2 time is up. Who is dead sees zeros, and its actions do nothing.
    """

    def __init__(
        self,
        scenario: Scenario = None,
        envs: int = 1,
        *,
        level: str = "decide",
        period_s: float = 1.0,
        minds: Mapping[str, Mind] | None = None,
        faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
        threads: int = 1,
        robots: int | None = None,
        size: int | None = None,
        limit: float | None = None,
        auto_reset: bool = True,
    ) -> None:
        """`minds`: robots that others decide for, as in `run`; all that are not named are agents of the environment."""
        minds = {"*": ENVIRONMENT} | dict(minds or {})
        wanted = asked(scenario, minds, 0, faults, robots, size, limit)
        self._worlds = _engine.Worlds(wanted, level, period_s, envs, threads)
        self.level = level
        self.auto_reset = auto_reset
        self.agents: list[str] = self._worlds.agents
        _, width, features, actions = self._worlds.shape
        self.observation = np.zeros((envs, width, features), np.float32)
        self.action_mask = np.zeros((envs, width, actions), np.int8)
        self.alive = np.zeros((envs, width), np.int8)
        self.reward = np.zeros(envs, np.float32)
        self.done = np.zeros(envs, np.int8)
        # Of each thread's environments.
        arrays, size = (self.observation, self.action_mask, self.alive, self.reward, self.done), self._worlds.part_size
        self._parts = [tuple(array[at : at + size] for array in arrays) for at in range(0, envs, size)]
        shape = (envs, len(self.agents))
        self._shape, self._type = (shape, np.int64) if level == "decide" else ((*shape, 4), np.float32)

    @property
    def feature_names(self) -> list[str]:
        """What the numbers of an observation mean, of the first agent."""
        return self._worlds.feature_names(0)

    @property
    def sets(self) -> list[list[str]]:
        """By agent the sets that its actions from 1 on stand for."""
        return [self._worlds.sets(agent) for agent in range(len(self.agents))]

    @property
    def setup(self) -> dict[str, Any]:
        """What is run, as in run.json; the seed is the episode's."""
        return json.loads(self._worlds.setup)

    def reset(self, seed: int = 1) -> np.ndarray:
        """Begins an episode in each environment, with seeds from this one on; returns the observations."""
        self._worlds.reset(seed)
        self._see()
        return self.observation

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One step of each environment; returns `observation`, `reward`, `done`.

        `actions`: [B, N], whole numbers from 0 (idle), at level `decide`; [B, N, 4] at level `drive`: speed (0 to 1; robots do not
        reverse), turn (-1 to 1), gripper (above ½ it picks, below -½ it drops), deed (above ½ the mission's own, such as a report).
        An environment whose episode ends begins another one in the same step, with a seed of its own: `done` is of the old one,
        `observation` of the new one.
        """
        actions = np.ascontiguousarray(actions, self._type)
        if actions.shape != self._shape:
            raise ValueError(f"actions have the shape {actions.shape}; it must be {self._shape}")
        self._worlds.step(actions, self.auto_reset)
        self._see()
        return self.observation, self.reward, self.done

    def row(self, env: int = 0) -> dict[str, float | None]:
        """How far the mission has come: the columns of mission.csv."""
        return dict(zip(self._worlds.columns, self._worlds.row(env), strict=True))

    def events(self, env: int = 0) -> list[Event]:
        """What has happened in the latest step: `time` (s), and `kind`, `robot`, `subject`, `reason` and `detail` as in events.csv."""
        return [{"time": time} | dict(zip(TEXTS, texts, strict=True)) for time, texts in self._worlds.events(env)]

    def faults(self, env: int = 0) -> list[str]:
        """The faults that are in force, in words."""
        return self._worlds.faults(env)

    def poses(self, env: int = 0) -> np.ndarray:
        """x, y (m) and heading (rad) of each robot of the scenario: [robots, 3]."""
        return np.array(self._worlds.poses(env), np.float32).reshape(-1, 3)

    def ended(self, env: int = 0) -> tuple[str | None, str | None]:
        """Hash and outcome of the episode that has ended, without `auto_reset`."""
        return self._worlds.ended(env)

    def record(self, folder: str | os.PathLike[str], env: int = 0) -> None:
        """The next episode of that environment is logged in a new folder, which `load` and `alliance view` and `report` open."""
        self._worlds.record(env, Path(folder))

    def close(self) -> None:
        """Ends episodes that are under way, and their logs."""
        self._worlds.close()

    def _see(self) -> None:
        for number, arrays in enumerate(self._parts):
            self._worlds.see(number, *arrays)


def parallel_env(scenario: Scenario = None, **options: Any) -> Any:
    """An environment of PettingZoo's parallel API; see `alliance_agent._parallel.ParallelEnv` for what it takes."""
    try:
        from ._parallel import ParallelEnv
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{error.name} is missing; install it with: pip install 'alliance-agent[env]'", name=error.name
        ) from error
    return ParallelEnv(scenario, **options)
