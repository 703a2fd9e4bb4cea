"""The figures 4.8 to 4.11 of the thesis, and Parker's specialization: the sequences of events in the logs."""

import json
from collections import defaultdict

from lab import rows
from page import Row, Section, verdict

SEEDS, QUICK = 20, 1
TEAM = ["blue", "gold", "green"]
TOP, BOTTOM, REPORT = "move-spill(top)", "move-spill(bottom)", "report-progress"
METHODICAL, WANDER = "find-locations-methodical", "find-locations-wander"
# The reason why the figures of the thesis are not comparable.
CHOSEN = "parameters were chosen here, because those of the thesis are unknown"
CHANGES = ("activated", "waiting", "hibernated")


def missing(given):
    return None


class Story:
    """The events and motivations of a run."""

    def __init__(self, lab, scenario, seed):
        _, out = lab.run(scenario, "--seed", seed, log="full")
        run = json.loads((out / "run.json").read_text(encoding="utf-8"))
        self.report_period_ms = run["scenario"]["waste"]["report_period_s"] * 1000
        self.events = rows(out, "events")
        self.curves, self.rates = defaultdict(list), defaultdict(list)
        for row in rows(out, "motivations"):
            key = row["robot"], row["behavior_set"]
            self.curves[key].append((int(row["t_ms"]), float(row["motivation"])))
            self.rates[key].append((int(row["t_ms"]), float(row["impatience"])))
        self.update_ms = next(int(row["t_ms"]) for row in self.events if row["kind"] == "position-update")

    def changes(self, task):
        """Returns the state changes of the behavior sets of a task."""
        return [
            (row["robot"], row["subject"], row["kind"], row["reason"])
            for row in self.events
            if row["kind"] in CHANGES and row["detail"] == task
        ]

    def first(self, robot, behavior_set, change="activated"):
        """Returns the time of the first change of a kind, ms."""
        key = (change, robot, behavior_set)
        return next(
            int(row["t_ms"]) for row in self.events if (row["kind"], row["robot"], row["subject"]) == key
        )

    def count(self, kind, robot):
        return sum(row["kind"] == kind and row["robot"] == robot for row in self.events)

    def falls(self, robot, behavior_set):
        """Returns the times at which a motivation falls to 0, ms."""
        curve = self.curves[robot, behavior_set]
        return [time for (_, before), (time, after) in zip(curve, curve[1:]) if before > 0 and after == 0]

    def is_zero(self, robot, behavior_set, from_ms, to_ms=float("inf")):
        curve = self.curves[robot, behavior_set]
        return all(value == 0 for time, value in curve if from_ms < time <= to_ms)


def no_interruption(story):
    """Returns which observations of figures 4.8 and 4.9 hold."""
    step_ms = 50
    found = story.first("blue", METHODICAL)
    activated = next(row for row in story.events if row["kind"] == "activated")
    own, golds = story.first("blue", REPORT), story.first("gold", TOP)
    resets = [own + step_ms, golds + step_ms, story.first("blue", BOTTOM) + step_ms]
    return {
        "search": activated["subject"] == METHODICAL
        and story.is_zero("blue", WANDER, found)
        and all(story.is_zero(robot, WANDER, story.update_ms) for robot in TEAM),
        "turns": all(story.count(kind, robot) > 0 for kind in ("delivered", "reported") for robot in TEAM),
        "resets": story.falls("blue", TOP)[:3] == resets,
        "interruption": story.changes(TOP)[:4]
        == [
            ("gold", TOP, "activated", "threshold"),
            ("green", TOP, "waiting", "threshold"),
            ("gold", TOP, "hibernated", "reset-by green"),
            ("green", TOP, "hibernated", "suppressed"),
        ],
        "later waits": story.changes(TOP)[4:8]
        == [
            ("green", TOP, "activated", "threshold"),
            ("gold", TOP, "waiting", "threshold"),
            ("green", TOP, "hibernated", "acquiesced-psi"),
            ("gold", TOP, "activated", "wait-over"),
        ],
    }


def rises_slowly_then_fast(story, robot, behavior_set):
    """Returns whether the rate of a motivation has a low value and then a higher one, from the reset by blue's first
    message to gold's first message.
    """
    start_ms = story.falls(robot, behavior_set)[0]
    end_ms = story.first("gold", WANDER, "waiting")
    rates = [rate for time_ms, rate in story.rates[robot, behavior_set] if start_ms <= time_ms < end_ms]
    return len(set(rates)) == 2 and rates == sorted(rates)


