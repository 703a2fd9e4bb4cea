"""Environment steps per second of processor time, in turns with other environments: MPE2, RWARE, VMAS (needs torch) and JaxMARL.

    pip install mpe2 rware vmas jaxmarl
    python3 others.py [WORD]    # only rows whose name contains the word

The missions differ, so a ratio compares only the cost of a step for a learner. Processor time includes all threads. VMAS and
JaxMARL are limited to one thread.
"""

import os
import statistics
import sys

# Read by XLA when JAX is imported.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

from environments import batch, parallel, turn

ROUNDS = 5

#: Steps of JaxMARL in one compiled loop.
SCANNED = 25


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


def jaxmarl(envs, steps):
    """Returns a call of `steps` steps of a batch, compiled as a whole, with random actions drawn in advance."""
    import jax
    from jaxmarl import make

    env = make("MPE_simple_spread_v3")
    keys = jax.random.split(jax.random.key(1), envs)
    actions = {agent: jax.random.randint(jax.random.key(2), (envs,), 0, 5) for agent in env.agents}

    def one(carry, _):
        keys, state = carry
        seen, state, reward, done, _ = jax.vmap(env.step)(keys, state, actions)
        return (keys, state), (seen, reward, done)

    @jax.jit
    def call(state):
        (_, state), results = jax.lax.scan(one, (keys, state), None, length=steps)
        return state, results

    latest = [jax.vmap(env.reset)(keys)[1]]

    def step():
        latest[0], results = call(latest[0])
        jax.block_until_ready(results)

    return step


def rows():
    """Yields name, constructor of the step function, and number of environments per step."""
    for robots in (3, 10, 30):
        yield f"parallel_env, drive, {robots} robots", lambda robots=robots: parallel("drive", robots), 1
        yield f"MPE2 simple_spread, {robots} robots", lambda robots=robots: mpe(robots), 1
    yield "parallel_env, drive, 4 robots", lambda: parallel("drive", 4), 1
    yield "RWARE small, 4 robots", rware, 1
    for envs in (1, 32, 1024):
        yield f"VecEnv, drive, {envs} of 3 robots", lambda envs=envs: batch("drive", envs, 3), envs
        yield f"VecEnv, drive, {envs} of 3 robots, ticks=10, in ticks", lambda envs=envs: batch("drive", envs, 3, ticks=10), 10 * envs
        yield f"VMAS simple_spread, {envs} of 3 robots", lambda envs=envs: vmas("simple_spread", envs), envs
        for steps in (1, SCANNED):
            yield f"JaxMARL simple_spread, {envs} of 3 robots, {steps} a call", lambda envs=envs, steps=steps: jaxmarl(envs, steps), envs * steps


if __name__ == "__main__":
    steps = {}
    for name, make, envs in rows():
        if not all(word in name for word in sys.argv[1:]):
            continue
        try:
            steps[name] = make(), envs
            steps[name][0]()
        except ImportError as missing:
            print(f"{name}: {missing}")
    turns = {name: [] for name in steps}
    for _ in range(ROUNDS):
        for name, (step, envs) in steps.items():
            turns[name].append(turn(step, envs))
    for name, found in turns.items():
        print(f"{name:<52}{statistics.median(found):>12,.0f}   {min(found):,.0f} to {max(found):,.0f}")
