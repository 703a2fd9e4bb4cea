"""Learning environments in this process, without a bus or other processes. An episode is identical to a run.

- `parallel_env`: PettingZoo's parallel API, for SuperSuit, TorchRL and others; needs `pip install alliance-sim[env]`.
- `RobotEnv`: one robot as a `gymnasium.Env`; also `gymnasium.make("alliance_sim.env:alliance/Observe-Drive-v0")`.
- `VecEnv`: a batch of environments in arrays, a `gymnasium.vector.VectorEnv`; one call steps them all, without the GIL.

At level `decide`, a step takes a second or ends earlier with a behavior set, and an action is one of the robot's sets or idle. At
level `drive`, a step is a tick or several, and an action drives the body.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ._run import Controller, Scenario
from ._spaces import HAS_GYMNASIUM
from ._vector import Reward, Snapshot, VecEnv

if HAS_GYMNASIUM:
    from ._robot import RobotEnv, register

    register()

if TYPE_CHECKING:
    from ._parallel import ParallelEnv

__all__ = ["Reward", "RobotEnv", "Snapshot", "VecEnv", "parallel_env"]


def parallel_env(
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
) -> ParallelEnv:
    """Returns an environment with PettingZoo's parallel API.

    `scenario`: name of a built-in one, TOML file, or dict; default: the default mission. `robots`, `size`: for missions of variable size.
    `limit`: time limit, simulated seconds.
    `level`: `decide` or `drive`. `period_s`: duration of a step, s, rounded to whole ticks; default at level `decide` 1. `ticks`: the same in ticks.
    `controllers`: robots with other controllers, as in `run`. All others are agents.
    `faults`: replaces the scenario's faults. `revive`: a killed robot stays an agent, because it may restart.
    `reward`: a function of mission.csv's columns before and after a step and of the step's events; default: the mission's progress.
    `time_cost` is subtracted from the reward of each step.
    `info_events`: `infos` have also `faults`, `events`, and in the last step `hash` and `outcome`, which are not numbers.
    `render_mode`: `rgb_array` or `None`. `randomise`: what each episode draws from its seed, as in `run`.
    `shaping`: weights of terms of the reward, see `VecEnv`; not together with `reward`.
    """
    try:
        from ._parallel import ParallelEnv
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{error.name} is missing; install it with: pip install 'alliance-sim[env]'", name=error.name
        ) from error
    return ParallelEnv(
        scenario,
        level=level,
        period_s=period_s,
        ticks=ticks,
        controllers=controllers,
        faults=faults,
        revive=revive,
        reward=reward,
        time_cost=time_cost,
        robots=robots,
        size=size,
        limit=limit,
        info_events=info_events,
        render_mode=render_mode,
        randomise=randomise,
        shaping=shaping,
    )


def __getattr__(name: str) -> Any:
    if name == "RobotEnv":
        raise ModuleNotFoundError("gymnasium is missing; install it with: pip install 'alliance-sim[env]'", name="gymnasium")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
