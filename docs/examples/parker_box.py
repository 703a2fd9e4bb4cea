"""Draws the box of Parker's experiment and the robots at its ends over time, from the CSV files of a run.

    alliance run parker-box --in-process --out box
    python parker_box.py box parker-box.svg

Needs Python only.
"""

import csv
import json
import math
import sys
from pathlib import Path

run = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/latest")
picture = Path(sys.argv[2] if len(sys.argv) > 2 else "parker-box.svg")


def rows(name):
    with open(run / name, newline="") as file:
        return list(csv.DictReader(file))


setup = json.loads((run / "run.json").read_text())
push = setup["scenario"]["push"]
box = push["bars"][0]
half_m = push["length_m"] / 2
robots = [robot["name"] for robot in setup["scenario"]["robots"]]
states = [
    (float(row["t_ms"]) / 1000, float(row["left_m"]), float(row["right_m"]), float(row["skew_rad"]))
    for row in rows("mission.csv")
]
events = rows("events.csv")
end_s = max(float(row["t_ms"]) for row in events) / 1000

WIDTH, MARGIN, LANE_PX, ROW_PX = 960, 84, 200, 46
COLORS = ["#c2452d", "#2a6db5", "#7a5c3e", "#2e8b57"]
out = []


def text(x, y, content, anchor="start", size=13, color="#333"):
    out.append(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{color}" text-anchor="{anchor}">{content}</text>')


def line(x1, y1, x2, y2, color, width, more=""):
    out.append(
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{color}" stroke-width="{width}" {more}/>'
    )


# Positions of the box, seen from above.
scale = (WIDTH - MARGIN - 24) / (box["goal_x_m"] + 1.0)
middle = LANE_PX / 2 + 24


def place(x_m, beside_m):
    return MARGIN + x_m * scale, middle - beside_m * 0.7 * scale


text(8, 18, "the box from above")
next_m, drawn = -1.0, []
for t_s, left_m, right_m, skew_rad in states:
    way_m = (left_m + right_m) / 2
    if way_m >= next_m + (box["goal_x_m"] - box["x_m"]) / 16 or t_s == states[-1][0]:
        next_m = way_m
        drawn.append((t_s, left_m, right_m, skew_rad))
for index, (t_s, left_m, right_m, skew_rad) in enumerate(drawn):
    across_m = half_m * math.cos(skew_rad)
    shade = 0.35 + 0.65 * index / (len(drawn) - 1)
    top, low = place(box["x_m"] + left_m, across_m), place(box["x_m"] + right_m, -across_m)
    line(*top, *low, "#444", 7, f'stroke-linecap="round" opacity="{shade:.2f}"')
    text(low[0], low[1] + 18, f"{t_s:.0f}", "middle", 11, "#777")
goal = place(box["goal_x_m"], half_m + 0.3), place(box["goal_x_m"], -half_m - 0.3)
line(*goal[0], *goal[1], "#2e8b57", 2, 'stroke-dasharray="6 4"')
text(8, middle + 92, "at … s", size=11, color="#777")

# Work of each robot on the ends of the box, over time.
top_px = LANE_PX + 66
seconds = (WIDTH - MARGIN - 24) / end_s


def at(t_s):
    return MARGIN + t_s * seconds


height = top_px + ROW_PX * len(robots) + 42
text(8, top_px - 22, "work on a stroke, including the drive to it: left end above, right end below")
for rank, robot in enumerate(robots):
    y = top_px + ROW_PX * rank + ROW_PX / 2
    color = COLORS[rank % len(COLORS)]
    text(8, y + 5, robot, color=color)
    line(at(0), y, at(end_s), y, "#ddd", 1)
    active = None
    for row in events:
        if row["robot"] != robot:
            continue
        t_s = float(row["t_ms"]) / 1000
        if row["kind"] == "activated":
            active = (t_s, row["detail"])
        elif active and row["kind"] in ("hibernated", "gone"):
            side = -1 if "left" in active[1] else 1
            low, high = sorted([y + side * 2, y + side * 17])
            # Pale after giving up or a kill.
            share = "0.95" if row["reason"] == "not-applicable" else "0.3"
            out.append(
                f'<rect x="{at(active[0]):.1f}" y="{low:.1f}" width="{max(1.0, (t_s - active[0]) * seconds):.1f}" '
                f'height="{high - low:.1f}" fill="{color}" opacity="{share}"/>'
            )
            active = None
bottom = top_px + ROW_PX * len(robots)
for fault in setup["faults"]:
    name, robot = next(iter(fault["order"]["fault"].items()))
    for key, word in (("applied_ms", f"{name} {robot}"), ("healed_ms", "")):
        if fault[key] is not None:
            t_s = fault[key] / 1000
            line(at(t_s), top_px - 8, at(t_s), bottom, "#555", 1, 'stroke-dasharray="3 3"')
            text(at(t_s) + 3, top_px - 4, word, size=12)
for t_s in range(0, int(end_s) + 1, 50):
    line(at(t_s), bottom, at(t_s), bottom + 5, "#777", 1)
    text(at(t_s), bottom + 20, f"{t_s} s", "middle", 11, "#777")
picture.write_text(
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}" '
    'font-family="Helvetica, Arial, DejaVu Sans, sans-serif">\n'
    f'<rect width="{WIDTH}" height="{height:.0f}" fill="white"/>\n' + "\n".join(out) + "\n</svg>\n"
)
