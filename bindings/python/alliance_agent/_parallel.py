"""PettingZoo's parallel API over `VecEnv`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from pettingzoo import ParallelEnv as Parallel

from ._run import Mind, Scenario
from .env import Reward, VecEnv


class ParallelEnv(Parallel, EzPickle):
    """A team, each robot of which is an agent that sees what it senses and hears; the reward is the team's, the same for all.

    A robot that a fault kills stays an agent, for it may come back: it sees zeros, `infos` say that it is not alive, and its mask
    has no action but to be idle. With `revive=False` it is terminated, and is gone for the episode.

    A copy, and what is unpickled, is made anew from the same arguments, before its first episode.
    """

    metadata = {"name": "alliance_agent_v0", "render_modes": [], "is_parallelizable": True}
    render_mode = None

    def __init__(
        self,
        scenario: Scenario = None,
        *,
        level: str = "decide",
        period_s: float = 1.0,
        minds: Mapping[str, Mind] | None = None,
        faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
        revive: bool = True,
        reward: Reward | None = None,
        time_cost: float = 0.0,
        robots: int | None = None,
        size: int | None = None,
        limit: float | None = None,
    ) -> None:
        """`reward`: a function of mission.csv's columns before and after a step and of its events, in the place of the mission's progress.

        `time_cost` is taken off the reward of each step. The rest is as of `run` and `VecEnv`.
        """
        run = {
            "level": level,
            "period_s": period_s,
            "minds": minds,
            "faults": faults,
            "robots": robots,
            "size": size,
            "limit": limit,
        }
        EzPickle.__init__(self, scenario, **run, revive=revive, reward=reward, time_cost=time_cost)
        self._vec = VecEnv(scenario, 1, **run, auto_reset=False)
        self._revive, self._reward, self._time_cost = revive, reward, time_cost
        self._has_faults = faults is not None or "faults" in self._vec.setup["scenario"]
        self._next_seed = 1
        self.possible_agents = list(self._vec.agents)
        self.agents: list[str] = []
        self._rank = {agent: rank for rank, agent in enumerate(self.possible_agents)}
        features = self._vec.observation.shape[-1]
        seen = spaces.Box(-np.inf, np.inf, (features,), np.float32)
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
        self._given = np.zeros(shape, np.int64) if level == "decide" else np.zeros((*shape, 4), np.float32)
        self._level = level
        self._begun = False

    @property
    def feature_names(self) -> list[str]:
        """What the numbers of an observation mean, of the first agent."""
        return self._vec.feature_names

    @property
    def sets(self) -> dict[str, list[str]]:
        """By agent the sets that its actions from 1 on stand for."""
        return dict(zip(self.possible_agents, self._vec.sets, strict=True))

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The same object each time."""
        return self._observations[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The same object each time."""
        return self._actions[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict, dict]:
        """Begins an episode; without a seed with the one after that of the episode before."""
        seed = self._next_seed if seed is None else seed
        self._next_seed = seed + 1
        self._vec.reset(seed)
        self.agents = list(self.possible_agents)
        self._begun = True
        return self._seen(), self._infos()

    def step(self, actions: Mapping[str, Any]) -> tuple[dict, dict, dict, dict, dict]:
        """One step; an agent without an action is idle."""
        if not self._begun:
            raise RuntimeError("reset() comes first, and again after the end of an episode")
        before = self._vec.row() if self._reward else {}
        given = self._given
        given.fill(0)
        for agent, action in actions.items():
            given[0, self._rank[agent]] = action
        self._vec.step(given)
        reward = self._reward(before, self._vec.row(), self._vec.events()) if self._reward else float(self._vec.reward[0])
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
        seen, infos = self._seen(), self._infos()
        if done:
            run, outcome = self._vec.ended()
            for info in infos.values():
                info["hash"], info["outcome"] = run, outcome
            self.agents, self._begun = [], False
        elif not self._revive:
            self.agents = [agent for agent in agents if not terminations[agent]]
        return seen, rewards, terminations, truncations, infos

    def state(self) -> np.ndarray:
        """For centralized critics: mission.csv's columns, then x, y and heading of each robot."""
        row = [np.nan if value is None else value for value in self._vec.row().values()]
        return np.concatenate([np.nan_to_num(np.array(row, np.float32)), self._vec.poses().ravel()])

    def row(self) -> dict[str, float | None]:
        """How far the mission has come: the columns of mission.csv."""
        return self._vec.row()

    def poses(self) -> np.ndarray:
        """x, y (m) and heading (rad) of each robot of the scenario."""
        return self._vec.poses()

    @property
    def hash(self) -> str | None:
        """Of the episode that has ended: that of the run with the same seed and the same decisions."""
        return self._vec.ended()[0]

    def record(self, folder: str | os.PathLike[str]) -> None:
        """The next episode is logged in a new folder."""
        self._vec.record(folder)

    def render(self) -> None:
        """Nothing is drawn; record() an episode, and `alliance view` shows it."""

    def close(self) -> None:
        """Ends an episode that is under way, and its log."""
        self._vec.close()

    def _seen(self) -> dict[str, Any]:
        observation = self._vec.observation[0].copy()
        if self._level == "drive":
            return {agent: observation[self._rank[agent]] for agent in self.agents}
        mask = self._vec.action_mask[0].copy()
        return {
            agent: {
                "observation": observation[self._rank[agent]],
                "action_mask": mask[self._rank[agent], : self._actions[agent].n],
            }
            for agent in self.agents
        }

    def _infos(self) -> dict[str, dict[str, Any]]:
        faults = self._vec.faults() if self._has_faults else []
        alive = self._vec.alive[0].tolist()
        events = self._vec.events()
        return {agent: {"alive": bool(alive[self._rank[agent]]), "faults": faults, "events": events} for agent in self.agents}
