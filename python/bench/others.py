"""Environment steps per second of processor time, in turns with other environments: MPE2, RWARE and, if torch is installed, VMAS.

    pip install mpe2 rware vmas

The missions differ, so a ratio compares only the cost of a step for a learner. All use one thread.
"""

import statistics

from environments import batch, parallel, turn

ROUNDS = 5


def mpe(robots):
    """Returns a step of cooperative navigation in the parallel API, with random actions drawn in advance."""
    from mpe2 import simple_spread_v3

    env = simple_spread_v3.parallel_env(N=robots)
    env.reset(seed=1)
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}

    def step():
        env.step(actions)
        if not env.agents:
            env.reset()

    return step


def rware():
    """Returns a step of the small warehouse with four agents."""
    import gymnasium
    import rware  # noqa: F401: the import registers the environments

    env = gymnasium.make("rware-small-4ag-v2", disable_env_checker=True)
    env.reset(seed=1)
    actions = env.action_space.sample()

    def step():
        _, _, ended, cut, _ = env.step(actions)
        if ended or cut:
            env.reset()

    return step


def vmas(scenario, envs):
    """Returns a step of a batch on the processor."""
    import torch
    import vmas

    torch.set_num_threads(1)
    env = vmas.make_env(scenario, num_envs=envs, device="cpu", continuous_actions=True, seed=1)
    actions = [torch.rand(envs, 2) * 2 - 1 for _ in env.agents]
    return lambda: env.step(actions)


def rows():
    """Yields name, constructor of the step function, and number of environments per step."""
    for robots in (3, 10, 30):
        yield f"parallel_env, drive, {robots} robots", lambda robots=robots: parallel("drive", robots), 1
        yield f"MPE2 simple_spread, {robots} robots", lambda robots=robots: mpe(robots), 1
    yield "parallel_env, drive, 4 robots", lambda: parallel("drive", 4), 1
    yield "RWARE small, 4 robots", rware, 1
    for envs in (1, 32, 1024):
        yield f"VecEnv, drive, {envs} of 3 robots", lambda envs=envs: batch("drive", envs, 3), envs
        yield f"VMAS simple_spread, {envs} of 3 robots", lambda envs=envs: vmas("simple_spread", envs), envs


if __name__ == "__main__":
    steps = {}
    for name, make, envs in rows():
        try:
            steps[name] = make(), envs
        except ImportError as missing:
            print(f"{name}: {missing}")
    turns = {name: [] for name in steps}
    for _ in range(ROUNDS):
        for name, (step, envs) in steps.items():
            turns[name].append(turn(step, envs))
    for name, found in turns.items():
        print(f"{name:<44}{statistics.median(found):>12,.0f}   {min(found):,.0f} to {max(found):,.0f}")
