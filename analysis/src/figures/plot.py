"""Draws the numbers of figures with matplotlib, in the size of a column of a paper.

    python3 plot.py [FIGURE.csv ...]        # by default, all figures in this folder; each becomes FIGURE-plot.pdf
"""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt

plt.rcParams.update({"font.size": 8, "figure.figsize": (3.5, 2.4), "figure.constrained_layout.use": True})


def number(text):
    return float(text) if text else float("nan")


def position(values):
    """Returns the place of each value on an axis: numbers to scale, names side by side."""
    values = list(dict.fromkeys(values))
    try:
        return {value: float(value) for value in values}, None
    except ValueError:
        return {value: place for place, value in enumerate(values)}, values


def bars(axes, rows, along, series, mean, low, high, label):
    """Draws estimates with their intervals: one curve per series, beside each other."""
    places, names = position(row[along] for row in rows)
    curves = list(dict.fromkeys(row[series] for row in rows))
    step = min((b - a for a, b in zip(sorted(places.values()), sorted(places.values())[1:])), default=1.0)
    for curve, name in enumerate(curves):
        points = [row for row in rows if row[series] == name and row[mean]]
        shift = step * 0.5 * ((curve + 0.5) / len(curves) - 0.5)
        x = [places[row[along]] + shift for row in points]
        y = [number(row[mean]) for row in points]
        below = [number(row[mean]) - number(row[low]) for row in points]
        above = [number(row[high]) - number(row[mean]) for row in points]
        axes.errorbar(x, y, [below, above], fmt="o", ms=3, lw=1, capsize=2, label=name or None)
    if names is not None:
        axes.set_xticks(range(len(names)), names, rotation=20, ha="right")
    axes.set(xlabel=along, ylabel=label)
    if len(curves) > 1:
        axes.legend(fontsize=6)


def gantt(rows):
    """Draws the work of robots on tasks over time: a row for each task, and within it one for each of its robots."""
    robots = list(dict.fromkeys(row["robot"] for row in rows))
    tasks = list(dict.fromkeys(row["task"] for row in rows))
    figure, axes = plt.subplots(figsize=(3.5, min(0.6 + 0.3 * len(tasks), 9)))
    lanes = {task: [] for task in tasks}
    labeled = set()
    for row in rows:
        if row["robot"] not in lanes[row["task"]]:
            lanes[row["task"]].append(row["robot"])
    for row in rows:
        lane = lanes[row["task"]]
        height = 0.8 / len(lane)
        place = tasks.index(row["task"]) - 0.4 + height * (lane.index(row["robot"]) + 0.5)
        span = number(row["to_s"]) - number(row["from_s"])
        label = None if row["robot"] in labeled else row["robot"]
        labeled.add(row["robot"])
        axes.barh(place, span, height, number(row["from_s"]), color=row["color"], label=label)
    axes.set_yticks(range(len(tasks)), tasks)
    axes.invert_yaxis()
    axes.set(xlabel="simulated time, s")
    if len(robots) <= 12:
        figure.legend(fontsize=6, ncols=4, loc="outside upper center")
    return figure


def draw(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = set(rows[0]) if rows else set()
    if {"allocator", "mean_rank"} <= columns:
        figure, axes = plt.subplots()
        rows.sort(key=lambda row: -number(row["mean_rank"]))
        axes.plot([number(row["mean_rank"]) for row in rows], [row["allocator"] for row in rows], "o")
        axes.set(xlabel=f"mean rank (critical difference {number(rows[0]['critical_difference']):.2f})")
    elif {"allocator", "faults", "mean", "from", "to"} <= columns:
        figure, axes = plt.subplots()
        along = next((name for name in ("faults", "loss", "mission") if len({row[name] for row in rows}) > 1), "allocator")
        bars(axes, rows, along, "allocator" if along != "allocator" else "mission", "mean", "from", "to", rows[0]["metric"])
    elif {"column", "value", "share", "makespan_s"} <= columns:
        shown = [name for name in ("share", "makespan_s", "lateness_s") if any(row[name] for row in rows)]
        figure, all_axes = plt.subplots(len(shown), squeeze=False, figsize=(3.5, 1.8 * len(shown)))
        for row in rows:
            row["curve"] = ", ".join(filter(None, (row["series"], row["faults"])))
        for axes, name in zip(all_axes[:, 0], shown):
            stem, unit = (name[:-2], "_s") if name.endswith("_s") else (name, "")
            bars(axes, rows, "value", "curve", name, f"{stem}_from{unit}", f"{stem}_to{unit}", name)
            axes.set_xlabel(rows[0]["column"])
    elif {"task", "robot", "from_s", "to_s"} <= columns:
        figure = gantt(rows)
    else:
        return
    figure.savefig(path.with_name(f"{path.stem}-plot.pdf"))
    plt.close(figure)


for path in map(Path, sys.argv[1:]) if sys.argv[1:] else sorted(Path(__file__).parent.glob("*.csv")):
    draw(path)
