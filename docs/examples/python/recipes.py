"""Trains a small policy for a mission in a few minutes, and compares it with idle and with random robots.

    python3 recipes.py MISSION [SEED [FILE]]    # waste, service, push or observe; FILE receives the weights

The learner is the cross-entropy method: a generation draws policies from a normal distribution, tries all of them in the same episodes, and
fits the distribution to the best ones. A batch contains all episodes of a generation. Each episode draws its layout and starts.
"""

import json
import sys
import time

import numpy as np

from alliance_sim.env import VecEnv

#: Environment of each mission. The time is too short for most teams, so that a better policy has a higher score.
MISSIONS = {
    "waste": {"limit": 200.0},
    "service": {"robots": 3, "size": 12, "limit": 150.0},
    "push": {"robots": 3, "size": 1, "limit": 200.0},
    # The choice of a set matters little in this mission, so the policy drives the robots: a decision takes half a second.
    "observe": {"robots": 3, "size": 6, "limit": 120.0, "level": "drive", "ticks": 10},
}
UNITS = {"waste": "items", "service": "points", "push": "m", "observe": "targets in sight"}
POLICIES, BEST, EPISODES, GENERATIONS = 48, 8, 6, 20
#: Episodes of a test. Their seeds begin at 1, those of a training at 100,000.
TESTS = 64
#: Features of a set: applicable, active, cost, age, claims, and its place.
SET_FEATURES = 8


def environment(mission, envs, controllers=None):
    return VecEnv(mission, envs, controllers=controllers, randomise={"start", "layout"}, auto_reset=False, **MISSIONS[mission])


def scores(env, mission, total):
    """Returns the score of each episode, given the sum of its rewards."""
    if mission == "observe":
        return total / MISSIONS[mission]["limit"]
    if mission == "push":
        # A bar that arrives is a rare reward, so the score is the mean distance of its two ends from their start.
        rows = [env.row(place) for place in range(env.num_envs)]
        return np.array([(row["left_m"] + row["right_m"]) / 2 for row in rows])
    return total


def play(env, mission, seeds, choose):
    """Returns the scores of the episodes with these seeds. `choose` returns the actions for observations and masks."""
    env.reset(seed=seeds)
    total = np.zeros(env.num_envs)
    while not env.done.all():
        running = env.done == 0
        env.advance(choose(env.observation, env.action_mask))
        total += env.reward * running
    return scores(env, mission, total)


def allocating(env):
    """Returns the number of weights, and the function that returns actions: that of the applicable set with the highest score.

    A score is the weighted sum of the features of the set, plus a number for this robot and set. That of no set is 0.
    """
    robots, sets = len(env.agents), env.action_mask.shape[-1] - 1
    first = env.feature_names.index(f"{env.sets[0][0]}.applicable")

    def choose(weights, seen, mask):
        features = seen[..., first : first + sets * SET_FEATURES].reshape(-1, robots, sets, SET_FEATURES)
        own = weights[:, SET_FEATURES:].reshape(-1, robots, sets)
        values = np.where(mask[..., 1:], np.einsum("bnsf,bf->bns", features, weights[:, :SET_FEATURES]) + own, -np.inf)
        return np.where(values.max(-1) > 0.0, values.argmax(-1) + 1, 0)

    return SET_FEATURES + robots * sets, choose


