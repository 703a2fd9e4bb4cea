"""Gymnasium's environment of one robot, whose teammates have other controllers."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from ._engine import BOUND, ScenarioError
from ._plain import shown
from ._run import Controller, Scenario
from ._vector import DRAWN_MAX, ENVIRONMENT, Snapshot, VecEnv

#: Built-in scenario of each registered environment.
SCENARIOS = {"Waste": "waste", "Service": "service", "Push": "push", "Observe": "observe"}

#: Missions whose robots can be driven.
DRIVEN = ("Waste", "Push", "Observe")


class RobotEnv(gymnasium.Env[np.ndarray, Any]):
    """One robot of a team as a `gymnasium.Env`. The reward is the team's.

    At level `decide`, `info` has the `action_mask` of the next action. A killed robot observes zeros until it restarts; `info` has `alive`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(
        self,
        scenario: Scenario = None,
        robot: str | None = None,
        *,
        teammates: Controller | Mapping[str, Controller] = "alliance",
        level: str = "decide",
        period_s: float | None = None,
        ticks: int | None = None,
        faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
        robots: int | None = None,
        size: int | None = None,
        limit: float | None = None,
        render_mode: str | None = None,
        randomise: Iterable[str] = (),
        shaping: Mapping[str, float] | None = None,
    ) -> None:
        """`robot`: name of the robot; default: the first. `teammates`: controller of all others, or by robot. See `VecEnv` for the others."""
        options: dict[str, Any] = {"level": level, "robots": robots, "size": size, "limit": limit}
        agents = VecEnv(scenario, **options).agents
        robot = agents[0] if robot is None else robot
        if robot not in agents:
            raise ScenarioError(f"robot: the scenario has no robot {shown(robot)}; it has {', '.join(agents[:10])}{'…' * (len(agents) > 10)}")
        others = dict(teammates) if isinstance(teammates, Mapping) else {"*": teammates}
        self._vec = VecEnv(
            scenario,
            **options,
            controllers={"*": "alliance", **others, robot: ENVIRONMENT},
            period_s=period_s,
            ticks=ticks,
            faults=faults,
            auto_reset=False,
            render_mode=render_mode,
            randomise=randomise,
            shaping=shaping,
            hashes=True,
        )
        self.robot, self.render_mode, self._level = robot, render_mode, level
        features = self._vec.observation.shape[-1]
        self.observation_space = spaces.Box(-BOUND, BOUND, (features,), np.float32)
        count = 1 + len(self._vec.sets[0])
        self.action_space = spaces.Discrete(count) if level == "decide" else spaces.Box(-1.0, 1.0, (4,), np.float32)

    @property
    def feature_names(self) -> list[str]:
        """Names of the numbers of an observation."""
        return self._vec.feature_names

    @property
    def sets(self) -> list[str]:
        """Behavior sets of the robot. Action n selects the n-th one; action 0 is idle."""
        return self._vec.sets[0]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode. Without a seed, the environment draws one from the last given seed or from the entropy of the system."""
        super().reset(seed=seed)
        self._vec.reset(int(self.np_random.integers(DRAWN_MAX)) if seed is None else seed)
        return self._vec.observation[0, 0].copy(), self._info()

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Makes one step. The time limit truncates; completion and the loss of the last robot terminate."""
        masked = None
        if self._level == "decide":
            try:
                action = operator.index(action)
            except TypeError:
                raise TypeError(f"action of '{self.robot}': {shown(action)} is not a whole number") from None
            mask = self._vec.action_mask[0, 0]
            masked = 0 <= action < len(mask) and not mask[action]
        else:
            action = self._numbers(action)
        self._vec.step([[action]])
        info = self._info()
        if masked is not None:
            info["masked_action"] = masked
        done = self._vec.done[0]
        if done:
            info["hash"], info["outcome"] = self._vec.ended()
        return self._vec.observation[0, 0].copy(), float(self._vec.reward[0]), bool(done == 1), bool(done == 2), info

    def snapshot(self) -> Snapshot:
        """Returns the state of the episode, for `restore`. A recorded episode has none."""
        return self._vec.snapshot()

    def restore(self, snapshot: Snapshot) -> tuple[np.ndarray, dict[str, Any]]:
        """Continues from a snapshot of this environment or of its deep copy. Returns observation and info."""
        self._vec.restore(snapshot)
        return self._vec.observation[0, 0].copy(), self._info()

    def render(self) -> np.ndarray | None:
        """Returns a picture of the room with `render_mode="rgb_array"`: [height, width, 3]. Else returns `None`."""
        return None if self.render_mode is None else self._vec.picture()

    def record(self, folder: str | os.PathLike[str]) -> None:
        """Logs the next episode in a new folder."""
        self._vec.record(folder)

    def close(self) -> None:
        """Ends the current episode and its log."""
        self._vec.close()

    def __repr__(self) -> str:
        return f"<RobotEnv of robot '{self.robot}', level {self._level}>"

    def _numbers(self, action: Any) -> np.ndarray:
        """Checks the form of an action at level `drive`."""
        try:
            numbers = np.asarray(action)
        except ValueError:
            raise ValueError(f"action of '{self.robot}': {shown(action)} is not an array of four numbers") from None
        if numbers.shape != (4,):
            raise ValueError(f"action of '{self.robot}': the shape is {numbers.shape}; it must be (4,)")
        if numbers.dtype.kind not in "fiub":
            raise TypeError(f"action of '{self.robot}': {shown(action)} is not an array of four numbers")
        return numbers

    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = {"alive": bool(self._vec.alive[0, 0])}
        if self._level == "decide":
            info["action_mask"] = self._vec.action_mask[0, 0].copy()
        return info


def register() -> None:
    """Registers `alliance/Waste-v0`, `-Drive-v0` and the others in Gymnasium, each once."""
    for name, scenario in SCENARIOS.items():
        for level in ("decide", "drive") if name in DRIVEN else ("decide",):
            environment = f"alliance/{name}{'-Drive' if level == 'drive' else ''}-v0"
            if environment not in gymnasium.registry:
                gymnasium.register(environment, "alliance_sim._robot:RobotEnv", kwargs={"scenario": scenario, "level": level})
