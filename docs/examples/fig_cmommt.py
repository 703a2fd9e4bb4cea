"""Compares four policies of CMOMMT from a sweep: prints a table and writes a figure.

    alliance sweep analysis/sweeps/cmommt.toml --out cmommt
    python3 docs/examples/fig_cmommt.py cmommt docs/img/cmommt.svg

Needs Python only. A/n is the mean share of targets in sight. Intervals are 95 % bootstrap intervals.
"""

import csv
import random
import sys
from collections import defaultdict
from pathlib import Path
from statistics import mean, stdev

POLICIES = ["random", "fixed", "local", "a-cmommt"]
COLORS = {"random": "#8d897f", "fixed": "#de9e00", "local": "#1854a8", "a-cmommt": "#b0282d"}
RESAMPLES = 2000

sweep = Path(sys.argv[1] if len(sys.argv) > 1 else "cmommt")
picture = Path(sys.argv[2] if len(sys.argv) > 2 else "cmommt.svg")


def interval(values):
    """Returns the bootstrap percentile interval of the mean."""
    draws = random.Random(0)
    means = sorted(mean(draws.choices(values, k=len(values))) for _ in range(RESAMPLES))
    return means[RESAMPLES // 40], means[-RESAMPLES // 40]


# A/n by targets per robot, team, radius, policy and seed.
shares = defaultdict(dict)
for row in csv.DictReader((sweep / "results.csv").open()):
    robots, _, targets, _ = row["name"].split("-")
    robots, targets = int(robots), int(targets)
    place = (targets / robots, robots, targets, float(row["room.width_m"]) / 2)
    shares[place, row["observe.policy"]][int(row["seed"])] = float(row["a"])
places = sorted({place for place, _ in shares})

print("| n/m | robots, targets | R, m | " + " | ".join(POLICIES) + " | A-CMOMMT − local, paired |")
print("|---" * (4 + len(POLICIES)) + "|")
for place in places:
    of = {policy: shares[place, policy] for policy in POLICIES}
    cells = []
    for policy in POLICIES:
        values = list(of[policy].values())
        cells.append(f"{mean(values):.3f} ± {stdev(values) / len(values) ** 0.5:.3f}")
    gains = [of["a-cmommt"][seed] - of["local"][seed] for seed in of["local"]]
    low, high = interval(gains)
    ratio, robots, targets, radius = place
    sure = "**" if low > 0 or high < 0 else ""
    gain = f"{sure}{mean(gains):+.3f}{sure} [{low:+.3f}, {high:+.3f}]"
    print(f"| {ratio:g} | {robots}, {targets} | {radius:g} | " + " | ".join(cells) + f" | {gain} |")

# One panel per number of targets per robot, with the radius on the horizontal axis.
ratios = sorted({place[0] for place in places})
radii = sorted({place[3] for place in places})
WIDTH, HEIGHT, LEFT, TOP, GAP = 150, 190, 44, 40, 16
total = LEFT + len(ratios) * (WIDTH + GAP)
svg = [
    f'<svg xmlns="http://www.w3.org/2000/svg" width="{total}" height="{TOP + HEIGHT + 46}" font-family="sans-serif" font-size="12">',
    '<rect width="100%" height="100%" fill="#fff"/>',
]
for index, policy in enumerate(POLICIES):
    x = LEFT + 110 * index
    svg.append(f'<line x1="{x}" y1="12" x2="{x + 22}" y2="12" stroke="{COLORS[policy]}" stroke-width="2"/>')
    svg.append(f'<text x="{x + 28}" y="16">{policy}</text>')
for index, ratio in enumerate(ratios):
    left = LEFT + index * (WIDTH + GAP)
    svg.append(f'<text x="{left}" y="{TOP - 6}">n/m = {ratio:g}</text>')
    svg.append(f'<rect x="{left}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#8d897f"/>')

    def x_of(radius, shift=0):
        return left + WIDTH * (radii.index(radius) + 0.5) / len(radii) + shift

    def y_of(share):
        return TOP + HEIGHT * (1 - share)

    for tick in (0.25, 0.5, 0.75):
        svg.append(
            f'<line x1="{left}" x2="{left + WIDTH}" y1="{y_of(tick)}" y2="{y_of(tick)}" stroke="#e6e3dc"/>'
        )
    if index == 0:
        for tick in (0, 0.25, 0.5, 0.75, 1):
            svg.append(f'<text x="{left - 6}" y="{y_of(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>')
    for radius in radii:
        svg.append(f'<text x="{x_of(radius):.1f}" y="{TOP + HEIGHT + 16}" text-anchor="middle">{radius:g}</text>')
    for number, policy in enumerate(POLICIES):
        points = []
        for place in (place for place in places if place[0] == ratio):
            values = list(shares[place, policy].values())
            low, high = interval(values)
            x, y = x_of(place[3], 4 * (number - 1.5)), y_of(mean(values))
            points.append(f"{x:.1f},{y:.1f}")
            svg.append(
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y_of(low):.1f}" y2="{y_of(high):.1f}" stroke="{COLORS[policy]}"/>'
            )
            svg.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{COLORS[policy]}"/>')
        svg.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{COLORS[policy]}" stroke-width="1.5"/>')
middle = LEFT + (total - LEFT) / 2
svg.append(f'<text x="{middle:.0f}" y="{TOP + HEIGHT + 36}" text-anchor="middle">radius of the region, m</text>')
svg.append(f'<text transform="translate(12 {TOP + HEIGHT / 2:.0f}) rotate(-90)" text-anchor="middle">A/n</text>')
svg.append("</svg>")
picture.write_text("\n".join(svg) + "\n")