def driving(env):
    """Returns the number of weights, and the function that returns actions: weighted sums of features of what the robot senses.

    A place has three features: its direction, the size of this angle, and its distance.
    """
    names = env.feature_names
    near = [place for place, name in enumerate(names) if name.endswith(".near")]
    targets, mates = ([name[:-2] for name in names if name.startswith(kind) and name.endswith(".x")] for kind in ("target", "mate"))

    number = {name: place for place, name in enumerate(names)}

    def at(seen, name):
        return seen[..., number[name]]

    def features(seen):
        cos, sin = at(seen, "heading.cos"), at(seen, "heading.sin")
        x, y, count = (sum(at(seen, f"{target}.{what}") for target in targets) for what in ("x", "y", "there"))
        places = [(at(seen, f"{target}.x"), at(seen, f"{target}.y")) for target in targets[:2]]
        places.append((x / np.maximum(count, 1), y / np.maximum(count, 1)))
        # Targets are in the robot's frame. Teammates and the middle of the room are turned into it.
        for name, sign in [*((mate, 1) for mate in mates), ("position", -1)]:
            x, y = sign * at(seen, f"{name}.x"), sign * at(seen, f"{name}.y")
            places.append((cos * x + sin * y, cos * y - sin * x))
        angles = [np.arctan2(y, x) / np.pi for x, y in places]
        distances = [np.hypot(x, y) for x, y in places]
        return np.stack([*angles, *map(abs, angles), *distances, count / 4, np.ones_like(count), *(seen[..., place] for place in near)], -1)

    def choose(weights, seen, _):
        given = features(seen)
        values = np.einsum("bnf,baf->bna", given, weights.reshape(len(weights), 2, -1))
        actions = np.zeros((*values.shape[:2], 4), np.float32)
        actions[..., :2] = np.clip(values, [0, -1], 1)
        # The robots always observe.
        actions[..., 3] = 1
        return actions

    return 2 * features(env.observation).shape[-1], choose


def policy(env):
    return driving(env) if env.level == "drive" else allocating(env)


def train(mission, seed):
    """Yields the weights after each generation: the mean of those of the last ten."""
    rng, env = np.random.default_rng(seed), environment(mission, POLICIES * EPISODES)
    count, choose = policy(env)
    mean, spread, means = np.zeros(count), np.ones(count), []
    for generation in range(GENERATIONS):
        tried = mean + spread * rng.standard_normal((POLICIES, count))
        # Each generation has other episodes.
        seeds = 100_000 * seed + EPISODES * generation + np.arange(EPISODES)
        each = np.repeat(tried, EPISODES, 0)
        results = play(env, mission, np.tile(seeds, POLICIES).tolist(), lambda seen, mask: choose(each, seen, mask))
        best = tried[np.argsort(-results.reshape(POLICIES, EPISODES).mean(-1), kind="stable")[:BEST]]
        mean, spread = best.mean(0), np.maximum(best.std(0), 0.05)
        means.append(mean)
        yield np.mean(means[-10:], 0)


def test(mission, weights):
    """Returns the scores of a policy in the episodes of the test."""
    env = environment(mission, TESTS)
    _, choose = policy(env)
    each = np.repeat(np.asarray(weights)[None], TESTS, 0)
    return play(env, mission, list(range(1, TESTS + 1)), lambda seen, mask: choose(each, seen, mask))


def baselines(mission):
    """Returns the scores of robots without training, by name."""
    seeds, rng = list(range(1, TESTS + 1)), np.random.default_rng(1)
    env = environment(mission, TESTS)
    shape = (TESTS, len(env.agents))
    idle = np.zeros(shape, np.int64) if env.level == "decide" else np.zeros((*shape, 4), np.float32)

    def anything(_, mask):
        if env.level == "decide":
            return np.where(mask, rng.random(mask.shape), -1).argmax(-1)
        return rng.uniform(-1, 1, idle.shape).astype(np.float32)

    found = {"idle": play(env, mission, seeds, lambda *_: idle), "random actions": play(env, mission, seeds, anything)}
    for name in ("random", "alliance"):
        rules = environment(mission, TESTS, {"*": name})
        found[f"allocator {name}"] = play(rules, mission, seeds, lambda *_: idle[:, :0])
    return found


def main(mission, seed=1, file=None):
    for name, found in baselines(mission).items():
        print(f"{name:<24}{found.mean():7.2f} ± {1.96 * found.std() / np.sqrt(TESTS):.2f} {UNITS[mission]}", flush=True)
    spent, began = 0.0, time.process_time()
    for generation, weights in enumerate(train(mission, int(seed)), 1):
        spent += time.process_time() - began
        if generation in (1, 3, 10, GENERATIONS):
            found = test(mission, weights)
            print(f"generation {generation:2}, {spent:4.0f} s{found.mean():10.2f} ± {1.96 * found.std() / np.sqrt(TESTS):.2f}", flush=True)
        began = time.process_time()
    if file:
        with open(file, "w") as stream:
            json.dump(np.round(weights, 3).tolist(), stream)


if __name__ == "__main__":
    main(*sys.argv[1:4])
