"""Learning environments in this process, without a bus or other processes. An episode is identical to a run.

- `parallel_env`: PettingZoo's parallel API, for SuperSuit, TorchRL and others; needs `pip install alliance-sim[env]`.
- `VecEnv`: a batch of environments in arrays; one call steps them all, without the GIL.

At level `decide`, a step takes a second or ends earlier with a behavior set, and an action is one of the robot's sets or idle. At
level `drive`, a step is a tick, and an action drives the body.
"""

from __future__ import annotations

from typing import Any

from ._run import Scenario
from ._vector import Reward, VecEnv

__all__ = ["Reward", "VecEnv", "parallel_env"]


def parallel_env(scenario: Scenario = None, **options: Any) -> Any:
    """Returns an environment with PettingZoo's parallel API. See `alliance_sim._parallel.ParallelEnv` for the options."""
    try:
        from ._parallel import ParallelEnv
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{error.name} is missing; install it with: pip install 'alliance-sim[env]'", name=error.name
        ) from error
    return ParallelEnv(scenario, **options)
