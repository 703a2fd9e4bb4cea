"""Measures the speed of runs with and without observers for other tools: `--ros` and `--foxglove`.

    observer_rates.py PROGRAM [ROUNDS]

Each round runs the scenario waste-cleanup with 3, 30 and 100 robots at full speed, once per observer. Prints a table of BENCHMARKS.md: the
median of the ticks per second, the smallest and the largest value. The world measures them from its first tick to its last
one, so the time that observers need after the end of the run does not count.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from ros_topics import free_port, open_session

# The number of robots, and the simulated time of a run, s.
TEAMS = {3: 600, 30: 60, 100: 20}


def ticks_per_s(program, robots, observer):
    with tempfile.TemporaryDirectory() as folder:
        limit = TEAMS[robots]
        words = ["--robots", str(robots), "--limit", str(limit), "--speed", "max", "--no-page", "--log", "compact"]
        command = [program, "run", "waste-cleanup", *words, "--out", f"{folder}/run", *observer]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        # Status 1: the mission is not complete at the limit. The small team completes it before.
        if done.returncode not in (0, 1):
            sys.exit(f"the run with {robots} robots ended with {done.returncode}: {done.stderr}")
        return json.loads(Path(folder, "run", "host.json").read_text())["ticks_per_s"]


def main(program, rounds="3"):
    port = free_port()
    _router = open_session("router", port)
    observers = {
        "none": [],
        "`--ros`": ["--ros", f"--ros-router=tcp/127.0.0.1:{port}"],
        "`--foxglove`": [f"--foxglove=127.0.0.1:{free_port()}"],
    }
    rates = {(name, robots): [] for name in observers for robots in TEAMS}
    for _ in range(int(rounds)):
        for robots in TEAMS:
            for name, options in observers.items():
                rates[name, robots].append(ticks_per_s(program, robots, options))
    print("| observer | " + " | ".join(f"{robots} robots" for robots in TEAMS) + " |")
    print("|---" * (1 + len(TEAMS)) + "|")
    for name in observers:
        row = (rates[name, robots] for robots in TEAMS)
        cells = (f"{statistics.median(cell):,.0f} [{min(cell):,.0f} .. {max(cell):,.0f}]" for cell in row)
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main(*sys.argv[1:])
    # The threads of the open session would keep the process.
    sys.stdout.flush()
    os._exit(0)
