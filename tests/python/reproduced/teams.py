"""Box pushing, CMOMMT and the strategies of L-ALLIANCE, from runs and sweeps."""

import re
from statistics import mean

from lab import ROOT, rows
from page import Row, Section, verdict

SEEDS = {"cmommt": 40, "strategies": 40}
# The times of the built-in run, s: blue is killed, genghis is added and has come to the box, genghis babbles.
KILLED_S, ADDED_S, COME_S, BABBLES_S = 40, 120, 140, 180
# The stroke in progress at the crash is counted in the next step.
ALONE_S = KILLED_S + 1
IV = "IV"
# Differences of A/n below this number count as equal. The standard error of a mean is larger.
EQUAL = 0.0005


def missing(given):
    return None


def push(lab):
    """Returns the robots that push each end in each phase of the box."""
    _, out = lab.run("parker-box", log="full")
    phases = {"two robots": (0, KILLED_S), "one robot": (ALONE_S, ADDED_S), "genghis": (COME_S, BABBLES_S)}
    found = {name: {"left": [], "right": [], "ends": ""} for name in phases}
    for row in rows(out, "events"):
        if row["kind"] != "pushed":
            continue
        for name, (start_s, end_s) in phases.items():
            if start_s * 1000 <= int(row["t_ms"]) < end_s * 1000:
                found[name][row["subject"]].append(row["robot"])
                found[name]["ends"] += row["subject"][0]
    return {
        name: {"left": sorted(set(each["left"])), "right": sorted(set(each["right"])), "ends": each["ends"]}
        for name, each in found.items()
    }


def sweep(lab, plan, seeds, table, change=lambda text: text):
    """Runs a plan of the project with a number of seeds and returns the rows of a table."""
    text = (ROOT / "analysis/sweeps" / plan).read_text(encoding="utf-8")
    text = change(re.sub(r"^seeds = .*", f"seeds = {seeds}", text, flags=re.MULTILINE))
    (lab.folder / plan).write_text(text, encoding="utf-8")
    out = lab.folder / plan.removesuffix(".toml")
    lab.alliance("sweep", plan, "--out", out)
    return rows(out, table)


def cmommt(lab):
    """Returns the mean share of observed targets of each policy, by robots and targets, in the smallest region."""
    smallest = lambda text: re.sub(r"^room.width_m = .*", "room.width_m = [20.0]", text, flags=re.MULTILINE)
    values = {}
    for row in sweep(lab, "cmommt.toml", SEEDS["cmommt"], "results", smallest):
        values.setdefault(row["name"], {}).setdefault(row["observe.policy"], []).append(float(row["a"]))
    return {
        name: {policy: mean(each) for policy, each in policies.items()} for name, policies in values.items()
    }


def strategies(lab):
    """Returns the mean time and energy of strategy IV relative to the optimum, by size of the team and spread."""
    cells = {}
    for row in sweep(lab, "l-alliance-strategies.toml", SEEDS["strategies"], "trials"):
        if row["rule"] == IV and row["mishap"] == "none" and row["time_s"]:
            size = f"({row['robots']},{row['tasks']},{row['coverage']}), h = {row['spread']}"
            time = float(row["time_s"]) / float(row["least_time_s"])
            energy = float(row["energy_j"]) / float(row["least_energy_j"])
            cells.setdefault(size, []).append((time, energy))
    return {size: [mean(values) for values in zip(*trials)] for size, trials in cells.items()}


def measure(lab, quick):
    found = {"push": push(lab)}
    if not quick:
        found |= {"cmommt": cmommt(lab), "strategies": strategies(lab)}
    return found


