"""Learning libraries accept the environments. Needs torch, which is large.

    pip install --requirement requirements-learning.txt
"""

import numpy as np
from alliance_sim.env import parallel_env
from conftest import needed


def test_stable_baselines_learns_with_supersuit():
    stable_baselines, supersuit = needed("stable_baselines3"), needed("supersuit")
    env = parallel_env("observe", level="drive", robots=3, limit=30)
    env = supersuit.pettingzoo_env_to_vec_env_v1(env)
    env = supersuit.concat_vec_envs_v1(env, 2, num_cpus=1, base_class="stable_baselines3")
    model = stable_baselines.PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=1, device="cpu")
    before = [layer.detach().clone() for layer in model.policy.parameters()]
    model.learn(2 * 64 * env.num_envs)
    assert model.num_timesteps >= 2 * 64 * 6
    after = list(model.policy.parameters())
    assert any(not np.array_equal(one.numpy(), other.detach().numpy()) for one, other in zip(before, after))


def test_torchrl_accepts_the_specifications():
    needed("torchrl")
    from torchrl.envs import PettingZooWrapper
    from torchrl.envs.utils import check_env_specs

    for level in "drive", "decide":
        mission = "observe" if level == "drive" else "janitorial"
        env = PettingZooWrapper(
            parallel_env(mission, level=level, limit=30), use_mask=True, categorical_actions=level == "decide"
        )
        check_env_specs(env)
        steps = env.rollout(20)
        assert steps.batch_size[-1] == 20
