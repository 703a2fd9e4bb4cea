"""Environment steps per second, with their targets. Each figure is the median of five rounds.

Seconds are those of processor time, which other processes affect little, except for large batches, which share the caches with
them. Batches on several threads are measured by the wall clock, because a thread looks for work before it sleeps. The exit status
is 1 if a row is below half of its target.
"""

import statistics
import time

import numpy as np

from alliance_sim.env import VecEnv, parallel_env

#: Time of a round, s.
TURN_S = 1.0


def turn(step, steps_per_call=1, clock=time.process_time):
    """Returns the steps per second of one round. `steps_per_call` is the number of steps of one call."""
    calls, began = 0, clock()
    while (spent := clock() - began) < TURN_S:
        step()
        calls += 1
    return calls * steps_per_call / spent


def rate(step, steps_per_call, clock):
    """Returns the median of five rounds."""
    step()
    return statistics.median(turn(step, steps_per_call, clock) for _ in range(5))


def parallel(level, robots):
    """Returns a step of PettingZoo's dicts, with random actions drawn in advance."""
    env = parallel_env("observe" if level == "drive" else "service", level=level, robots=robots)
    env.reset(seed=1)
    for agent in env.agents:
        env.action_space(agent).seed(1)
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}

    def step():
        _, _, _, cut, _ = env.step(actions)
        if not env.agents:
            env.reset()

    return step


def batch(level, envs, robots, threads=1, **options):
    """Returns a step of all environments of a batch."""
    env = VecEnv("observe" if level == "drive" else "service", envs, level=level, robots=robots, threads=threads, **options)
    env.reset()
    rng = np.random.default_rng(1)
    shape = (envs, robots)
    actions = rng.integers(0, 2, shape) if level == "decide" else rng.uniform(-1, 1, (*shape, 4)).astype(np.float32)
    return lambda: env.step(actions)


def rows():
    """Yields name, step function, number of environments per step, target, and clock."""
    for row in on_one_thread():
        yield *row, time.process_time
    for envs, target in {64: 540_000, 1024: 600_000}.items():
        name = f"VecEnv, drive, {envs} of 3 robots, 2 threads"
        yield name, batch("drive", envs, 3, 2), envs, target, time.perf_counter
        yield f"{name}, hashes", batch("drive", envs, 3, 2, hashes=True), envs, target, time.perf_counter


def on_one_thread():
    """Yields name, step function, number of environments per step, and target."""
    for robots, target in {3: 60_000, 10: 25_000, 30: 9_000}.items():
        yield f"parallel_env, drive, {robots} robots", parallel("drive", robots), 1, target
    yield "parallel_env, decide, 3 robots", parallel("decide", 3), 1, 15_000
    for envs in (32, 64, 256, 512, 1024):
        yield f"VecEnv, drive, {envs} of 3 robots", batch("drive", envs, 3), envs, 300_000
    # In ticks per second.
    yield "VecEnv, drive, 1024 of 3 robots, ticks=10", batch("drive", 1024, 3, ticks=10), 10 * 1024, 300_000
    yield "VecEnv, decide, 64 of 3 robots", batch("decide", 64, 3), 64, None


if __name__ == "__main__":
    print(f"{'':<44}{'steps/s':>12}{'target':>12}")
    slow = []
    for name, step, envs, target, clock in rows():
        found = rate(step, envs, clock)
        print(f"{name:<44}{found:>12,.0f}{target:>12,}" if target else f"{name:<44}{found:>12,.0f}")
        if target and found < target / 2:
            slow.append(name)
    if slow:
        raise SystemExit(f"below half of the target: {'; '.join(slow)}")