def trapped(story):
    """Returns which observations of figures 4.10 and 4.11 hold."""
    changes = story.changes("find-locations")
    items = sum(story.count("delivered", robot) for robot in TEAM)
    reports = [int(row["t_ms"]) for row in story.events if row["kind"] == "reported"]
    # The first report is due before the locations are found.
    waits = [later - earlier for earlier, later in zip(reports, reports[1:])]
    return {
        "takeover": changes[:4]
        == [
            ("blue", METHODICAL, "activated", "threshold"),
            ("gold", WANDER, "waiting", "threshold"),
            ("blue", METHODICAL, "hibernated", "reset-by gold"),
            ("gold", WANDER, "activated", "wait-over"),
        ],
        "green is last": changes[4:9]
        == [
            ("blue", METHODICAL, "waiting", "threshold"),
            ("green", WANDER, "waiting", "threshold"),
            ("blue", METHODICAL, "hibernated", "reset-by green"),
            ("gold", WANDER, "hibernated", "reset-by green"),
            ("green", WANDER, "activated", "wait-over"),
        ],
        "two rates": all(rises_slowly_then_fast(story, robot, WANDER) for robot in ("gold", "green")),
        "both wait": changes[9:11]
        == [("blue", METHODICAL, "waiting", "threshold"), ("gold", WANDER, "waiting", "threshold")],
        "two share": story.count("delivered", "blue") == 0
        and all(story.count("delivered", robot) >= items / 4 for robot in ("gold", "green")),
        "late reports": len(waits) >= 3 and all(wait > 1.25 * story.report_period_ms for wait in waits),
    }


def specialized(story):
    """Returns whether two robots keep one spill each, and the third only reports."""
    kept = defaultdict(set)
    for row in story.events:
        if row["kind"] == "activated" and int(row["t_ms"]) > story.update_ms:
            kept[row["robot"]].add(row["subject"])
    return kept == {"blue": {TOP}, "gold": {BOTTOM}, "green": {REPORT}}


def measure(lab, quick):
    seeds = range(1, (QUICK if quick else SEEDS) + 1)
    found = {"no interruption": {}, "trapped": {}, "specialized": {}}
    for seed in seeds:
        key = str(seed)
        found["no interruption"][key] = no_interruption(Story(lab, "thesis-no-interruption", seed))
        found["trapped"][key] = trapped(Story(lab, "thesis-trapped-robot", seed))
        found["specialized"][key] = specialized(Story(lab, "parker-specialised", seed))
    return found


def observed(trials, key, result, published, rule=""):
    """Returns the row of an observation that should hold with every seed. `rule`: what exactly is checked."""
    held = sum(trial[key] for trial in trials.values())
    holds = verdict(held == len(trials), is_known=False)
    return Row(result, published, f"with {held} of {len(trials)} seeds", holds, CHOSEN + rule)


def sections(found):
    first, second, third = found["no interruption"], found["trapped"], found["specialized"]
    kept = sum(third.values())
    return [
        Section(
            "ALLIANCE: figures 4.8 and 4.9 of the thesis, no interruption",
            "The thesis that the [README](../README.md) names, section 4.3.1.",
            f"`thesis-no-interruption`, seeds 1 to {len(first)}: three robots, two spills. The names of behavior "
            "sets are those of the thesis.",
            [
                observed(
                    first,
                    "search",
                    "search",
                    "blue searches methodically; its wander stays at 0, and after one "
                    "PositionUpdate both find sets are 0 in all robots",
                ),
                observed(first, "turns", "turns", "robots take turns at the spills and at reporting"),
                observed(
                    first,
                    "resets",
                    "three early resets of blue's move-spill(top)",
                    "by its own report, gold's first activation and its own move-spill(bottom)",
                    "; each in the step of the message or activation",
                ),
                observed(
                    first,
                    "interruption",
                    "green's first message interrupts gold",
                    "before gold's ψ and λ have passed; green then does another task",
                    "; the first four changes of move-spill(top)",
                ),
                observed(
                    first,
                    "later waits",
                    "two robots at the threshold",
                    "the later one waits until the first acquiesces",
                    "; the next four changes of move-spill(top)",
                ),
            ],
        ),
        Section(
            "ALLIANCE: figures 4.10 and 4.11 of the thesis, a trapped robot",
            "The same thesis, section 4.3.2.",
            f"`thesis-trapped-robot`, seeds 1 to {len(second)}: four obstacles enclose blue during its search.",
            [
                observed(
                    second,
                    "takeover",
                    "takeover",
                    "the others grow impatient, and gold takes over with wander",
                ),
                observed(
                    second,
                    "two rates",
                    "motivations of gold and green after the reset by blue",
                    "rise slowly for φ, and then fast: a corner in the curve",
                    "; two rates, the lower one first",
                ),
                observed(
                    second,
                    "green is last",
                    "second takeover",
                    "at the threshold again, blue waits (not its first time) "
                    "and green takes over (its first time), which resets both",
                    "; nine state changes in order",
                ),
                observed(
                    second,
                    "both wait",
                    "end of the search",
                    "both others end in the waiting state; green finishes",
                ),
                observed(
                    second,
                    "two share",
                    "rest of the mission",
                    "two robots share the work",
                    "; blue delivers nothing, and the others at least a quarter each",
                ),
                observed(
                    second,
                    "late reports",
                    "reports",
                    "late, because ψ and λ do not match the report period",
                    "; each at least a quarter of a period after it is due",
                ),
            ],
        ),
        Section(
            "ALLIANCE: specialization",
            "Parker, IEEE T-RA 14(2), 1998.",
            f"`parker-specialised`, seeds 1 to {len(third)}.",
            [
                Row(
                    "specialization",
                    "two robots keep one spill each, and the third only reports",
                    f"with {kept} of {len(third)} seeds",
                    verdict(kept == len(third), is_known=False),
                    "parameters were chosen here; the published claim is about suitable ones",
                )
            ],
        ),
    ]
