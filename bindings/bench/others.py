"""Steps of environments per second of processor time, in turns with others that people use: MPE2, RWARE and, where torch is there, VMAS.

    pip install mpe2 rware vmas

The missions are not the same, so that a ratio says what a step costs a learner, and nothing else. One thread each.
"""

import statistics

from environments import batch, parallel, turn

ROUNDS = 5


def mpe(robots):
    """Cooperative navigation: the parallel environment, with random actions that were drawn before."""
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
    """The small warehouse, four agents."""
    import gymnasium
    import rware  # noqa: F401: it registers its environments

    env = gymnasium.make("rware-small-4ag-v2", disable_env_checker=True)
    env.reset(seed=1)
    actions = env.action_space.sample()

    def step():
        _, _, ended, cut, _ = env.step(actions)
        if ended or cut:
            env.reset()

    return step


def vmas(scenario, envs):
    """A batch on the processor."""
    import torch
    import vmas

    torch.set_num_threads(1)
    env = vmas.make_env(scenario, num_envs=envs, device="cpu", continuous_actions=True, seed=1)
    actions = [torch.rand(envs, 2) * 2 - 1 for _ in env.agents]
    return lambda: env.step(actions)


def rows():
    """Names, what makes a step, and how many environments it steps."""
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
