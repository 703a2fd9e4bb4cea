"""Agent-steps per second, in turns with other environments: MPE2, RWARE, VMAS (needs torch) and JaxMARL.

    pip install mpe2 rware vmas jaxmarl
    python3 others.py [--all-cores] [WORD...]    # only rows whose name contains all words

The missions differ, so a ratio compares only the cost of a step for a learner. Batches have one thread each, and seconds are
those of processor time. With `--all-cores`, batches have a thread for each core, and seconds are those of the wall clock.
"""

import os
import statistics
import sys
import time

ALL_CORES = "--all-cores" in sys.argv
THREADS = os.cpu_count() if ALL_CORES else 1
CLOCK = time.perf_counter if ALL_CORES else time.process_time

# Read by XLA when JAX is imported.
if not ALL_CORES:
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

    torch.set_num_threads(THREADS)
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
    """Yields group, name, constructor of the step function, and agent-steps per call. The first row of a group is the reference."""
    for robots in (3, 10, 30):
        yield f"{robots} robots", "parallel_env, drive", lambda robots=robots: parallel("drive", robots), robots
        yield f"{robots} robots", "MPE2 simple_spread", lambda robots=robots: mpe(robots), robots
    yield "4 robots", "parallel_env, drive", lambda: parallel("drive", 4), 4
    yield "4 robots", "RWARE small", rware, 4
    for envs in (1, 32, 1024):
        group, agents = f"batch of {envs}", 3 * envs
        yield group, "VecEnv, drive", lambda envs=envs: batch("drive", envs, 3, THREADS), agents
        yield group, "VecEnv, drive, hashes", lambda envs=envs: batch("drive", envs, 3, THREADS, hashes=True), agents
        # In agent-ticks.
        yield group, "VecEnv, drive, ticks=10", lambda envs=envs: batch("drive", envs, 3, THREADS, ticks=10), 10 * agents
        yield group, "VMAS simple_spread", lambda envs=envs: vmas("simple_spread", envs), agents
        for steps in (1, SCANNED):
            name = f"JaxMARL simple_spread, {steps} a call"
            yield group, name, lambda envs=envs, steps=steps: jaxmarl(envs, steps), agents * steps


if __name__ == "__main__":
    steps = {}
    words = [word for word in sys.argv[1:] if word != "--all-cores"]
    for group, name, make, agents in rows():
        if not all(word in f"{group}: {name}" for word in words):
            continue
        try:
            step = make()
            step()
        except ImportError as missing:
            print(f"{group}: {name}: {missing}")
            continue
        steps[group, name] = step, agents
    turns = {row: [] for row in steps}
    for _ in range(ROUNDS):
        for row, (step, agents) in steps.items():
            turns[row].append(turn(step, agents, CLOCK))
    unit = "agent-steps per second" if ALL_CORES else "agent-steps per second of processor time"
    print(f"{unit:<52}{'median':>12}{'range':>26}{'reference / row':>28}")
    reference = {}
    for (group, name), found in turns.items():
        first = reference.setdefault(group, found)
        ratios = [one / other for one, other in zip(first, found, strict=True)]
        compared = "" if first is found else f"{statistics.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}"
        extent = f"{min(found):,.0f} to {max(found):,.0f}"
        print(f"{group + ': ' + name:<52}{statistics.median(found):>12,.0f}{extent:>26}{compared:>28}")
