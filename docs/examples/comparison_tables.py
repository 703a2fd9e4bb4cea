#!/usr/bin/env python3
"""Prints the tables of docs/COMPARISON.md: a figure for each allocator and class of faults, one table per mission.

    alliance compare campaigns/allocators.toml
    python3 docs/examples/comparison_tables.py comparisons/allocators [METRIC [MISSION...]]

METRIC is a metric of cells.csv, by default par2_s. The best figure is bold, without regard to the oracle. Runs whose fault had no effect are
excluded.
"""

import csv
import sys
from pathlib import Path

MORE_IS_BETTER = {"completion", "done", "items_per_hour", "observed", "value_collected"}
DIGITS = {"completion": 2, "observed": 2, "detection_s": 1, "takeover_s": 1}


def value(text):
    return float(text) if text else None


def shown(number, metric):
    if number is None:
        return "–"
    return f"{number:.{DIGITS.get(metric, 0)}f}"


def table(rows, metric):
    """Returns the table of one mission."""
    classes = list(dict.fromkeys(row["faults"] for row in rows))
    allocators = list(dict.fromkeys(row["allocator"] for row in rows))
    means = {(row["allocator"], row["faults"]): value(row["mean"]) for row in rows}
    best = {}
    for faults in classes:
        found = [means.get((allocator, faults)) for allocator in allocators if allocator != "oracle"]
        found = [shown(mean, metric) for mean in found if mean is not None]
        choose = max if metric in MORE_IS_BETTER else min
        best[faults] = choose(found, key=float, default=None)
    lines = [[f"`{rows[0]['mission']}`", *(name.replace("-", " ") for name in classes)], ["---"] * (len(classes) + 1)]
    for allocator in allocators:
        line = [f"`{allocator}`"]
        for faults in classes:
            text = shown(means.get((allocator, faults)), metric)
            line.append(f"**{text}**" if allocator != "oracle" and text == best[faults] else text)
        lines.append(line)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main(folder, metric="par2_s", *missions):
    with open(Path(folder) / "cells.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["metric"] == metric]
    if not rows:
        sys.exit(f"{folder}: cells.csv has no metric {metric}")
    for mission in missions or dict.fromkeys(row["mission"] for row in rows):
        print(table([row for row in rows if row["mission"] == mission], metric), end="\n\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
