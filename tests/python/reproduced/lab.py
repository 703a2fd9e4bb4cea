"""Runs of the program under test in a folder, and the scenarios for them."""

import csv
import json
import subprocess
from collections import namedtuple
from pathlib import Path

ROOT = Path(__file__).parents[3]

# The side of the square room of small instances, and the reach of their points, m.
ROOM_M, REACH_M = 100.0, 0.1

Robot = namedtuple("Robot", "name at")
Point = namedtuple("Point", "at work_s opens_s deadline_s")


class Lab:
    """A folder in which the program runs, and the folder with data of others."""

    def __init__(self, program, folder, data):
        self.program = program
        self.folder = Path(folder)
        self.data = Path(data)
        self.runs = 0

    def alliance(self, *arguments):
        """Runs a command and returns its output. An incomplete mission has status 1, which is no error."""
        done = subprocess.run(
            [self.program, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True
        )
        if done.returncode not in (0, 1):
            raise RuntimeError(f"alliance {' '.join(map(str, arguments))}: {done.stderr.strip()}")
        return done.stdout

    def allocators(self):
        """Returns the names of all allocators."""
        return [line.split()[0] for line in self.alliance("list", "allocators").splitlines()]

    def write(self, name, scenario):
        """Writes a scenario and returns its file."""
        lines = [f"{key} = {toml(value)}\n" for key, value in scenario.items()]
        (self.folder / name).write_text("".join(lines), encoding="utf-8")
        return name

    def allocate(self, scenario, *options, rounds=1000):
        """Allocates a scenario without motion and returns the result."""
        return json.loads(self.alliance("run", scenario, f"--allocate-only={rounds}", "--json", *options))

    def run(self, scenario, *options, log="off"):
        """Runs a scenario in one process and returns the result and the folder of the log."""
        self.runs += 1
        out = self.folder / f"run-{self.runs}"
        options = ("--in-process", "--json", "--log", log, "--out", out, *options)
        return json.loads(self.alliance("run", scenario, *options)), out


def rows(folder, table):
    """Returns the rows of a table of a log."""
    with open(folder / f"{table}.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def tasks_of(result):
    """Returns the numbers of the points that each robot has in an allocation."""
    number = lambda task: int(task[len("serve(p") : -1])
    return [sorted(map(number, robot["tasks"])) for robot in result["robots"]]


def toml(value):
    """Returns a value of a scenario as TOML."""
    if isinstance(value, dict):
        pairs = (f"{json.dumps(key)} = {toml(each)}" for key, each in value.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def place(at):
    """Returns a place as keys of a scenario."""
    return {"x_m": at[0], "y_m": at[1]}


def random_place(draw):
    """Draws a place in the room of small instances."""
    return (round(draw.uniform(2, ROOM_M - 2), 3), round(draw.uniform(2, ROOM_M - 2), 3))


def small_scenario(name, limit_s, points, robots):
    """Returns a scenario without motion effects: robots turn at once, pass through each other and drive 1 m/s."""
    return {
        "name": name,
        "step_ms": 100,
        "limit_s": limit_s,
        "room": {"width_m": ROOM_M, "height_m": ROOM_M},
        "body": {"speed_m_s": 1.0, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
        "service": {
            "reach_m": REACH_M,
            "kinds": [{"name": "task", "work_s": {"min": 5.0, "max": 60.0}}],
            "points": points,
        },
        "robots": robots,
    }


def rounded(value, digits=6):
    """Rounds all numbers of a result, so that it is the same text on every machine."""
    if isinstance(value, dict):
        return {key: rounded(each, digits) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(each, digits) for each in value]
    return round(float(value), digits) if isinstance(value, float) else value
