"""GRAPE, figure 7: three published instances with 320 robots and 5 tasks."""

import csv
import math
import random

import numpy as np
from scipy.optimize import linear_sum_assignment

from lab import place
from page import Row, Section, verdict

# Published: the sizes of coalitions, the global utility, the guaranteed share of the optimum by theorem 3, and the number
# of decisions.
PUBLISHED = {
    "circle": ([57, 44, 73, 70, 76], 461_790.574323, 0.649984, 1_355),
    "skew": ([80, 56, 88, 57, 39], 350_669.081888, 0.630972, 1_380),
    "square": ([62, 50, 93, 49, 66], 309_411.453208, 0.637530, 1_295),
}
# Rooms start at 0, and the instances have places from -500 to 500 m.
SHIFT_M = 500.0
RANGE_M = 50.0
ROUNDS = 5_000
# The runs of the published algorithm, each with other stamps, in all and with --check.
STAMPS, QUICK_STAMPS = 20, 2
# The largest distance from the published sum. Stable partitions are not unique.
CLOSE = 0.02


def missing(given):
    folder = given.data / "grape"
    return None if folder.is_dir() else f"there is no folder {folder}"


class Instance:
    """Places, demands and the recorded allocation of a published instance."""

    def __init__(self, file):
        with open(file, newline="", encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
        at = lambda row: (float(row["x_m"]), float(row["y_m"]))
        tasks = [row for row in rows if row["kind"] == "task"]
        robots = [row for row in rows if row["kind"] == "robot"]
        self.tasks = np.array([at(row) for row in tasks])
        self.robots = np.array([at(row) for row in robots])
        self.demand = np.array([float(row["demand"]) for row in tasks])
        self.recorded = [int(row["task"]) - 1 for row in robots]
        self.distance = np.linalg.norm(self.robots[:, None] - self.tasks[None], axis=2)
        self.apart = np.linalg.norm(self.robots[:, None] - self.robots[None], axis=2)
        self.scale = self.demand / math.log2(len(robots) / len(tasks) + 1)

    def utility(self, robot, task, members):
        share = np.log2(members + 1) / members
        return np.maximum(0.0, self.scale[task] * share - self.distance[robot, task])

    def has_links(self, file):
        """Tests whether the robots within the radio range are those of the recorded links."""
        with open(file, newline="", encoding="utf-8") as lines:
            recorded = {(int(row["a"]), int(row["b"])) for row in csv.DictReader(lines)}
        near = np.argwhere(np.triu(self.apart <= RANGE_M, 1)) + 1
        return recorded == set(map(tuple, near.tolist()))

    def sizes(self, allocation):
        return [allocation.count(task) for task in range(len(self.tasks))]

    def total(self, allocation):
        sizes = self.sizes(allocation)
        own = [(robot, task) for robot, task in enumerate(allocation) if task is not None]
        return float(sum(self.utility(robot, task, sizes[task]) for robot, task in own))

    def would_move(self, allocation):
        """Returns the number of robots to which another coalition is worth more than their own."""
        sizes = self.sizes(allocation)
        count = 0
        for robot, own in enumerate(allocation):
            worth = [self.utility(robot, task, sizes[task] + (task != own)) for task in range(len(sizes))]
            # Robots compute with places in single precision.
            count += bool(max(worth) > (0.0 if own is None else worth[own]) + 1e-3)
        return count

    def published_run(self, seed):
        """Runs algorithms 1 and 2 of the paper with these stamps. Returns the decisions of the partition on which all
        robots agree, and the rounds. In a round each robot decides, and then takes the newest partition within range.
        """
        count, tasks = self.distance.shape
        robots = np.arange(count)
        worth = np.outer(self.scale, [math.log2(members + 1) / members for members in range(1, count + 1)])
        near = self.apart <= RANGE_M
        draw = random.Random(seed)
        # The partition that each robot knows, with its decisions and its stamp. The task -1 is none.
        known = np.full((count, count), -1, dtype=np.int8)
        decisions, stamps = np.zeros(count, dtype=int), np.zeros(count)
        rounds = 0
        is_agreed = False
        while not is_agreed:
            rounds += 1
            own = known[robots, robots]
            others = np.stack([(known == task).sum(axis=1) for task in range(tasks)], axis=1)
            others -= own[:, None] == np.arange(tasks)
            utility = worth[np.arange(tasks), others] - self.distance
            best = np.where(utility.max(axis=1) > 0, utility.argmax(axis=1), -1)
            moved = np.flatnonzero(best != own)
            known[moved, moved] = best[moved]
            decisions[moved] += 1
            stamps[moved] = [draw.random() for _ in moved]
            order = np.empty(count, dtype=int)
            order[np.lexsort((stamps, decisions))] = robots
            newest = np.where(near, order, -1).argmax(axis=1)
            is_agreed = bool((known[newest] == known).all())
            known, decisions, stamps = known[newest], decisions[newest], stamps[newest]
        return {"decisions": int(decisions[0]), "rounds": rounds}

    def optimum(self):
        """Returns the largest global utility without the bound at 0. The gain of a further member falls with the
        members, so that the best assignment of robots to places of coalitions is the optimum.
        """
        members = np.arange(len(self.robots) + 1)
        gains = np.diff(self.scale[:, None] * np.log2(members + 1)[None], axis=1)
        worth = gains.reshape(1, -1) - np.repeat(self.distance, len(self.robots), axis=1)
        robots, places = linear_sum_assignment(worth, maximize=True)
        return float(worth[robots, places].sum())

    def scenario(self):
        task_count, most = len(self.tasks), len(self.robots)
        moved = lambda at: place((at + SHIFT_M).tolist())
        return {
            "name": "grape",
            # The rounds end before a robot gives up a task on which it makes no progress.
            "step_ms": 5,
            "room": {"width_m": 2 * SHIFT_M, "height_m": 2 * SHIFT_M},
            "radio": {"range_m": RANGE_M},
            "allocator": "grape",
            "allocators": {"grape": {"utility": "published"}},
            # At 1 m/s, and with work as long as the way within reach, the cost in s is the distance in m.
            "body": {"speed_m_s": 1.0, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
            "service": {
                "reach_m": 1.0,
                "kinds": [{"name": "task", "work_s": {"min": 1.0, "max": 1.0}}],
                "points": [
                    {"kind": "task", "value": float(demand), **moved(at)}
                    for at, demand in zip(self.tasks, self.demand)
                ],
            },
            "tasks": {f"serve(p{task})": {"max_robots": most} for task in range(task_count)},
            "robots": [
                {"name": f"r{number}", "start": moved(at)} for number, at in enumerate(self.robots, 1)
            ],
        }


def measure(lab, quick):
    found = {}
    for name in ["skew"] if quick else PUBLISHED:
        instance = Instance(lab.data / "grape" / f"{name}.csv")
        assert instance.has_links(lab.data / "grape" / f"{name}-links.csv"), "the same radio graph"
        result = lab.allocate(lab.write("grape.toml", instance.scenario()), rounds=ROUNDS)
        tasks = [robot["tasks"] for robot in result["robots"]]
        assert all(len(each) <= 1 for each in tasks), "a robot has one task"
        allocation = [int(each[0][len("serve(p") : -1]) if each else None for each in tasks]
        found[name] = {
            "sizes": instance.sizes(allocation),
            "total": instance.total(allocation),
            "optimum": instance.optimum(),
            "would_move": instance.would_move(allocation),
            "stable": result["stable"],
            "rounds": result["rounds"],
            "messages": result["messages"],
            "recorded_would_move": instance.would_move(instance.recorded),
            "recorded_total": instance.total(instance.recorded),
            "recorded_sizes": instance.sizes(instance.recorded),
            "published_runs": {
                str(seed): instance.published_run(seed) for seed in range(QUICK_STAMPS if quick else STAMPS)
            },
        }
    return found


def sections(found):
    rows = []
    text = lambda sizes: " ".join(map(str, sizes))
    for name, (sizes, total, share, decisions) in PUBLISHED.items():
        each = found[name]
        stays = each["recorded_would_move"]
        rows.append(
            Row(
                f"{name}: the recorded partition is stable",
                f"0 of 320 robots gain by a move; sum {total:,.1f}; coalitions {text(sizes)}",
                f"{stays} of 320; sum {each['recorded_total']:,.1f}; coalitions {text(each['recorded_sizes'])}",
                verdict(
                    stays == 0
                    and abs(each["recorded_total"] / total - 1) < 1e-9
                    and each["recorded_sizes"] == sizes
                ),
                "the same formula; the test `grape_keeps_the_published_partition` steps each robot",
            )
        )
        away = each["total"] / total - 1
        rows.append(
            Row(
                f"{name}: global utility from an empty partition",
                f"{total:,.1f}, at least {share:.3f} of the optimum",
                f"{each['total']:,.1f} ({away:+.2%}), {each['total'] / each['optimum']:.4f} of the optimum;"
                f" {each['would_move']} robots gain by a move; coalitions {text(each['sizes'])}",
                verdict(
                    each["stable"]
                    and each["would_move"] == 0
                    and abs(away) <= CLOSE
                    and each["total"] >= share * each["optimum"]
                ),
                "stable partitions are not unique: sums may differ by 2 %",
            )
        )
        runs = each["published_runs"].values()
        counts, rounds = ([run[key] for run in runs] for key in ("decisions", "rounds"))
        is_inside = lambda value, values: min(values) <= value <= max(values)
        rows.append(
            Row(
                f"{name}: number of decisions",
                f"{decisions:,}; the algorithm with {STAMPS} other sets of stamps: {min(counts):,} to {max(counts):,} "
                f"in {min(rounds):,} to {max(rounds):,} rounds",
                f"at least {sum(each['sizes'])}, at most {each['rounds']:,}, the rounds",
                verdict(is_inside(decisions, counts) and is_inside(each["rounds"], rounds)),
                "each robot decides at least once, and a round adds at most one decision to the partition that "
                "wins; the stamps of the published run are not recorded",
            )
        )
    return [
        Section(
            "GRAPE: three instances of figure 7",
            "Jang, Shin, Tsourdos, IEEE T-RO 34(6), 2018; instances from the repository inmo-jang/GRAPE (MIT "
            "license).",
            "320 robots, 5 tasks, radio range 50 m, whose links are those of the instances. Robots stand still "
            '(`--allocate-only`), with `utility = "published"` '
            "([GRAPE](allocators/grape.md)). The optimum is exact: an assignment of robots to places of "
            "coalitions. Numbers of decisions depend on the random stamps by which robots choose between two "
            "partitions, so that the paper's algorithm, written for this page, runs with others.",
            rows,
        )
    ]
