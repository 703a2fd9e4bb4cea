"""Spaces of Gymnasium. Without Gymnasium, `VecEnv` has no spaces, and works otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gymnasium.vector import AutoresetMode as AutoresetMode
    from gymnasium.vector import VectorEnv as VectorEnv

    HAS_GYMNASIUM = True
else:
    try:
        from gymnasium.vector import AutoresetMode, VectorEnv

        HAS_GYMNASIUM = True
    except ModuleNotFoundError:
        from enum import Enum

        HAS_GYMNASIUM = False

        SPACES = {"single_observation_space", "single_action_space", "observation_space", "action_space"}

        #: Attributes that `VecEnv` has from Gymnasium.
        OF_GYMNASIUM = SPACES | {"unwrapped", "spec", "np_random", "np_random_seed"}

        class AutoresetMode(Enum):
            """Modes with the names of Gymnasium's."""

            SAME_STEP = "SameStep"
            DISABLED = "Disabled"

        class VectorEnv:
            """Stand-in for Gymnasium's class."""

            closed = False

            def __getattr__(self, name: str) -> Any:
                has_no_agents = name in SPACES and not vars(self).get("agents", True)
                hint = "; it needs Gymnasium: pip install 'alliance-sim[env]'" if name in OF_GYMNASIUM and not has_no_agents else ""
                raise AttributeError(f"'{type(self).__name__}' has no attribute '{name}'{hint}")

            def close(self, **options: Any) -> None:
                """Ends the environments."""
                if not self.closed:
                    self.close_extras(**options)
                    self.closed = True


def batch_spaces(level: str, envs: int, shape: tuple[int, int], counts: Sequence[int], bound: float) -> dict[str, Any]:
    """Returns the attributes of a `VectorEnv` with spaces: of the batch, and of one environment.

    `shape`: agents and features of an observation. `counts`: number of actions by agent, at level `decide`.
    """
    if not HAS_GYMNASIUM or not counts:
        return {}
    from gymnasium import spaces
    from gymnasium.vector.utils import batch_space

    seen = spaces.Box(-bound, bound, shape, np.float32)
    act = spaces.MultiDiscrete(list(counts)) if level == "decide" else spaces.Box(-1.0, 1.0, (len(counts), 4), np.float32)
    return {
        "single_observation_space": seen,
        "single_action_space": act,
        "observation_space": batch_space(seen, envs),
        "action_space": batch_space(act, envs),
    }
