"""CBBA against two public implementations on the same random static instances."""

import contextlib
import importlib.util
import io
import itertools
import math
import random
import sys
import types
from collections import namedtuple

from lab import place, tasks_of
from page import OTHER, Row, Section, verdict

INSTANCES, QUICK = 200, 4
ROBOTS, POINTS, BUNDLE = 3, 6, 3
DISCOUNT, ROOM_M, REACH_M = 0.98, 60.0, 0.01
# Both implementations: their folders in that of --implementations, revisions and licenses.
PYTHON, SPACE = "CBBA-Python", "space-simulator"
REVISIONS = {PYTHON: ("269b14a", "MIT"), SPACE: ("2b2187b", "GPL-3.0")}
# The least work of a point, and the time by which the work may start after its window opens, s.
NO_WORK_S, SLACK_S = 0.001, 0.001
# The rounds of the plugin of SPACE. Its assignments are stable after half of them.
SPACE_ROUNDS = 60

Point = namedtuple("Point", "at work_s value opens_s deadline_s")
# A kind of instances. `is_same`: true if both sides have the same rule for bids, so that assignments must be equal.
Case = namedtuple("Case", "title other bundle work_s has_windows is_same why")
WORK_S, NONE_S = (5.0, 20.0), (NO_WORK_S, NO_WORK_S)
CASES = {
    "one": Case(
        "bundles of 1, with work", PYTHON, 1, WORK_S, False, True, "the same bids: the utility of a point alone"
    ),
    "windows": Case(
        f"bundles of {BUNDLE}, each window has the length of the work",
        PYTHON,
        BUNDLE,
        WORK_S,
        True,
        True,
        "the same bids, because no point can be done later",
    ),
    "open": Case(
        f"bundles of {BUNDLE}, no windows",
        PYTHON,
        BUNDLE,
        WORK_S,
        False,
        False,
        "CBBA-Python inserts a point only where no later point of the path is delayed, and does not warp bids",
    ),
    "space one": Case(
        "bundles of 1, no work", SPACE, 1, NONE_S, False, True, "the same bids: the utility of a point alone"
    ),
    "space": Case(
        f"bundles of {BUNDLE}, no work",
        SPACE,
        BUNDLE,
        NONE_S,
        False,
        False,
        "SPACE keeps its bundle in the order of the path, so that it releases other points after a loss, and does not "
        "warp bids",
    ),
}


def instance(case, seed):
    """Returns the places of robots, and the points. Positions are uniform, and values U(1, 3)."""
    draw = random.Random(seed)
    at = lambda: (round(draw.uniform(2, ROOM_M - 2), 3), round(draw.uniform(2, ROOM_M - 2), 3))
    robots = [at() for _ in range(ROBOTS)]
    points = []
    for _ in range(POINTS):
        where, work_s, value = at(), round(draw.uniform(*case.work_s), 3), round(draw.uniform(1, 3), 3)
        opens_s = round(draw.uniform(100, 300), 3) if case.has_windows else 0.0
        deadline_s = opens_s + work_s + SLACK_S if case.has_windows else None
        points.append(Point(where, work_s, value, opens_s, deadline_s))
    return robots, points


