"""Robots that learn what to work on, by independent Q-learning in numpy, and whether that beats chance: a minute on two cores.

Each robot of the scenario `janitorial` learns a linear value of what it sees for each of its actions, from the team's reward and
without a teacher; in half of the episodes gold is killed. Compared with it: random choices, and ALLIANCE as it stands.
"""

import time

import numpy as np

from alliance_agent.env import VecEnv, parallel_env

SCENARIO, LIMIT_S = "janitorial", 300.0
KILLED = [{"at_s": 60.0, "fault": {"kill": "gold"}}]
ENVS, STEPS, DISCOUNT, RATE = 32, 3000, 0.9, 0.02


def features(seen):
    """What is seen, and a constant."""
    return np.concatenate([seen, np.ones((*seen.shape[:-1], 1), np.float32)], axis=-1)


def choose(values, mask, rng, chance):
    """The best of the actions that there are, or by chance any of them; to be idle only if there is no other."""
    mask = mask.astype(bool)
    mask[..., 0] = ~mask[..., 1:].any(-1)
    best = np.where(mask, values, -np.inf).argmax(-1)
    any_ = np.where(mask, rng.random(mask.shape), -1).argmax(-1)
    return np.where(rng.random(best.shape) < chance, any_, best)


def learn(seed=1):
    """Weights of each robot: [robots, actions, features]."""
    rng = np.random.default_rng(seed)
    halves = [VecEnv(SCENARIO, ENVS // 2, faults=faults, limit=LIMIT_S) for faults in ([], KILLED)]
    together = [np.concatenate([half.reset(100) for half in halves]), np.concatenate([half.action_mask for half in halves])]
    seen, mask = together
    _, robots, actions = mask.shape
    weights = np.zeros((robots, actions, seen.shape[-1] + 1), np.float32)
    for step in range(STEPS):
        now = features(seen)
        values = np.einsum("bnf,naf->bna", now, weights)
        chosen = choose(values, mask, rng, max(0.05, 1 - 2 * step / STEPS))
        for half, part in zip(halves, np.split(chosen, 2), strict=True):
            half.step(part)
        seen = np.concatenate([half.observation for half in halves])
        mask = np.concatenate([half.action_mask for half in halves])
        alive = np.concatenate([half.alive for half in halves])
        reward = np.concatenate([half.reward for half in halves])
        done = np.concatenate([half.done for half in halves])
        later = np.where(mask, np.einsum("bnf,naf->bna", features(seen), weights), -np.inf).max(-1)
        target = reward[:, None] + DISCOUNT * later * (done == 0)[:, None]
        error = (target - np.take_along_axis(values, chosen[..., None], -1)[..., 0]) * alive
        for robot in range(robots):
            for action in range(actions):
                of_it = (chosen[:, robot] == action)[:, None]
                gradient = (error[:, robot, None] * now[:, robot] * of_it).mean(0)
                weights[robot, action] += RATE * gradient
    return weights


def try_out(policy, faults, seeds=range(1, 21)):
    """Points done in an episode, and how many are open on average, over seeds that nobody has learned from."""
    env = parallel_env(SCENARIO, faults=faults, limit=LIMIT_S, minds={"*": policy} if isinstance(policy, str) else None)
    done, waiting = [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        seen, _ = env.reset(seed)
        while env.hash is None:
            actions = {}
            for rank, agent in enumerate(env.agents):
                looks, mask = seen[agent]["observation"], seen[agent]["action_mask"]
                values = np.zeros(len(mask)) if policy is None else policy[rank] @ features(looks)
                actions[agent] = int(choose(values, mask, rng, 1.0 if policy is None else 0.0))
            seen, *_ = env.step(actions)
            waiting.append(env.row()["open"])
        done.append(env.row()["done"])
    return np.mean(done), np.mean(waiting)


def main():
    began = time.process_time()
    weights = learn()
    print(f"learned from {ENVS * STEPS:,} steps in {time.process_time() - began:.0f} s of processor time")
    print(f"{'points done / open':<28}{'no faults':>14}{'gold killed':>16}")
    policies = {"any choice, each second": None, "random": "random", "learned": weights, "ALLIANCE": "alliance"}
    results = {}
    for name, policy in policies.items():
        results[name] = [try_out(policy, faults) for faults in ([], KILLED)]
        print(f"{name:<28}" + "".join(f"{done:>8.1f} / {waiting:.2f} " for done, waiting in results[name]))
    for by_chance in "any choice, each second", "random":
        for (done, waiting), (least, most) in zip(results["learned"], results[by_chance], strict=True):
            assert done >= least and waiting < most, "it does not beat chance"


if __name__ == "__main__":
    main()
