"""SSI and DHBA on random static instances, against exact optima."""

import math
import random
from itertools import combinations, permutations

import numpy as np
from exact import makespan, partition
from lab import Point, Robot, place, tasks_of
from page import Row, Section, verdict
from scipy.optimize import linear_sum_assignment

AUCTIONS, ASSIGNMENTS, QUICK = 60, 200, 3
ROOM_M, REACH_M, RANGE_M = 60.0, 0.01, 30.0
# Points without work, s. SSI's bounds are about ways alone.
NO_WORK_S = 0.001
# The discount per second of cost, as in docs/ALLOCATORS.md.
DISCOUNT = 0.98
# The rounds in which robots receive the points, and send and receive their first rows.
FIRST_ROUNDS = 2
# The objectives of SSI with the numbers of robots and points.
TEAMS = {
    "minisum": [(3, 6)],
    "minimax": [(robots, 6) for robots in (2, 3, 4)],
    "miniave": [(2, points) for points in (3, 5, 7)],
}
# A sum that is larger than all ways.
LARGE = 1e4
# The instances on a circle: the numbers of robots, the radius, by how much each place is farther than the one before,
# m, and the work at a point, s. It makes a second point of a place dearer than the first one for another robot.
CIRCLES, QUICK_CIRCLES = (2, 3, 4, 5, 6), (2, 3)
RADIUS_M, FARTHER_M, CIRCLE_WORK_S = 25.0, 0.02, 0.1


def missing(given):
    return None


def scenario(robots, points, values, **more):
    return {
        "name": "bounds",
        "step_ms": 5,
        "room": {"width_m": ROOM_M, "height_m": ROOM_M},
        "body": {"speed_m_s": 1.0, "turn_deg_s": 3600.0, "robot_penetrability": 1.0},
        "service": {
            "reach_m": REACH_M,
            "kinds": [{"name": "task", "work_s": {"min": NO_WORK_S, "max": 20.0}}],
            "points": [
                {"kind": "task", "work_s": point.work_s, "value": value, **place(point.at)}
                for point, value in zip(points, values)
            ],
        },
        "robots": [{"name": robot.name, "start": place(robot.at)} for robot in robots],
        **more,
    }


def team(draw, robots, points, work_s):
    """Draws robots and points at uniform places."""
    at = lambda: (round(draw.uniform(2, ROOM_M - 2), 3), round(draw.uniform(2, ROOM_M - 2), 3))
    robots = [Robot(f"r{number}", at()) for number in range(robots)]
    return robots, [Point(at(), round(draw.uniform(*work_s), 3), 0.0, None) for _ in range(points)]


def cost_s(at, point):
    """Returns the time of the way from a place to a point and of its work, s."""
    return max(0.0, math.dist(at, point.at) - REACH_M) + point.work_s


def least(objective, robot, points):
    """Returns the least cost of a path through the points, over all orders: its time, or the sum of all times."""

    def cost(path):
        at, time_s, sum_s = robot.at, 0.0, 0.0
        for point in path:
            time_s += cost_s(at, point)
            sum_s += time_s
            at = point.at
        return sum_s if objective == "miniave" else time_s

    return min(map(cost, permutations(points)))


def auctioned(lab, objective, robots, points):
    """Returns the points of each robot by SSI."""
    chosen = {"allocator": "ssi", "allocators": {"ssi": {"objective": objective}}}
    file = lab.write("bounds.toml", scenario(robots, points, [1.0] * len(points), **chosen))
    tasks = tasks_of(lab.allocate(file))
    assert sorted(sum(tasks, [])) == list(range(len(points))), "each point has one robot"
    return tasks


