"""Gaps of small instances with the properties of points: needs, precedence, deliveries, windows with values."""

import math
import random
from dataclasses import dataclass, field

from exact import schedule
from lab import place, random_place, small_scenario
from page import table

ROBOTS, SEEDS = 3, 10


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
    return [random_place(draw) for _ in range(count)]


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
    points = [point(number, task) for number, task in enumerate(drawn)]
    robots = [{"name": f"r{rank}", "start": place(at), "skills": skills} for rank, at in enumerate(starts)]
    return small_scenario("class", 5000.0, points, robots)


def measure(lab, seeds, allocators):
    found = {}
    for name in CLASSES:
        for seed in seeds:
            starts, drawn = instance(name, seed)
            file = lab.write("class.toml", scenario(starts, drawn))
            trial = {"optimum": schedule(starts, drawn)}
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
