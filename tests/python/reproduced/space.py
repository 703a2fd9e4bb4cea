"""SPACE's examples: the distribution of 93 runs of its own code against runs here."""

import csv
import random

import numpy as np
from scipy.stats import ks_2samp, mannwhitneyu

from lab import place
from page import Row, Section, verdict

SEEDS = 24
# The rule of which one run is repeated by --check.
QUICK = "greedy"
# The scale: a unit of SPACE is half a metre here. Times are the same.
SCALE = 0.5
# The rules of SPACE, and the same rules here.
RULES = {"CBBA": "cbba", "greedy": "first-come", "GRAPE": "grape", "CBAA": "cbaa"}
# SPACE's bundles have five tasks.
PARAMETERS = {"cbba": {"bundle": 5}}
LEVEL = 0.05
# The differences of the rules, as far as the code of SPACE shows them.
DIFFERENCES = {
    "CBBA": "bundles of 5, as in SPACE; its score is work · 0.999^time, here 0.98^time",
    "greedy": "SPACE takes the nearest free task, robots here that with the least time of way and work",
    "GRAPE": "SPACE's utility is work/p - w · distance · p^s, and its agents share the work of a task",
    "CBAA": "SPACE bids work · 0.999^time, robots here 0.98^time",
}


def missing(given):
    file = given.data / "space_runs.csv"
    return None if file.is_file() else f"there is no file {file}"


def recorded(lab):
    """Returns the end times, s, and the distances, units, of the runs of SPACE, by rule."""
    found = {rule: {"end_s": [], "distance": []} for rule in RULES}
    names = {rule.lower(): rule for rule in RULES}
    with open(lab.data / "space_runs.csv", newline="", encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            rule = found[names[row["allocator"].lower()]]
            rule["end_s"].append(float(row["end_s"]))
            rule["distance"].append(float(row["distance"]))
    return found


def scenario(seed):
    draw = random.Random(seed)
    room = (1400 * SCALE, 1000 * SCALE)
    # SPACE draws the starts, too.
    starts = [[round(draw.uniform(1, side - 1), 3) for side in room] for _ in range(10)]
    return {
        "name": "space",
        "step_ms": 500,
        "limit_s": 40000.0,
        "room": {"width_m": room[0], "height_m": room[1]},
        "radio": {"range_m": 500 * SCALE},
        "allocators": PARAMETERS,
        "body": {"speed_m_s": 0.25 * SCALE, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
        "service": {
            "known": "sight",
            "sight_m": 500 * SCALE,
            "reach_m": 10 * SCALE,
            "kinds": [{"name": "work", "work_s": {"min": 6.0, "max": 60.0}}],
            "random": [{"n": 100}, *({"n": 25, "at_s": at_s} for at_s in (2000.0, 4000.0, 6000.0))],
        },
        "robots": [{"name": f"a{number}", "start": place(at)} for number, at in enumerate(starts)],
    }


def run(lab, allocator, seed):
    result, _ = lab.run(lab.write("space.toml", scenario(seed)), "--allocator", allocator, "--seed", seed)
    found = result["result"]
    is_complete = result["outcome"] == "complete"
    return {
        "end_s": found["makespan_ms"] / 1000 if is_complete else None,
        "distance": sum(robot["way_m"] for robot in found["robots"].values()) / SCALE,
    }


def spread(values):
    """Returns mean and standard deviation as text."""
    return f"{np.mean(values):,.0f} ± {np.std(values, ddof=1):,.0f}"


def chance(p):
    """Returns a probability as text."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def measure(lab, quick):
    if quick:
        return {QUICK: {"runs": {"1": run(lab, RULES[QUICK], 1)}}}
    found = {}
    for rule, published in recorded(lab).items():
        runs = {str(seed): run(lab, RULES[rule], seed) for seed in range(1, SEEDS + 1)}
        ended = [each for each in runs.values() if each["end_s"] is not None]
        tests = {key: ks_2samp(published[key], [each[key] for each in ended]).pvalue for key in published}
        # The recorded runs stay with their owners; figures of them suffice for the page.
        summary = {key: spread(values) for key, values in published.items()}
        found[rule] = {"runs": runs, "published": summary | {"runs": len(published["end_s"])}, "p": tests}
    return found


def sections(found):
    lines = []
    for rule, each in found.items():
        ended = [run for run in each["runs"].values() if run["end_s"] is not None]
        key = lambda name: [run[name] for run in ended]
        p = each["p"]
        is_inside = len(ended) == SEEDS and min(p.values()) >= LEVEL
        lines.append(
            Row(
                rule,
                "end {end_s} s, distance {distance} ({runs} runs)".format(**each["published"]),
                f"end {spread(key('end_s'))} s, distance {spread(key('distance'))} ({len(ended)} of {SEEDS} "
                f"seeds); {chance(p['end_s'])} and {chance(p['distance'])}",
                verdict(is_inside),
                f"`{RULES[rule]}`; {DIFFERENCES[rule]}",
            )
        )
    others = [rule for rule in found if rule != "CBAA"]
    ends = lambda rule: [run["end_s"] for run in found[rule]["runs"].values() if run["end_s"] is not None]
    tests = {rule: mannwhitneyu(ends("CBAA"), ends(rule), alternative="greater").pvalue for rule in others}
    lines.append(
        Row(
            "order",
            "CBAA ends last (p < 0.001); no other order is certain",
            "CBAA later than " + ", ".join(f"{rule}: {chance(value)}" for rule, value in tests.items()),
            verdict(max(tests.values()) < 0.001),
            "one-sided Mann–Whitney test of the end times; the bids of CBAA differ",
        )
    )
    return [
        Section(
            "SPACE: the distribution of its examples",
            "The repository inmo-jang/space-simulator (commit 2b2187b): 93 runs of its code, executed for this "
            "project. Its published samples (greedy 13,413 s, GRAPE 15,578 s) lie outside all of these runs.",
            "10 robots, 100 points and three bursts of 25, work of U(6, 60) s, speed 0.25 units/s, radio and "
            f"sight 500 units, done within 10 units. A unit is {SCALE} m here; "
            "times stay the same. Six things differ. Robots here do not accelerate. They do not slow down near a "
            "point, as agents of SPACE do within 50 units, about a minute for each point. The radius of a point, 2 to "
            "20 units in SPACE, is not added to the 10 units. They see the seven nearest "
            "points at a time. They drive around while they know of no point. They do not stop until CBBA or GRAPE "
            "has converged. The figures are mean ± standard "
            "deviation, distances in units. p: two-sample Kolmogorov–Smirnov tests of end times and distances. A "
            f"distribution is reproduced if neither differs at the level {LEVEL}.",
            lines,
        )
    ]