def auction(lab, objective, robots, points, seed):
    """Returns the cost of SSI's assignment relative to the optimum, each with the best order of each robot's points."""
    robots, points = team(random.Random(seed), robots, points, (NO_WORK_S, NO_WORK_S))
    tasks = auctioned(lab, objective, robots, points)
    numbers = range(len(points))
    sets = [each for count in numbers for each in combinations(numbers, count + 1)]
    paths = {
        (rank, each): least(objective, robot, [points[number] for number in each])
        for rank, robot in enumerate(robots)
        for each in sets
    }
    here = [paths[rank, tuple(each)] for rank, each in enumerate(tasks) if each]
    if objective == "minimax":
        columns = [(rank, each, cost) for (rank, each), cost in paths.items()]
        return max(here) / makespan(columns, len(robots), len(points))
    columns = [(rank, each, LARGE * len(each) - cost) for (rank, each), cost in paths.items()]
    return sum(here) / (LARGE * len(points) - partition(columns, len(robots), len(points)))


def circle(lab, objective, count):
    """Returns the cost of SSI's assignment relative to that of the assignment in which each robot has one place. That is
    not less than the optimum. All robots start in the center of a circle with as many places as robots, and each place
    has as many points as robots.
    """
    center_m = ROOM_M / 2

    def at(number):
        radius_m, angle = RADIUS_M + number * FARTHER_M, 2 * math.pi * number / count
        return tuple(round(center_m + radius_m * part(angle), 3) for part in (math.cos, math.sin))

    robots = [Robot(f"r{number}", (center_m, center_m)) for number in range(count)]
    points = [Point(at(number), CIRCLE_WORK_S, 0.0, None) for number in range(count) for _ in range(count)]
    tasks = auctioned(lab, objective, robots, points)
    of_places = [points[number * count : (number + 1) * count] for number in range(count)]
    of_team = max if objective == "minimax" else sum
    here = of_team(least(objective, robot, [points[each] for each in own]) for robot, own in zip(robots, tasks))
    return here / of_team(least(objective, robot, own) for robot, own in zip(robots, of_places))


def diameter(robots):
    """Returns the diameter of the radio graph; infinite if the graph is not connected."""
    count = range(len(robots))
    near = lambda one, other: math.dist(robots[one].at, robots[other].at) <= RANGE_M
    steps = np.array([[0.0 if i == j else 1.0 if near(i, j) else math.inf for j in count] for i in count])
    for middle in count:
        steps = np.minimum(steps, steps[:, [middle]] + steps[[middle]])
    return steps.max()


def assignment(lab, seed):
    """Returns DHBA's sum of utilities relative to the largest one, its exchanges, and the diameter of the graph."""
    draw = random.Random(seed)
    count, points = draw.randint(2, 5), draw.randint(1, 6)
    while True:
        robots, drawn = team(draw, count, points, (5.0, 20.0))
        if math.isfinite(diameter(robots)):
            break
    values = [round(draw.uniform(1, 3), 3) for _ in drawn]
    file = lab.write(
        "bounds.toml", scenario(robots, drawn, values, allocator="dhba", radio={"range_m": RANGE_M})
    )
    result = lab.allocate(file)
    tasks = tasks_of(result)
    worth = np.array(
        [
            [value * DISCOUNT ** cost_s(robot.at, point) for value, point in zip(values, drawn)]
            for robot in robots
        ]
    )
    given = sum(tasks, [])
    found = sum(worth[rank, number] for rank, each in enumerate(tasks) for number in each)
    return {
        "share": found / worth[linear_sum_assignment(worth, maximize=True)].sum(),
        "is_valid": max(map(len, tasks)) == 1 and len(given) == len(set(given)),
        "exchanges": result["rounds"] - FIRST_ROUNDS,
        "diameter": int(diameter(robots)),
    }


def measure(lab, quick):
    auctions = {
        objective: {
            f"{robots} robots, {points} points": {
                str(seed): auction(lab, objective, robots, points, seed)
                for seed in range(QUICK if quick else AUCTIONS)
            }
            for robots, points in teams
        }
        for objective, teams in TEAMS.items()
    }
    circles = {
        objective: {str(count): circle(lab, objective, count) for count in (QUICK_CIRCLES if quick else CIRCLES)}
        for objective in ("minimax", "miniave")
    }
    seeds = range(QUICK if quick else ASSIGNMENTS)
    return {"ssi": auctions, "circle": circles, "dhba": {str(seed): assignment(lab, seed) for seed in seeds}}


