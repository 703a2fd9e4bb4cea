"""PettingZoo's parallel API on top of `VecEnv`."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv as Parallel  # type: ignore[import-untyped]

from ._engine import BOUND, ScenarioError
from ._plain import shown, whole
from ._run import Controller, Scenario
from ._vector import DRAWN_MAX, SEED_MAX, Event, Reward, Snapshot, VecEnv


#: Observations and infos by agent.
Seen = dict[str, Any]
Infos = dict[str, dict[str, Any]]


class ParallelEnv(Parallel):  # type: ignore[misc]
    """Team in which each robot is an agent. An observation has sensor readings and received messages. All agents share the team's reward.

    A robot that a fault kills stays an agent, because it may restart. Until then it observes zeros, `infos` has `alive` False, and its
    mask allows only the idle action. With `revive=False` it is terminated and absent for the rest of the episode.

    A deep copy continues the same episode, and so does an unpickled environment, which repeats the actions.
    """

    metadata = {"name": "alliance_sim_v0", "render_modes": ["rgb_array"], "render_fps": 20, "is_parallelizable": True}

    def __init__(
        self,
        scenario: Scenario = None,
        *,
        level: str = "decide",
        period_s: float | None = None,
        ticks: int | None = None,
        controllers: Mapping[str, Controller] | None = None,
        faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
        revive: bool = True,
        reward: Reward | None = None,
        time_cost: float = 0.0,
        robots: int | None = None,
        size: int | None = None,
        limit: float | None = None,
        info_events: bool = False,
        render_mode: str | None = None,
        randomise: Iterable[str] = (),
        shaping: Mapping[str, float] | None = None,
    ) -> None:
        """`reward`: a function of mission.csv's columns before and after a step and of the step's events; default: the mission's progress.

        `time_cost` is subtracted from the reward of each step. `info_events`: `infos` have also `faults`, `events`, and in the last step
        `hash` and `outcome`, which are not numbers. See `run` and `VecEnv` for the other arguments.
        """
        if reward is not None and shaping is not None:
            raise ScenarioError("reward and shaping: both state the reward; leave one out")
        self._vec = VecEnv(
            scenario,
            level=level,
            period_s=period_s,
            ticks=ticks,
            controllers=controllers,
            faults=faults,
            robots=robots,
            size=size,
            limit=limit,
            auto_reset=False,
            render_mode=render_mode,
            randomise=randomise,
            shaping=shaping,
            hashes=True,
        )
        self._revive, self._reward, self._time_cost, self._info_events = revive, reward, time_cost, info_events
        self.render_mode = render_mode
        self._has_faults = faults is not None or "faults" in self._vec.setup["scenario"]
        self._next_seed: int | None = None
        self.possible_agents = list(self._vec.agents)
        self.agents: list[str] = []
        self._rank = {agent: rank for rank, agent in enumerate(self.possible_agents)}
        seen = spaces.Box(-BOUND, BOUND, (self._vec.observation.shape[-1],), np.float32)
        self._actions: dict[str, spaces.Space[Any]] = {}
        self._observations: dict[str, spaces.Space[Any]] = {}
        for agent, sets in zip(self.possible_agents, self._vec.sets, strict=True):
            if level == "decide":
                count = 1 + len(sets)
                mask = spaces.Box(0, 1, (count,), np.int8)
                self._actions[agent] = spaces.Discrete(count)
                self._observations[agent] = spaces.Dict({"observation": seen, "action_mask": mask})
            else:
                self._actions[agent] = spaces.Box(-1.0, 1.0, (4,), np.float32)
                self._observations[agent] = seen
        shape = (1, len(self.possible_agents))
        self._action_array = np.zeros(shape, np.int64) if level == "decide" else np.zeros((*shape, 4), np.float32)
        self._counts = {agent: len(sets) for agent, sets in self.sets.items()}
        self._level = level
        self._is_running = False

    @property
    def feature_names(self) -> list[str]:
        """Names of the numbers of an observation, for the first agent."""
        return self._vec.feature_names

    def feature_names_of(self, agent: str) -> list[str]:
        """Returns the names of the numbers of an agent's observation."""
        return self._vec.feature_names_of(self._rank[agent])

    @property
    def sets(self) -> dict[str, list[str]]:
        """Behavior sets by agent. Action n selects the n-th one; action 0 is idle."""
        return dict(zip(self.possible_agents, self._vec.sets, strict=True))

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent, the same object for each call."""
        return self._observations[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent, the same object for each call."""
        return self._actions[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, Infos]:
        """Starts an episode. The default seed is the previous one plus one, and at first from the entropy of the system."""
        if seed is None:
            seed = int(np.random.default_rng().integers(DRAWN_MAX)) if self._next_seed is None else self._next_seed
        seed = whole(seed, "seed", 0, SEED_MAX)
        self._next_seed = (seed + 1) % (SEED_MAX + 1)
        self._vec.reset(seed)
        self.agents = list(self.possible_agents)
        self._is_running = True
        return self._seen(), self._infos({})

    def step(self, actions: Mapping[str, Any]) -> tuple[Seen, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Makes one step. An agent without an action is idle. `infos` has `masked_action`: true if the mask excluded the agent's action."""
        if not self._is_running:
            raise RuntimeError("call reset() first, and again after the end of an episode")
        before = self._vec.row() if self._reward else {}
        masked = self._read(actions)
        self._vec.advance(self._action_array)
        reward = self._own_reward(before) if self._reward else float(self._vec.reward[0])
        reward -= self._time_cost
        done = self._vec.done[0]
        over, cut = bool(done == 1), bool(done == 2)
        agents = self.agents
        rewards = dict.fromkeys(agents, reward)
        if self._revive:
            terminations = dict.fromkeys(agents, over)
        else:
            terminations = {agent: over or not self._vec.alive[0, self._rank[agent]] for agent in agents}
        truncations = dict.fromkeys(agents, cut)
        seen, infos = self._seen(), self._infos(masked)
        if done:
            if self._info_events:
                run, outcome = self._vec.ended()
                for info in infos.values():
                    info["hash"], info["outcome"] = run, outcome
            self.agents, self._is_running = [], False
        elif not self._revive:
            self.agents = [agent for agent in agents if not terminations[agent]]
        return seen, rewards, terminations, truncations, infos

    def snapshot(self) -> Snapshot:
        """Returns the state of the episode, for `restore`. A recorded episode has none."""
        return replace(self._vec.snapshot(), own=(tuple(self.agents), self._is_running))

    def restore(self, snapshot: Snapshot) -> tuple[Seen, Infos]:
        """Continues from a snapshot of this environment or of its deep copy. Returns observations and infos."""
        self._vec.restore(snapshot)
        agents, self._is_running = snapshot.own
        self.agents = list(agents)
        return self._seen(), self._infos({})

    def _read(self, actions: Mapping[str, Any]) -> dict[str, bool]:
        """Writes the actions into the array. Returns by agent whether its mask excluded the action."""
        array = self._action_array
        array.fill(0)
        masked = {}
        for agent, action in actions.items():
            rank = self._rank.get(agent)
            if rank is None:
                raise ValueError(f"actions: there is no agent '{agent}'; there are {', '.join(self.possible_agents)}")
            if self._level == "decide":
                try:
                    number = operator.index(action)
                except TypeError:
                    raise TypeError(f"action of '{agent}': {shown(action)} is not a whole number") from None
                array[0, rank] = number
                mask = self._vec.action_mask[0, rank]
                masked[agent] = 0 <= number < len(mask) and not mask[number]
                continue
            numbers = np.asarray(action)
            if numbers.shape != (4,) or numbers.dtype.kind not in "fiu":
                raise ValueError(f"action of '{agent}': {shown(action)} is not an array of four numbers")
            array[0, rank] = numbers
        return masked

    def _own_reward(self, before: dict[str, float | None]) -> float:
        reward = self._reward(before, self._vec.row(), self._vec.events()) if self._reward else 0.0
        try:
            number = float(reward)
        except (TypeError, ValueError):
            raise TypeError(f"reward: the function returned {shown(reward)}, which is not a number") from None
        if not math.isfinite(number):
            raise ValueError(f"reward: the function returned {number}, which is not a finite number")
        return number

    def state(self) -> np.ndarray:
        """Returns the state for a centralized critic: mission.csv's columns, then x, y and heading of each robot."""
        row = [np.nan if value is None else value for value in self._vec.row().values()]
        return np.concatenate([np.nan_to_num(np.array(row, np.float32)), self._vec.poses().ravel()])

    def row(self) -> dict[str, float | None]:
        """Returns the progress of the mission: the columns of mission.csv."""
        return self._vec.row()

    def events(self) -> list[Event]:
        """Returns the events of the latest step, see `VecEnv.events`."""
        return self._vec.events()

    def faults(self) -> list[str]:
        """Returns the faults in force as texts."""
        return self._vec.faults()

    def poses(self) -> np.ndarray:
        """Returns x, y (m) and heading (rad) of each robot of the scenario."""
        return self._vec.poses()

    @property
    def hash(self) -> str | None:
        """Hash of the finished episode. A run with the same seed and the same decisions has the same hash."""
        return self._vec.ended()[0]

    @property
    def outcome(self) -> str | None:
        """Outcome of the finished episode, as `Run.outcome`."""
        return self._vec.ended()[1]

    def record(self, folder: str | os.PathLike[str]) -> None:
        """Logs the next episode in a new folder."""
        self._vec.record(folder)

    def render(self) -> np.ndarray | None:
        """Returns a picture of the room with `render_mode="rgb_array"`: [height, width, 3]. Else returns `None`."""
        return None if self.render_mode is None else self._vec.picture()

    def close(self) -> None:
        """Ends the current episode and its log."""
        self._vec.close()

    def __repr__(self) -> str:
        return f"<ParallelEnv with {len(self.possible_agents)} agents, level {self._level}>"

    def _seen(self) -> Seen:
        observation = self._vec.observation[0].copy()
        if self._level == "drive":
            return {agent: observation[self._rank[agent]] for agent in self.agents}
        mask = self._vec.action_mask[0].copy()
        return {
            agent: {
                "observation": observation[self._rank[agent]],
                "action_mask": mask[self._rank[agent], : 1 + self._counts[agent]],
            }
            for agent in self.agents
        }

    def _infos(self, masked: Mapping[str, bool]) -> Infos:
        alive = self._vec.alive[0].tolist()
        infos: Infos = {agent: {"alive": bool(alive[self._rank[agent]])} for agent in self.agents}
        if self._level == "decide":
            for agent, info in infos.items():
                info["masked_action"] = bool(masked.get(agent, False))
        if self._info_events:
            faults = self._vec.faults() if self._has_faults else []
            events = self._vec.events()
            for info in infos.values():
                info["faults"], info["events"] = faults, events
        return infos
