"""The vectorised environment that all other environments use."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from . import _engine
from ._plain import flag, seconds, shown, text, whole
from ._run import Controller, Scenario, asked, by_robot
from ._spaces import AutoresetMode, VectorEnv, batch_spaces

#: Text columns of an event.
TEXTS = ("kind", "robot", "subject", "reason", "detail")

#: Controller name of a robot whose decisions are the environment's actions.
ENVIRONMENT = "environment"

#: Largest seed.
SEED_MAX = 2**64 - 1

#: Upper limit of the seeds that an unseeded reset draws. They stay exact in tools that store numbers as floats.
DRAWN_MAX = 2**53

#: Width of a picture, px.
PICTURE_PX = 640

#: Event: a row of events.csv, with its time in s.
Event = dict[str, Any]
#: Reward function of mission.csv's columns before and after a step, and of the step's events.
Reward = Callable[[dict[str, float | None], dict[str, float | None], list[Event]], float]


@dataclass(frozen=True)
class Snapshot:
    """State of environments in mid-episode, for any number of `restore`."""

    states: _engine.EnvironmentStates = field(repr=False)
    #: Seed and actions of the episode.
    past: tuple[int, Any] = field(repr=False)
    #: State of the environment around the engine.
    own: Any = field(default=None, repr=False)


class VecEnv(VectorEnv):
    """Batch of B environments of one scenario with N agents each: a `gymnasium.vector.VectorEnv`, if Gymnasium is installed.

    A sub-environment is a whole team. An observation is an array [B, N, F], an action [B, N] at level `decide` and [B, N, 4] at level
    `drive`. The reward [B] is the team's. `infos` has `alive` [B, N], and at level `decide` the `action_mask` [B, N, A] and
    `masked_action` [B, N]: true for an action that the mask excluded, so that the robot was idle. A dead robot observes zeros, and its
    actions have no effect.

    With `auto_reset` (`AutoresetMode.SAME_STEP`), an environment whose episode ends starts another one in the same step. Then `infos` has
    the last observation of the episode in `final_obs`, and its `outcome`, `seed` and `hash` (see `hashes`) in `final_info`. Without it
    (`AutoresetMode.DISABLED`), `reset(options={"reset_mask": mask})` starts the next episodes.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20, "autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(
        self,
        scenario: Scenario = None,
        envs: int = 1,
        *,
        level: str = "decide",
        period_s: float | None = None,
        ticks: int | None = None,
        controllers: Mapping[str, Controller] | None = None,
        faults: Mapping[str, Any] | list[Mapping[str, Any]] | None = None,
        threads: int = 1,
        robots: int | None = None,
        size: int | None = None,
        limit: float | None = None,
        auto_reset: bool = True,
        copy: bool = True,
        render_mode: str | None = None,
        randomise: Iterable[str] = (),
        shaping: Mapping[str, float] | None = None,
        hashes: bool = False,
    ) -> None:
        """`controllers`: robots with other controllers, as in `run`. All robots without an entry are agents of the environment.

        `period_s`: duration of a step, s, rounded to whole ticks; default at level `decide` 1. `ticks`: the same in ticks of the run; default
        at level `drive` 1. The step repeats its action. `copy`: false to return the arrays of the environment themselves,
        which each call overwrites. `randomise`: what each episode draws from its seed, as in `run`.

        `hashes`: true to compute the hash of each episode, which takes about a sixth of a step. Otherwise `hash` is `None`, unless the episode
        is recorded. The results are the same.

        `shaping`: the weights of the terms that are summed to the reward of a step. `progress` (default 1): the mission's own reward. Others
        are 0 by default and sums over the agents: `approach`, the decrease of the distance to the open work that was nearest at the start of
        the step, m; `travel`, the distance between the positions before and after the step, m; `contact`, the time of steps that end closer to
        something than a quarter of the avoidance range, s.

        Raises `MemoryError` with the bytes of an environment if the batch does not fit into memory.
        """
        # An unpickled environment is created from the arguments.
        self._arguments = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        controllers = {"*": ENVIRONMENT} | by_robot(controllers)
        auto_reset, copy = flag(auto_reset, "auto_reset"), flag(copy, "copy")
        envs, threads = whole(envs, "envs", 1), whole(threads, "threads", 1)
        ticks = None if ticks is None else whole(ticks, "ticks", 1)
        if render_mode not in (None, "rgb_array"):
            raise _engine.ScenarioError(f"render_mode: there is no {shown(render_mode)}; use 'rgb_array' or None")
        period_s = None if period_s is None else seconds(period_s, "period_s")
        request = asked(scenario, controllers, 0, faults, robots, size, limit, randomise=randomise)
        extras = (render_mode is not None, flag(hashes, "hashes"))
        weights = _weights({} if shaping is None else shaping)
        self._worlds = _engine.EnvironmentBatch(request, text(level, "level"), (period_s, ticks), (envs, threads), weights, extras)
        self.level, self.auto_reset, self.copy, self.render_mode = level, auto_reset, copy, render_mode
        self.autoreset_mode = AutoresetMode.SAME_STEP if auto_reset else AutoresetMode.DISABLED
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}
        self.num_envs = envs
        self.agents: list[str] = self._worlds.agents
        _, width, features, actions = self._worlds.shape
        self._seen_shape = (envs, width, features)
        self.observation = np.zeros(self._seen_shape, np.float32)[...]
        self.action_mask = np.zeros((envs, width, actions), np.int8)
        self.alive = np.zeros((envs, width), np.int8)
        self.reward = np.zeros(envs, np.float32)
        #: By environment: 0 running, 1 complete or no robot left, 2 time limit.
        self.done = np.zeros(envs, np.int8)
        self._parts = self._split_arrays()
        shape = (envs, len(self.agents))
        self._shape: tuple[int, ...] = shape if level == "decide" else (*shape, 4)
        self._type: np.dtype[Any] = np.dtype(np.int64 if level == "decide" else np.float32)
        # By environment and agent: the place of its first action in the flat mask.
        self._first_action = (np.arange(envs)[:, None] * width + np.arange(len(self.agents))) * actions
        self._rng = np.random.default_rng()
        self._is_running = False
        # The seed and the actions of an episode, latest first, of an environment that can be pickled.
        self._seed = 0
        self._history: Any = None
        counts = [1 + len(sets) for sets in self.sets]
        vars(self).update(batch_spaces(level, envs, (width, features), counts, _engine.BOUND))

    def _split_arrays(self) -> list[tuple[np.ndarray, ...]]:
        """Returns the arrays of each part of the batch, without observations. There is one part per thread."""
        names, size = ("action_mask", "alive", "reward", "done"), self._worlds.part_size
        for name in names:
            # A view, because NumPy can resize an array that owns its memory, and the parts would keep the old memory.
            setattr(self, name, getattr(self, name)[...])
        arrays = [getattr(self, name) for name in names]
        return [tuple(array[at : at + size] for array in arrays) for at in range(0, self.num_envs, size)]

    @property
    def feature_names(self) -> list[str]:
        """Names of the numbers of an observation, for the first agent."""
        return self.feature_names_of(0)

    def feature_names_of(self, agent: int) -> list[str]:
        """Returns the names of the numbers of an agent's observation. Agents with other sets have other names."""
        return self._worlds.feature_names(agent)

    @property
    def sets(self) -> list[list[str]]:
        """Behavior sets by agent. Action n selects the n-th one; action 0 is idle."""
        return [self._worlds.sets(agent) for agent in range(len(self.agents))]

    @property
    def setup(self) -> dict[str, Any]:
        """Setup of the runs, as in run.json. The seed is the episode's."""
        setup: dict[str, Any] = json.loads(self._worlds.setup)
        return setup

    def reset(self, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode in each environment. Returns observations and infos.

        `seed`: the seed of the first environment, the others follow consecutively; or a list with one seed or `None` for each. Missing seeds
        are drawn: from the last given one, or else from the entropy of the system. With `options={"reset_mask": mask}`, only the
        environments whose entry in the mask is true start an episode.
        """
        mask = self._mask((options or {}).get("reset_mask"), "reset_mask")
        if not (self._is_running or mask.all()):
            raise RuntimeError("reset_mask: the first reset() starts all environments")
        seeds = self._seeds(seed)
        self._worlds.reset([number if chosen else None for number, chosen in zip(seeds, mask.tolist(), strict=True)])
        self._is_running, self.closed = True, False
        self._seed, self._history = seeds[0], None
        self._update_arrays(are_returned=True)
        return self.observation, self._infos()

    def _mask(self, mask: Any, name: str) -> np.ndarray:
        chosen: np.ndarray = np.ones(self.num_envs, bool) if mask is None else np.asarray(mask)
        if chosen.dtype != bool or chosen.shape != (self.num_envs,) or not chosen.any():
            raise ValueError(f"{name}: it must be {self.num_envs} booleans of which at least one is true")
        return chosen

    def snapshot(self, mask: Any = None) -> Snapshot:
        """Returns the states of the environments whose entry in the mask is true; default: all. `restore` continues from them.

        A snapshot is a copy in memory, about as large as its environments. A recorded episode has none.
        """
        if not self._is_running:
            raise RuntimeError("call reset() before a snapshot")
        return Snapshot(self._worlds.states(self._mask(mask, "mask").tolist()), (self._seed, self._history))

    def restore(self, snapshot: Snapshot, mask: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Continues the environments in the mask from a snapshot of this environment or of its deep copy. Returns observations and infos.

        The snapshot has as many environments as the mask (default: all), in the same order, or one, from which all continue.
        """
        if not self._is_running:
            raise RuntimeError("call reset() before restore()")
        self._worlds.restore(snapshot.states, self._mask(mask, "mask").tolist())
        self._seed, self._history = snapshot.past
        self._update_arrays(are_returned=True)
        return self.observation, self._infos()

    def __deepcopy__(self, memo: dict[int, Any]) -> VecEnv:
        own = {name: value for name, value in vars(self).items() if name not in ("_worlds", "_parts")}
        copied = type(self).__new__(type(self))
        memo[id(self)] = copied
        # The past is never changed, and its depth would exceed the recursion limit.
        memo[id(self._history)] = self._history
        vars(copied).update(deepcopy(own, memo))
        copied._worlds = self._worlds.copied()
        copied._parts = copied._split_arrays()
        return copied

    def __getstate__(self) -> dict[str, Any]:
        if self.num_envs > 1 and self._is_running:
            raise TypeError("a batch in mid-episode cannot be pickled; use copy.deepcopy, or pickle an environment of one team")
        past: list[bytes] = []
        history = self._history
        while history:
            history, actions = history
            past.append(actions)
        return {"arguments": self._arguments, "rng": self._rng, "seed": self._seed if self._is_running else None, "past": past[::-1]}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state["arguments"])  # type: ignore[misc]
        self._rng = state["rng"]
        if state["seed"] is not None:
            rng = deepcopy(self._rng)
            self.reset(state["seed"])
            self._rng = rng
            for actions in state["past"]:
                self.advance(np.frombuffer(actions, self._type).reshape(self._shape))

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int]:
        if seed is None or (isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str | bytes)):
            given = [None] * self.num_envs if seed is None else list(seed)
            if len(given) != self.num_envs:
                raise ValueError(f"seed: there are {len(given)} seeds for {self.num_envs} environments")
            drawn = self._rng.integers(DRAWN_MAX, size=self.num_envs).tolist()
            return [number if one is None else whole(one, "seed", 0, SEED_MAX) for one, number in zip(given, drawn, strict=True)]
        first = whole(seed, "seed", 0, SEED_MAX)
        self._rng = np.random.default_rng(first)
        return [(first + place) % (SEED_MAX + 1) for place in range(self.num_envs)]

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Makes one step in each environment. Returns observations, rewards, terminated, truncated and infos.

        `actions` at level `decide`: [B, N], integers from 0 (idle). At level `drive`: [B, N, 4] with speed (0 to 1; robots cannot reverse),
        turn (-1 to 1), gripper (above ½ picks, below -½ drops) and action (above ½ the mission's own, such as a report). Numbers beyond
        -1 and 1 have the effect of these. The time limit truncates; completion and the loss of the last robot terminate.
        """
        actions = self._checked(actions)
        if not self._is_running:
            raise RuntimeError("call reset() first")
        is_over = self._advance(actions)
        self._remember(actions)
        # The arrays still have the mask of these actions, which the engine has found to be in range.
        masked = self.action_mask.reshape(-1)[self._first_action + actions] == 0 if self.level == "decide" else None
        self._update_arrays(are_returned=True)
        infos = self._infos()
        if masked is not None:
            infos["masked_action"] = masked
        if is_over:
            if self.auto_reset:
                infos |= self._final_infos()
            return self.observation, self._returned(self.reward), self.done == 1, self.done == 2, infos
        running = np.zeros((2, self.num_envs), bool)
        return self.observation, self._returned(self.reward), running[0], running[1], infos

    def advance(self, actions: np.ndarray) -> None:
        """Makes one step like `step`, with an array of the right shape and type, and without results: the arrays of the environment have them."""
        if not self._is_running:
            raise RuntimeError("call reset() first")
        self._advance(actions)
        self._remember(actions)
        self._update_arrays()

    def _advance(self, actions: np.ndarray) -> bool:
        """Steps the engine. Ctrl-C ends the episodes, because it leaves some environments without the step."""
        try:
            return self._worlds.step(actions, self.auto_reset)
        except KeyboardInterrupt:
            self._is_running = False
            raise

    def _remember(self, actions: np.ndarray) -> None:
        if self.num_envs == 1 and not self.auto_reset:
            self._history = (self._history, actions.tobytes())

    def _checked(self, actions: Any) -> np.ndarray:
        given = actions if type(actions) is np.ndarray else np.asarray(actions)
        if given.shape != self._shape:
            raise ValueError(f"actions have the shape {given.shape}; it must be {self._shape}")
        if given.dtype == self._type and given.flags.c_contiguous:
            return given
        if given.dtype.kind not in "fiub":
            raise TypeError(f"actions have the type {given.dtype}; write numbers")
        with np.errstate(invalid="ignore"):
            checked = np.ascontiguousarray(given, self._type)
        if given.dtype.kind == "f" and self.level == "decide" and (checked != given).any():
            raise ValueError("actions contain a number that is not whole; an action is 0 for idle, or the number of a set")
        return checked

    def _returned(self, array: np.ndarray) -> np.ndarray:
        return array.copy() if self.copy else array

    def _infos(self) -> dict[str, Any]:
        infos = {"alive": self._returned(self.alive)}
        if self.level == "decide":
            infos["action_mask"] = self._returned(self.action_mask)
        return infos

    def _final_infos(self) -> dict[str, Any]:
        """Returns the ends of episodes in the form of Gymnasium: arrays by environment, and for each a mask with an underscore."""
        ended = np.zeros(self.num_envs, bool)
        observations, hashes, outcomes = (np.full(self.num_envs, None, object) for _ in range(3))
        seeds = np.zeros(self.num_envs, np.uint64)
        for place, observation, run, outcome, seed in self._worlds.ends():
            ended[place] = True
            observations[place] = np.array(observation, np.float32).reshape(self._seen_shape[1:])
            hashes[place], outcomes[place], seeds[place] = run, outcome, seed
        final = {"hash": hashes, "_hash": ended, "outcome": outcomes, "_outcome": ended, "seed": seeds, "_seed": ended}
        return {"final_obs": observations, "_final_obs": ended, "final_info": final, "_final_info": ended}

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

    def picture(self, env: int = 0, width: int = PICTURE_PX) -> np.ndarray:
        """Returns a picture of the room: [height, width, 3], bytes of red, green and blue. Its sides are even, as encoders of films need."""
        drawn = self._worlds.picture(env, whole(width, "width", 64, 4096))
        if drawn is None:
            raise RuntimeError("call reset() before a picture; for one of a finished episode set render_mode='rgb_array'")
        height, width, pixels = drawn
        return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)[: height - height % 2, : width - width % 2].copy()

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Returns a picture of each environment with `render_mode="rgb_array"`, else `None`."""
        return None if self.render_mode is None else tuple(self.picture(env) for env in range(self.num_envs))

    def ended(self, env: int = 0) -> tuple[str | None, str | None]:
        """Returns hash (see `hashes`) and outcome of the finished episode. Without `auto_reset` only."""
        return self._worlds.ended(env)

    def record(self, folder: str | os.PathLike[str], env: int = 0) -> None:
        """Logs the next episode of an environment in a new folder, for `load` and for `alliance watch` and `report`."""
        self._worlds.record(env, Path(folder))

    def close_extras(self, **_: Any) -> None:
        """Ends the current episodes and their logs, for `close`."""
        # Gymnasium also closes an object whose creation failed.
        if "_worlds" in vars(self):
            self._worlds.close()
            self._is_running = False

    def __repr__(self) -> str:
        return f"<VecEnv of {self.num_envs} environments with {len(self.agents)} agents, level {self.level}>"

    def _update_arrays(self, *, are_returned: bool = False) -> None:
        """Reads the results of a call. Observations that the call returns have a new array, unless the environment's own ones are wanted."""
        if are_returned and self.copy:
            # A view cannot be resized.
            self.observation = np.empty(self._seen_shape, np.float32)[...]
        size = self._worlds.part_size
        for number, arrays in enumerate(self._parts):
            self._worlds.see(number, self.observation[number * size : (number + 1) * size], *arrays)


def _weights(shaping: Mapping[str, float]) -> list[tuple[str, float]]:
    """Returns the weights of the terms of the reward. Raises `ScenarioError` for another form."""
    try:
        return [(text(term, "shaping"), float(weight)) for term, weight in shaping.items()]
    except (AttributeError, TypeError, ValueError):
        raise _engine.ScenarioError(f"shaping: {shown(shaping)} is not a dict of weights; write {{'progress': 1.0}}") from None