def sections(found):
    rows = []
    for objective, teams in found["ssi"].items():
        largest = {name: max(ratios.values()) for name, ratios in teams.items()}
        # The proved or remembered bound of each team.
        bounds = {
            name: {"minisum": 2, "minimax": 2 * robots, "miniave": 2 * points}[objective]
            for name, (robots, points) in zip(teams, TEAMS[objective])
        }
        ratios = zip(largest.items(), teams.values())
        rows.append(
            Row(
                f"SSI, `{objective}`: cost relative to the optimum",
                {
                    "minisum": "at most 2",
                    "minimax": "at most 2n with n robots; the worst case grows with n",
                    "miniave": "at most 2m with m points; the worst case grows with m",
                }[objective],
                "; ".join(
                    f"{name}: at most {most:.3f}, mean {sum(each.values()) / len(each):.3f}"
                    for (name, most), each in ratios
                ),
                verdict(all(largest[name] <= bounds[name] + 1e-9 for name in teams), is_known=False),
                "bound from memory"
                + ("" if objective == "minisum" else "; random instances do not contain the worst case"),
            )
        )
    for objective, ratios in found["circle"].items():
        # The remembered bounds of the worst case, by the number of robots. There are as many points as its square.
        bounds = [count if objective == "minimax" else count**2 for count in map(int, ratios)]
        values = list(ratios.values())
        grows = all(low < high for low, high in zip(values, values[1:]))
        symbol = {"minimax": "n", "miniave": "m"}[objective]
        reached = sum(value >= (bound + 1) / 2 for value, bound in zip(values, bounds))
        rows.append(
            Row(
                f"SSI, `{objective}`: ratios on a circle",
                f"the worst case grows with {symbol}: from ({symbol}+1)/2 to 2{symbol}",
                ", ".join(f"{value:.2f}" for value in values)
                + f" with n = {', '.join(ratios)} robots"
                + (" and m = n² points" if objective == "miniave" else "")
                + f"; at least ({symbol}+1)/2 in {reached} of {len(values)}",
                verdict(grows and all(value <= 2 * bound for value, bound in zip(values, bounds)), is_known=False),
                "bound from memory; own instances, because those of the paper were not available; at most "
                + ("1 + 2π" if objective == "minimax" else "1 + π")
                + " with any n",
            )
        )
    trials = list(found["dhba"].values())
    best = sum(trial["is_valid"] and trial["share"] > 1 - 1e-6 for trial in trials)
    quick = sum(trial["exchanges"] <= trial["diameter"] for trial in trials)
    diameters = sorted({trial["diameter"] for trial in trials})
    rows += [
        Row(
            "DHBA: optimal assignments",
            f"{len(trials)} of {len(trials)}",
            f"{best} of {len(trials)}",
            verdict(best == len(trials)),
            "SciPy's `linear_sum_assignment` of the utilities; sums within 0.0001 %",
        ),
        Row(
            "DHBA: exchanges until the last change",
            f"at most the diameter, {diameters[0]} to {diameters[-1]}",
            f"{quick} of {len(trials)}",
            verdict(quick == len(trials), is_known=False),
            f"bound from memory; counted after the {FIRST_ROUNDS} rounds in which robots receive the points and the "
            "first rows",
        ),
    ]
    return [
        Section(
            "SSI and DHBA: random static instances against exact optima",
            "Lagoudakis et al., RSS 2005 (SSI); Ismail, Sun, ICUAS 2017 (DHBA). Abstracts read.",
            f"Uniform places in {ROOM_M:.0f} × {ROOM_M:.0f} m. SSI: {AUCTIONS} instances of each size, points without "
            "work, each robot receives all others. Costs are those of the best order of each robot's points, and the "
            "optimum is by HiGHS. On a circle: n robots in the center, n places around them, and n points at each "
            "place. The ratio is to the assignment with one place for each robot, so that the true ratio is not lower. "
            f"DHBA: {ASSIGNMENTS} instances with 2 to 5 robots and 1 to 6 points, radio range {RANGE_M:.0f} m, "
            "connected.",
            rows,
        )
    ]
