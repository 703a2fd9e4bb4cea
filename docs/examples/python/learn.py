"""Learns task allocation with independent Q-learning in numpy, and compares it with random choices and with ALLIANCE.

Each robot of the scenario `janitorial` learns a linear value function of its observation for each action, from the team's reward. In
half of the episodes, gold is killed. Takes about a minute on two cores.
"""

import time

import numpy as np

from alliance_sim.env import VecEnv, parallel_env

SCENARIO, LIMIT_S = "janitorial", 300.0
KILLED = [{"at_s": 60.0, "fault": {"kill": "gold"}}]
ENVS, STEPS, DISCOUNT, RATE = 32, 3000, 0.9, 0.02


def features(seen):
    """Appends a constant feature to the observations."""
    return np.concatenate([seen, np.ones((*seen.shape[:-1], 1), np.float32)], axis=-1)


def choose(values, mask, rng, chance):
    """Returns the best allowed action, or with probability `chance` a random one. Idle is returned only without another action."""
    mask = mask.astype(bool)
    mask[..., 0] = ~mask[..., 1:].any(-1)
    best = np.where(mask, values, -np.inf).argmax(-1)
    any_ = np.where(mask, rng.random(mask.shape), -1).argmax(-1)
    return np.where(rng.random(best.shape) < chance, any_, best)


def learn(seed=1):
    """Returns the weights of each robot: [robots, actions, features]."""
    rng = np.random.default_rng(seed)
    halves = [VecEnv(SCENARIO, ENVS // 2, faults=faults, limit=LIMIT_S) for faults in ([], KILLED)]
    together = [np.concatenate([half.reset(100)[0] for half in halves]), np.concatenate([half.action_mask for half in halves])]
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
                is_chosen = (chosen[:, robot] == action)[:, None]
                gradient = (error[:, robot, None] * now[:, robot] * is_chosen).mean(0)
                weights[robot, action] += RATE * gradient
    return weights


def try_out(policy, faults, seeds=range(1, 21)):
    """Returns the mean numbers of completed and of open points per episode, for seeds outside the training."""
    env = parallel_env(SCENARIO, faults=faults, limit=LIMIT_S, controllers={"*": policy} if isinstance(policy, str) else None)
    done, waiting = [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        seen, _ = env.reset(seed)
        while env.hash is None:
            actions = {}
            for rank, agent in enumerate(env.agents):
                observation, mask = seen[agent]["observation"], seen[agent]["action_mask"]
                values = np.zeros(len(mask)) if policy is None else policy[rank] @ features(observation)
                actions[agent] = int(choose(values, mask, rng, 1.0 if policy is None else 0.0))
            seen, *_ = env.step(actions)
            waiting.append(env.row()["open"])
        done.append(env.row()["done"])
    return np.mean(done), np.mean(waiting)


def main():
    start = time.process_time()
    weights = learn()
    print(f"learned from {ENVS * STEPS:,} steps in {time.process_time() - start:.0f} s of processor time")
    print(f"{'points done / open':<28}{'no faults':>14}{'gold killed':>16}")
    policies = {"random choice each second": None, "random": "random", "learned": weights, "ALLIANCE": "alliance"}
    results = {}
    for name, policy in policies.items():
        results[name] = [try_out(policy, faults) for faults in ([], KILLED)]
        print(f"{name:<28}" + "".join(f"{done:>8.1f} / {waiting:.2f} " for done, waiting in results[name]))
    for baseline in "random choice each second", "random":
        for (done, waiting), (least, most) in zip(results["learned"], results[baseline], strict=True):
            # All points that arrive can be done, so the open ones show the difference; one of 20 episodes may end a point earlier.
            assert done > least - 0.1 and waiting < most, "the learned policy is not better than random choices"


if __name__ == "__main__":
    main()
