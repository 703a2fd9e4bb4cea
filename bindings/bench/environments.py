"""Steps of environments per second of processor time, beside what was aimed at. The median of five turns.

Processor time of the whole process, its threads and the system's part included: other work on the machine changes it little.
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


if __name__ == "__main__":
    print(f"{'':<44}{'steps/s':>12}{'aim':>12}")
    for robots, aim in {3: 60_000, 10: 25_000, 30: 9_000}.items():
        print(f"{f'parallel_env, drive, {robots} robots':<44}{rate(parallel('drive', robots)):>12,.0f}{aim:>12,}")
    print(f"{'parallel_env, decide, 3 robots':<44}{rate(parallel('decide', 3)):>12,.0f}{15_000:>12,}")
    print(f"{'VecEnv, drive, 64 of 3 robots':<44}{rate(batch('drive', 64, 3), 64):>12,.0f}{300_000:>12,}")
    print(f"{'VecEnv, drive, 64 of 3 robots, 2 threads':<44}{rate(batch('drive', 64, 3, 2), 64):>12,.0f}")
    print(f"{'VecEnv, drive, 1,024 of 3 robots':<44}{rate(batch('drive', 1024, 3), 1024):>12,.0f}{300_000:>12,}")
    print(f"{'VecEnv, decide, 64 of 3 robots':<44}{rate(batch('decide', 64, 3), 64):>12,.0f}")