def push_section(found):
    alternate = lambda ends: "ll" not in ends and "rr" not in ends
    row = lambda phase, result, published, holds, why: Row(
        result,
        published,
        "; ".join(f"{end}: {', '.join(found[phase][end])}" for end in ("left", "right"))
        + f"; {len(found[phase]['ends'])} strokes",
        verdict(holds, is_known=False),
        f"phases from memory; {why}",
    )
    two, one, more = found["two robots"], found["one robot"], found["genghis"]
    return Section(
        "ALLIANCE: box pushing",
        "Parker, IROS 1994 and Autonomous Robots 8, 2000. The abstracts were read; the phases are from memory.",
        f"`parker-box`, seed 1: blue is killed at {KILLED_S} s, and genghis comes at {ADDED_S} s. No figures of "
        "the papers are available. [Measured times](missions/push.md#parker-box-seed-1).",
        [
            row(
                "two robots",
                "two robots",
                "each robot pushes one end",
                two["left"] == ["red"] and two["right"] == ["blue"],
                "strokes in turn, after two simultaneous ones",
            ),
            row(
                "one robot",
                "a robot is removed",
                "the other pushes one end, goes to the other, and back",
                one["left"] == one["right"] == ["red"] and alternate(one["ends"]),
                "the ends alternate",
            ),
            row(
                "genghis",
                "the slow robot is added",
                "it replaces the lost robot, and each robot keeps to one end",
                more["left"] == ["red"] and more["right"] == ["genghis"],
                f"from {COME_S} s, when it has come",
            ),
        ],
    )


def cmommt_section(found):
    rows = []
    for name, means in found.items():
        robots, targets = re.fullmatch(r"(\d+)-robots-(\d+)-targets", name).groups()
        ratio = int(targets) / int(robots)
        values = ", ".join(f"{policy} {value:.3f}" for policy, value in means.items())
        follow = min(means["local"], means["a-cmommt"]) > max(means["random"], means["fixed"])
        gain = means["a-cmommt"] - means["local"]
        # The published order depends on whether there are more targets than half the robots.
        order, published, why = True, "", "half as many targets as robots: the published order changes here; "
        if ratio > 0.5:
            order, published, why = gain > -EQUAL, "; a-cmommt at least as good as local", ""
        elif ratio < 0.5:
            order, published, why = gain < EQUAL, "; local at least as good as a-cmommt", ""
        rows.append(
            Row(
                f"{targets} targets, {robots} robots",
                f"a-cmommt and local above random and fixed{published}",
                values,
                verdict(follow and order, is_known=False),
                f"order from memory; {why}mean A/n, differences below {EQUAL} count as equal",
            )
        )
    return Section(
        "CMOMMT: the order of four policies",
        "Parker, Autonomous Robots 12(3), 2002. The order is from memory; the paper's figures are not available.",
        f"`analysis/sweeps/cmommt.toml` in the smallest region (radius 10 m), {SEEDS['cmommt']} seeds. "
        "[All regions, with intervals](missions/observe.md#results-here).",
        rows,
    )


def strategies_section(found):
    times = {size: value[0] for size, value in found.items()}
    energies = {size: value[1] for size, value in found.items()}
    largest = lambda values: max(values, key=values.get)
    at = lambda values, size: max(value for name, value in values.items() if name.startswith(size))
    row = lambda result, published, values, holds, why: Row(
        result, published, values, verdict(holds, is_known=False), why
    )
    both = f"time {mean(times.values()):.3f}, energy {mean(energies.values()):.3f}"
    unknown = "spread h and distributions of the report are not known; [tables](allocators/l-alliance.md)"
    return Section(
        "L-ALLIANCE: strategy IV against the optimum",
        "Parker, ORNL report 1995; Advanced Robotics 11(4), 1997.",
        f"`analysis/sweeps/l-alliance-strategies.toml`, {SEEDS['strategies']} seeds: n robots, m tasks, c able "
        f"robots for each task, spread h; means of {len(found)} conditions without faults.",
        [
            row(
                "mean ratio to the optimum",
                "below 1.20 in time and energy",
                both,
                max(mean(times.values()), mean(energies.values())) < 1.2,
                unknown,
            ),
            row(
                "worst time",
                "1.28, with (4,8,3)",
                f"{max(times.values()):.2f}, with {largest(times)}; "
                f"(4,8,3): at most {at(times, '(4,8,3)'):.2f}",
                max(times.values()) <= 1.28,
                "it is unknown whether the published worst case is the mean of a condition",
            ),
            row(
                "worst energy",
                "1.25, with (5,6,5)",
                f"{max(energies.values()):.2f}, with {largest(energies)}; "
                "h up to 1: at most "
                f"{max(value for size, value in energies.items() if not size.endswith('2')):.2f}",
                max(energies.values()) <= 1.25,
                "as above; the published spread is not known, and energy grows with h",
            ),
        ],
    )


def sections(found):
    return [
        push_section(found["push"]),
        cmommt_section(found["cmommt"]),
        strategies_section(found["strategies"]),
    ]
