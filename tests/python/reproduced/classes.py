"""Small instances with the properties of points: needs, precedence, deliveries, windows with values. Their optima are
by HiGHS.
"""

import math
import random
from dataclasses import dataclass, field

import numpy as np
from lab import place
from page import table
from scipy.optimize import Bounds, LinearConstraint, milp

ROBOTS, ROOM_M, REACH_M, SEEDS = 3, 100.0, 0.1, 10


@dataclass
class Task:
    at: tuple
    work_s: float
    slots: int = 1
    after: list = field(default_factory=list)
    deliver_to: tuple | None = None
    opens_s: float = 0.0
    deadline_s: float | None = None
    value: float = 1.0

    @property
    def end(self):
        return self.deliver_to or self.at

    @property
    def duration_s(self):
        return self.work_s + math.dist(self.at, self.end)


def places(draw, count):
    return [(round(draw.uniform(2, ROOM_M - 2), 3), round(draw.uniform(2, ROOM_M - 2), 3)) for _ in range(count)]


def tasks(draw, count):
    return [Task(at, round(draw.uniform(5, 60), 3)) for at in places(draw, count)]


def needs(draw):
    drawn = tasks(draw, 5)
    drawn[0].slots = drawn[1].slots = 2
    return drawn


def precedence(draw):
    drawn = tasks(draw, 6)
    drawn[1].after, drawn[2].after, drawn[4].after = [0], [1], [3]
    return drawn


def deliveries(draw):
    drawn = tasks(draw, 5)
    for task, to in zip(drawn, places(draw, 5)):
        task.deliver_to = to
    return drawn


def windows(draw):
    drawn = tasks(draw, 8)
    for task in drawn:
        task.opens_s = round(draw.uniform(0, 120), 3)
        task.deadline_s = round(task.opens_s + task.work_s + draw.uniform(20, 60), 3)
        task.value = float(draw.randint(1, 9))
    return drawn


# The classes, and what the optimum is of: the makespan or the value.
CLASSES = {"needs": needs, "precedence": precedence, "deliveries": deliveries, "windows and values": windows}


def instance(name, seed):
    """Returns the starts of the robots and the tasks."""
    draw = random.Random(f"{name} {seed}")
    return places(draw, ROBOTS), CLASSES[name](draw)


def scenario(starts, drawn):
    def point(number, task):
        found = {"name": f"t{number}", "kind": "task", "work_s": task.work_s, **place(task.at)}
        if task.slots > 1:
            found["needs"] = {"arm": task.slots}
        if task.after:
            found["after"] = [f"t{each}" for each in task.after]
        if task.deliver_to:
            found["deliver_to"] = list(task.deliver_to)
        if task.deadline_s:
            found |= {"opens_s": task.opens_s, "deadline_s": task.deadline_s, "value": task.value}
        return found

    has_needs = any(task.slots > 1 for task in drawn)
    skills = {"task": 1.0, "arm": 1.0} if has_needs else {"task": 1.0}
    return {
        "name": "class",
        "step_ms": 100,
        "limit_s": 5000.0,
        "room": {"width_m": ROOM_M, "height_m": ROOM_M},
        "body": {"speed_m_s": 1.0, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
        "service": {
            "reach_m": REACH_M,
            "kinds": [{"name": "task", "work_s": {"min": 5.0, "max": 60.0}}],
            "points": [point(number, task) for number, task in enumerate(drawn)],
        },
        "robots": [
            {"name": f"r{rank}", "start": place(at), "skills": skills}
            for rank, at in enumerate(starts)
        ],
    }


def optimum(starts, drawn):
    """Returns the least makespan, s, or the largest value if the tasks have windows.

    Variables: the ways of each robot between places, the start of each task, whether it is done, and the makespan. A
    robot may drive to a task before its predecessors are done, and waits there.
    """
    count, robots = len(drawn), range(len(starts))
    horizon = sum(task.duration_s + 2 * ROOM_M for task in drawn) + 300.0
    ways = [(r, i, j) for r in robots for i in range(-1, count) for j in range(count) if i != j]
    way = {each: number for number, each in enumerate(ways)}
    start, done, last = len(ways), len(ways) + count, len(ways) + 2 * count
    rows, lower, upper = [], [], []

    def limit(terms, least=-np.inf, most=np.inf):
        row = np.zeros(last + 1)
        for at, factor in terms:
            row[at] += factor
        rows.append(row)
        lower.append(least)
        upper.append(most)

    for r in robots:
        limit([(way[r, -1, j], 1) for j in range(count)], most=1)
    for j, task in enumerate(drawn):
        into = [[(way[r, i, j], 1) for i in range(-1, count) if i != j] for r in robots]
        limit([*sum(into, []), (done + j, -task.slots)], 0, 0)
        for r in robots:
            limit([*into[r], (done + j, -1)], most=0)
            limit([*((way[r, j, k], 1) for k in range(count) if k != j), *((at, -1) for at, _ in into[r])], most=0)
            for i in range(-1, count):
                if i != j:
                    before = (starts[r], 0.0) if i < 0 else (drawn[i].end, drawn[i].duration_s)
                    needed = before[1] + math.dist(before[0], task.at)
                    terms = [(start + j, 1), (way[r, i, j], -horizon), *([(start + i, -1)] if i >= 0 else [])]
                    limit(terms, least=needed - horizon)
        for i in task.after:
            limit([(start + j, 1), (start + i, -1)], least=drawn[i].duration_s)
        limit([(last, 1), (start + j, -1)], least=task.duration_s)
    has_windows = drawn[0].deadline_s is not None
    goal = np.zeros(last + 1)
    low, high = np.zeros(last + 1), np.ones(last + 1)
    high[start:done], high[last] = horizon, np.inf
    if has_windows:
        goal[done:last] = [-task.value for task in drawn]
        low[start:done] = [task.opens_s for task in drawn]
        # The start of a task that is left out has no meaning.
        high[start:done] = [task.deadline_s - task.duration_s for task in drawn]
    else:
        goal[last] = 1
        low[done:last] = 1
    kinds = np.ones(last + 1)
    kinds[start:done] = kinds[last] = 0
    limits = LinearConstraint(np.array(rows), lower, upper)
    found = milp(goal, constraints=limits, integrality=kinds, bounds=Bounds(low, high), options={"mip_rel_gap": 1e-6})
    assert found.success, found.message
    return -float(found.fun) if has_windows else float(found.fun)


def measure(lab, seeds, allocators):
    found = {}
    for name in CLASSES:
        for seed in seeds:
            starts, drawn = instance(name, seed)
            file = lab.write("class.toml", scenario(starts, drawn))
            trial = {"optimum": optimum(starts, drawn)}
            for allocator in allocators:
                result, _ = lab.run(file, "--allocator", allocator)
                if drawn[0].deadline_s is not None:
                    trial[allocator] = result["result"]["value_collected"] / trial["optimum"]
                else:
                    done = result["outcome"] == "complete"
                    trial[allocator] = result["result"]["makespan_ms"] / 1000 / trial["optimum"] - 1 if done else None
            found.setdefault(name, {})[str(seed)] = trial
    return found


def classes_table(found):
    lines = []
    trials = {name: list(each.values()) for name, each in found.items()}
    for allocator in list(trials["needs"][0])[1:]:
        line = [f"`{allocator}`"]
        for name, each in trials.items():
            values = [trial[allocator] for trial in each if trial[allocator] is not None]
            mean = f"{sum(values) / len(values):.0%}" if values else "–"
            line.append(mean if name == "windows and values" else f"{mean} ({len(values)})")
        lines.append(line)
    return table(["allocator", *found], lines)