def scenario(case, robots, points):
    def stated(point):
        window = {} if point.deadline_s is None else {"opens_s": point.opens_s, "deadline_s": point.deadline_s}
        return {"kind": "task", "work_s": point.work_s, "value": point.value, **window, **place(point.at)}

    return {
        "name": "public",
        "step_ms": 5,
        "allocator": "cbba",
        "allocators": {"cbba": {"bundle": case.bundle}},
        "room": {"width_m": ROOM_M, "height_m": ROOM_M},
        "body": {"speed_m_s": 1.0, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
        "service": {
            "reach_m": REACH_M,
            "kinds": [{"name": "task", "work_s": {"min": NO_WORK_S, "max": 20.0}}],
            "points": [stated(point) for point in points],
        },
        "robots": [{"name": f"r{number}", "start": place(at)} for number, at in enumerate(robots)],
    }


def missing(given):
    if given.check:
        return None
    if given.implementations is None:
        return f"--implementations: state the folder with {PYTHON} and {SPACE}"
    folders = [given.implementations / name for name in REVISIONS]
    return next((f"there is no folder {folder}" for folder in folders if not folder.is_dir()), None)


class CbbaPython:
    """The implementation of zehuilu. Its score has the start of the work instead of its end."""

    def __init__(self, folder):
        sys.path.insert(0, str(folder / PYTHON / "lib"))
        from Agent import Agent
        from CBBA import CBBA
        from Task import Task
        from WorldInfo import WorldInfo

        self.types = Agent, Task
        default = {"START_TIME": 0, "END_TIME": 1000, "DURATION": 1}
        kinds = {"AGENT_TYPES": ["quad", "car"], "TASK_TYPES": ["track", "rescue"]}
        self.solver = CBBA(kinds | {"TRACK_DEFAULT": default, "RESCUE_DEFAULT": default})
        self.world = WorldInfo([0, ROOM_M], [0, ROOM_M], [0, 0])

    def solve(self, case, robots, points):
        agent, task = self.types
        agents = [agent(agent_id=number, x=x, y=y, nom_velocity=1.0) for number, (x, y) in enumerate(robots)]
        tasks = [
            task(
                task_id=number,
                task_value=point.value * DISCOUNT**point.work_s,
                start_time=point.opens_s,
                # The latest start.
                end_time=1e6 if point.deadline_s is None else point.deadline_s - point.work_s,
                duration=point.work_s,
                discount=-math.log(DISCOUNT),
                x=point.at[0],
                y=point.at[1],
            )
            for number, point in enumerate(points)
        ]
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            paths, _ = self.solver.solve(agents, tasks, self.world, case.bundle, True)
        assert not printed.getvalue(), printed.getvalue()
        return [sorted(map(int, path)) for path in paths]


class Vector(tuple):
    """The part of pygame's vector that the plugin uses."""

    def distance_to(self, other):
        return math.dist(self, other)


class Space:
    """The plugin of SPACE, in rounds in which each agent receives all messages of the round before."""

    def __init__(self, folder):
        self.file = folder / SPACE / "plugins/cbba/cbba.py"

    def plugin(self, bundle):
        settings = {
            "max_tasks_per_agent": bundle,
            "task_reward_discount_factor": DISCOUNT,
            "winning_bid_cancel": False,
            "acceptable_empty_bundle_duration": 0,
        }
        config = {"decision_making": {"CBBA": settings}, "simulation": {"sampling_freq": 1.0}}
        largest = lambda one, other: {key: max(d[key] for d in (one, other) if key in d) for key in one | other}
        utils = types.SimpleNamespace(config=config, merge_dicts=largest)
        pygame = types.SimpleNamespace(Vector2=Vector)
        sys.modules |= {"pygame": pygame, "modules": types.ModuleType("modules"), "modules.utils": utils}
        spec = importlib.util.spec_from_file_location("space_cbba", self.file)
        plugin = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(plugin)
        return plugin

    def solve(self, case, robots, points):
        plugin = self.plugin(case.bundle)
        tasks = [
            # The amount is the value, and the work is as good as none.
            types.SimpleNamespace(task_id=number, position=Vector(point.at), amount=point.value, completed=False)
            for number, point in enumerate(points)
        ]
        agents = []
        for number, at in enumerate(robots):
            agent = types.SimpleNamespace(
                agent_id=number,
                position=Vector(at),
                max_speed=1.0,
                work_rate=1e9,
                tasks_info=tasks,
                agents_nearby=[],
                messages_received=[],
                set_planned_tasks=lambda path: None,
                reset_movement=lambda: None,
            )
            agent.reset_messages_received = lambda agent=agent: agent.messages_received.clear()
            agent.rule = plugin.CBBA(agent)
            agents.append(agent)
        for agent in agents:
            agent.agents_nearby = [other for other in agents if other is not agent]
        paths = []
        for round_ in range(SPACE_ROUNDS):
            # Its time stamps are whole seconds of the clock.
            plugin.time = types.SimpleNamespace(time=lambda: round_)
            said = [agent.message_to_share for agent in agents]
            for agent in agents:
                agent.messages_received = [each for each in said if each["agent_id"] != agent.agent_id]
                agent.rule.decide({"local_tasks_info": tasks})
            paths.append([sorted(task.task_id for task in agent.rule.path) for agent in agents])
        assert all(each == paths[-1] for each in paths[SPACE_ROUNDS // 2 :]), "the assignment is stable"
        return paths[-1]


def score(case, robots, points, tasks):
    """Returns the total score of an assignment, with the best order of each robot's points."""

    def worth(start, path):
        at, time_s, found = start, 0.0, 0.0
        for point in path:
            time_s = max(point.opens_s, time_s + max(0.0, math.dist(at, point.at) - REACH_M)) + point.work_s
            if point.deadline_s is not None and time_s > point.deadline_s:
                break
            found += point.value * DISCOUNT ** (time_s - point.opens_s)
            at = point.at
        return found

    each = lambda own: itertools.permutations(points[number] for number in own)
    return sum(max(worth(start, path) for path in each(own)) for start, own in zip(robots, tasks))


def text(tasks):
    """Returns an assignment in one line, so that the stored results stay short."""
    return " | ".join(" ".join(map(str, each)) for each in tasks)


def measure(lab, quick):
    others = {} if quick else {PYTHON: CbbaPython(lab.implementations), SPACE: Space(lab.implementations)}
    found = {}
    for name, case in CASES.items():
        all_here, unlike = {}, {}
        for seed in range(QUICK if quick else INSTANCES):
            robots, points = instance(case, seed)
            here = tasks_of(lab.allocate(lab.write("public.toml", scenario(case, robots, points))))
            all_here[str(seed)] = text(here)
            if not others:
                continue
            there = others[case.other].solve(case, robots, points)
            if here != there:
                share = score(case, robots, points, here) / score(case, robots, points, there)
                unlike[str(seed)] = {"there": text(there), "share": share}
        # A check measures the assignments here alone.
        found[name] = {"here": all_here} | ({} if quick else {"unlike": unlike})
    return found


def sections(found):
    rows = []
    for name, case in CASES.items():
        count, unlike = len(found[name]["here"]), list(found[name]["unlike"].values())
        shares = [each["share"] for each in unlike] + [1.0] * (count - len(unlike))
        scores = f"; score {min(shares):.3f} to {max(shares):.3f} of theirs, mean {sum(shares) / count:.4f}"
        rows.append(
            Row(
                f"{case.other}: {case.title}",
                f"{count} of {count}" if case.is_same else "other rules for bids, see the reason",
                f"{count - len(unlike)} of {count}" + (scores if unlike else ""),
                verdict(not unlike) if case.is_same else OTHER,
                case.why,
            )
        )
    revisions = " and ".join(
        f"{name} (commit {commit}, {license_})" for name, (commit, license_) in REVISIONS.items()
    )
    return [
        Section(
            "CBBA: the assignments of two public implementations",
            f"The repositories zehuilu/CBBA-Python and inmo-jang/space-simulator: {revisions}.",
            f"{INSTANCES} random instances of each kind with {ROBOTS} robots and {POINTS} points in {ROOM_M:.0f} × "
            f"{ROOM_M:.0f} m. Values are U(1, 3), and each robot receives all others. Both score value · "
            f"{DISCOUNT}^t. CBBA-Python takes t at the start of the work, so that its values are multiplied by "
            f"{DISCOUNT}^work. SPACE does not count the work of earlier tasks, so that its points have none, and its "
            "amount is the value. The plugin of SPACE runs in rounds of a second without its simulator, because its "
            "time stamps are whole seconds. Equal means that each robot has the same points.",
            rows,
        )
    ]
