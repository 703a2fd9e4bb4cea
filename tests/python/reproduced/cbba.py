"""CBBA on random static instances: its published laws, and the sequential greedy assignment."""

import math
import random
from itertools import combinations, permutations

from exact import partition
from lab import Point, Robot, place, tasks_of
from page import Row, Section, verdict

INSTANCES, QUICK = 200, 10
ROBOTS, POINTS = 3, 6
# The tested lengths of bundles. A bundle of the longer length is never full.
BUNDLE, LONGEST = 3, POINTS
# The rounds in which robots receive the points and make their first bids. The consensus begins after them.
FIRST_ROUNDS = 2
# The discount per second of cost, as in docs/ALLOCATORS.md, and the side of the room.
DISCOUNT, ROOM_M, REACH_M = 0.98, 60.0, 0.1


def missing(given):
    return None


def instance(seed):
    """Returns robots and points. Positions are uniform, the work is U(5, 20) s and the value U(1, 3)."""
    draw = random.Random(seed)
    at = lambda: (round(draw.uniform(2, ROOM_M - 2), 3), round(draw.uniform(2, ROOM_M - 2), 3))
    robots = [Robot(f"r{number}", at()) for number in range(ROBOTS)]
    points = [Point(at(), round(draw.uniform(5, 20), 3), 0.0, None) for _ in range(POINTS)]
    return robots, points, [round(draw.uniform(1, 3), 3) for _ in points]


