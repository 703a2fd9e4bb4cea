"""Steps of environments per second of processor time, beside what was aimed at. The median of five turns.

Processor time of the whole process, its threads and the system's part included: other work on the machine changes it little, but for
large batches, which do not fit into the caches that they share with it. The exit status is 1 if a row is below half of its aim.
"""

import statistics
import time

import numpy as np

from alliance_agent.env import VecEnv, parallel_env

#: Processor time of a turn, s.
TURN_S = 1.0


def turn(step, of_a_call=1):
    """Steps per second in one turn."""
    calls, began = 0, time.process_time()
    while (spent := time.process_time() - began) < TURN_S:
        step()
        calls += 1
    return calls * of_a_call / spent


def rate(step, of_a_call=1):
    """Median of five turns."""
    step()
    return statistics.median(turn(step, of_a_call) for _ in range(5))


def parallel(level, robots):
    """A step of PettingZoo's dicts, with random actions that were drawn before."""
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


def batch(level, envs, robots, threads=1):
    """A step of all environments of a batch."""
    env = VecEnv("observe" if level == "drive" else "service", envs, level=level, robots=robots, threads=threads)
    env.reset()
    rng = np.random.default_rng(1)
    shape = (envs, robots)
    actions = rng.integers(0, 2, shape) if level == "decide" else rng.uniform(-1, 1, (*shape, 4)).astype(np.float32)
    return lambda: env.step(actions)


def rows():
    """Names, what makes a step, how many environments that is, and the aim."""
    for robots, aim in {3: 60_000, 10: 25_000, 30: 9_000}.items():
        yield f"parallel_env, drive, {robots} robots", parallel("drive", robots), 1, aim
    yield "parallel_env, decide, 3 robots", parallel("decide", 3), 1, 15_000
    for envs in (64, 256, 512, 1024):
        yield f"VecEnv, drive, {envs} of 3 robots", batch("drive", envs, 3), envs, 300_000
    # 1.8 times as fast on two cores: 0.9 of it on each.
    yield "VecEnv, drive, 64 of 3 robots, 2 threads", batch("drive", 64, 3, 2), 64, 270_000
    yield "VecEnv, decide, 64 of 3 robots", batch("decide", 64, 3), 64, None


if __name__ == "__main__":
    print(f"{'':<44}{'steps/s':>12}{'aim':>12}")
    slow = []
    for name, step, envs, aim in rows():
        found = rate(step, envs)
        print(f"{name:<44}{found:>12,.0f}{aim:>12,}" if aim else f"{name:<44}{found:>12,.0f}")
        if aim and found < aim / 2:
            slow.append(name)
    if slow:
        raise SystemExit(f"below half of what is aimed at: {'; '.join(slow)}")
