"""The vectorised environment that all other environments use."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _engine
from ._run import Controller, Scenario, asked

#: Text columns of an event.
TEXTS = ("kind", "robot", "subject", "reason", "detail")

#: Controller name of a robot whose decisions are the environment's actions.
ENVIRONMENT = "environment"

#: Event: a row of events.csv, with its time in s.
Event = dict[str, Any]
#: Reward function of mission.csv's columns before and after a step, and of the step's events.
Reward = Callable[[dict[str, float | None], dict[str, float | None], list[Event]], float]


class VecEnv:
    """Batch of environments of one scenario.

    All arrays are created once; each call overwrites them. By environment and agent: `observation` [B, N, F], `action_mask` [B, N, A]
    (level `decide`), `alive` [B, N]. By environment: `reward` [B] of the team, and `done` [B]: 0 running, 1 complete or no robot left,
    2 time limit. A dead robot observes zeros, and its actions have no effect.
    """

    def __init__(
        self,
        scenario: Scenario = None,
        envs: int = 1,
        *,
        level: str = "decide",
        period_s: float = 1.0,
        controllers: Mapping[str, Controller] | None = None,
        faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
        threads: int = 1,
        robots: int | None = None,
        size: int | None = None,
        limit: float | None = None,
        auto_reset: bool = True,
    ) -> None:
        """`controllers`: robots with other controllers, as in `run`. All robots without an entry are agents of the environment."""
        controllers = {"*": ENVIRONMENT} | dict(controllers or {})
        request = asked(scenario, controllers, 0, faults, robots, size, limit)
        self._worlds = _engine.EnvironmentBatch(request, level, period_s, envs, threads)
        self.level = level
        self.auto_reset = auto_reset
        self.agents: list[str] = self._worlds.agents
        _, width, features, actions = self._worlds.shape
        self.observation = np.zeros((envs, width, features), np.float32)
        self.action_mask = np.zeros((envs, width, actions), np.int8)
        self.alive = np.zeros((envs, width), np.int8)
        self.reward = np.zeros(envs, np.float32)
        self.done = np.zeros(envs, np.int8)
        # One part per thread.
        arrays, size = (self.observation, self.action_mask, self.alive, self.reward, self.done), self._worlds.part_size
        self._parts = [tuple(array[at : at + size] for array in arrays) for at in range(0, envs, size)]
        shape = (envs, len(self.agents))
        self._shape, self._type = (shape, np.int64) if level == "decide" else ((*shape, 4), np.float32)

    @property
    def feature_names(self) -> list[str]:
        """Names of the numbers of an observation, for the first agent."""
        return self._worlds.feature_names(0)

    @property
    def sets(self) -> list[list[str]]:
        """Behavior sets by agent. Action n selects the n-th one; action 0 is idle."""
        return [self._worlds.sets(agent) for agent in range(len(self.agents))]

    @property
    def setup(self) -> dict[str, Any]:
        """Setup of the runs, as in run.json. The seed is the episode's."""
        return json.loads(self._worlds.setup)

    def reset(self, seed: int = 1) -> np.ndarray:
        """Starts an episode in each environment, with consecutive seeds from `seed` on. Returns the observations."""
        self._worlds.reset(seed)
        self._update_arrays()
        return self.observation

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Makes one step in each environment. Returns `observation`, `reward`, `done`.

        `actions` at level `decide`: [B, N], integers from 0 (idle). At level `drive`: [B, N, 4] with speed (0 to 1; robots cannot reverse),
        turn (-1 to 1), gripper (above ½ picks, below -½ drops) and action (above ½ the mission's own, such as a report).
        An environment whose episode ends starts another one in the same step, with its own seed: `done` is of the old episode,
        `observation` of the new one.
        """
        actions = np.ascontiguousarray(actions, self._type)
        if actions.shape != self._shape:
            raise ValueError(f"actions have the shape {actions.shape}; it must be {self._shape}")
        self._worlds.step(actions, self.auto_reset)
        self._update_arrays()
        return self.observation, self.reward, self.done

    def row(self, env: int = 0) -> dict[str, float | None]:
        """Returns the progress of the mission: the columns of mission.csv."""
        return dict(zip(self._worlds.columns, self._worlds.row(env), strict=True))

    def events(self, env: int = 0) -> list[Event]:
        """Returns the events of the latest step: `time` (s), and `kind`, `robot`, `subject`, `reason` and `detail` as in events.csv."""
        return [{"time": time} | dict(zip(TEXTS, texts, strict=True)) for time, texts in self._worlds.events(env)]

    def faults(self, env: int = 0) -> list[str]:
        """Returns the faults in force as texts."""
        return self._worlds.faults(env)

    def poses(self, env: int = 0) -> np.ndarray:
        """Returns x, y (m) and heading (rad) of each robot of the scenario: [robots, 3]."""
        return np.array(self._worlds.poses(env), np.float32).reshape(-1, 3)

    def ended(self, env: int = 0) -> tuple[str | None, str | None]:
        """Returns hash and outcome of the finished episode. Without `auto_reset` only."""
        return self._worlds.ended(env)

    def record(self, folder: str | os.PathLike[str], env: int = 0) -> None:
        """Logs the next episode of an environment in a new folder, for `load` and for `alliance watch` and `report`."""
        self._worlds.record(env, Path(folder))

    def close(self) -> None:
        """Ends the current episodes and their logs."""
        self._worlds.close()

    def _update_arrays(self) -> None:
        for number, arrays in enumerate(self._parts):
            self._worlds.see(number, *arrays)