def scenario(robots, points, values, bundle):
    return {
        "name": "cbba",
        # The rounds end before a robot has done its task for τ, which changes its bid (docs/allocators/cbba.md).
        "step_ms": 5,
        "allocator": "cbba",
        "allocators": {"cbba": {"bundle": bundle}},
        "room": {"width_m": ROOM_M, "height_m": ROOM_M},
        "body": {"speed_m_s": 1.0, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
        "service": {
            "reach_m": REACH_M,
            "kinds": [{"name": "task", "work_s": {"min": 5.0, "max": 20.0}}],
            "points": [
                {"kind": "task", "work_s": point.work_s, "value": value, **place(point.at)}
                for point, value in zip(points, values)
            ],
        },
        "robots": [{"name": robot.name, "start": place(robot.at)} for robot in robots],
    }


class Scores:
    """The score of paths: the sum of value · 0.98^t over its points, each done at the time t, s."""

    def __init__(self, robots, points, values):
        self.robots, self.points, self.values = robots, points, values

    def score(self, robot, path):
        at, time_s, total = self.robots[robot].at, 0.0, 0.0
        for number in path:
            point = self.points[number]
            time_s += max(0.0, math.dist(at, point.at) - REACH_M) + point.work_s
            total += self.values[number] * DISCOUNT**time_s
            at = point.at
        return total

    def best(self, robot, tasks):
        """Returns the best score of a set of points, over all orders."""
        return max(self.score(robot, path) for path in permutations(tasks))

    def greedy(self, bundle):
        """Returns the paths of the sequential greedy assignment: in each turn, the robot and the point of the largest
        bid. A bid is the gain by the best place in the path, and at most the earlier bids of the robot.
        """
        paths = [[] for _ in self.robots]
        limits = [math.inf] * len(paths)
        left = set(range(len(self.points)))
        while left:
            best = None
            for robot, path in enumerate(paths):
                if len(path) == bundle:
                    continue
                before = self.score(robot, path)
                for task in sorted(left):
                    longer = [path[:at] + [task] + path[at:] for at in range(len(path) + 1)]
                    scores = [self.score(robot, each) for each in longer]
                    bid = min(limits[robot], max(scores) - before)
                    if best is None or bid > best[0]:
                        best = (bid, robot, task, longer[scores.index(max(scores))])
            if best is None:
                break
            bid, robot, task, path = best
            paths[robot], limits[robot] = path, bid
            left.remove(task)
        return paths

    def optimum(self):
        """Returns the largest total score, by HiGHS over all sets of points of each robot."""
        sets = [each for count in range(1, BUNDLE + 1) for each in combinations(range(POINTS), count)]
        columns = [(robot, each, self.best(robot, each)) for robot in range(ROBOTS) for each in sets]
        return partition(columns, ROBOTS, POINTS)


def trial(lab, seed):
    case = instance(seed)
    scores = Scores(*case)
    found = {}
    for bundle in (BUNDLE, LONGEST):
        result = lab.allocate(lab.write("cbba.toml", scenario(*case, bundle)))
        tasks = tasks_of(result)
        given = sum(tasks, [])
        found[str(bundle)] = {
            "conflicts": len(given) - len(set(given)),
            "unassigned": POINTS - len(set(given)),
            "rounds": result["rounds"] - FIRST_ROUNDS,
            "stable": result["stable"],
            "like_greedy": tasks == [sorted(path) for path in scores.greedy(bundle)],
        }
        if bundle == BUNDLE:
            total = sum(scores.best(robot, each) for robot, each in enumerate(tasks) if each)
            found["share"] = total / scores.optimum()
    return found


def measure(lab, quick):
    return {str(seed): trial(lab, seed) for seed in range(QUICK if quick else INSTANCES)}


def sections(found):
    trials = list(found.values())
    count = len(trials)
    runs = [trial[str(bundle)] for trial in trials for bundle in (BUNDLE, LONGEST)]
    good = sum(run["conflicts"] == 0 and run["unassigned"] == 0 and run["stable"] for run in runs)
    rounds = {bundle: max(trial[str(bundle)]["rounds"] for trial in trials) for bundle in (BUNDLE, LONGEST)}
    unlike = {
        bundle: [seed for seed, trial in found.items() if not trial[str(bundle)]["like_greedy"]]
        for bundle in (BUNDLE, LONGEST)
    }
    least = min(trial["share"] for trial in trials)
    mean = sum(trial["share"] for trial in trials) / count
    bound = min(ROBOTS * BUNDLE, POINTS)
    return [
        Section(
            "CBBA: laws on random static instances",
            "Choi, Brunet, How, IEEE T-RO 25(4), 2009. Theorems by its abstract and by restatements; the body "
            "was not read.",
            f"{count} instances with {ROBOTS} robots and {POINTS} points, each with bundles of L = {BUNDLE} and "
            f"of L = {LONGEST}. Positions are uniform in {ROOM_M:.0f} × {ROOM_M:.0f} m, work is U(5, 20) s, "
            "values are U(1, 3), and each robot receives all others (D = 1). The score of a path is Σ value · "
            "0.98^t. The reference is written for this test in Python, because public implementations have other "
            "rules for bids (next section).",
            [
                Row(
                    "assignments without conflict",
                    f"{len(runs)} of {len(runs)}",
                    f"{good} of {len(runs)}",
                    verdict(good == len(runs)),
                    "stable, and each point has one robot",
                ),
                Row(
                    "rounds of consensus until the last change",
                    f"at most min(n·L, m)·D = {bound}",
                    f"at most {rounds[BUNDLE]} with L = {BUNDLE}, {rounds[LONGEST]} with L = {LONGEST}",
                    verdict(max(rounds.values()) <= bound),
                    f"counted after the {FIRST_ROUNDS} rounds in which robots receive the points and make their "
                    "first bids",
                ),
                *(
                    Row(
                        f"equal to the sequential greedy assignment, L = {bundle}",
                        f"{count} of {count}",
                        f"{count - len(seeds)} of {count}"
                        + "".join(f"; not with seed {seed}" for seed in seeds),
                        verdict(not seeds),
                        "a robot that gave up a point to a bid that is withdrawn later does not rebuild its "
                        "bundle",
                    )
                    for bundle, seeds in unlike.items()
                ),
                Row(
                    f"share of the optimum, L = {BUNDLE}",
                    "at least 0.5",
                    f"at least {least:.3f}, mean {mean:.3f}",
                    verdict(least >= 0.5),
                    "optimum by HiGHS, over all sets of points in their best order",
                ),
            ],
        )
    ]
