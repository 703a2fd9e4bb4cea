"""Gaps to the optimum: small instances against HiGHS, and vehicle routing instances against PyVRP."""

import json
import math
import random
import re
import tomllib
from importlib.util import find_spec
from itertools import combinations

import classes
from exact import makespan
from lab import REACH_M, ROOM_M, Point, Robot, place, random_place, small_scenario
from page import OTHER, Row, Section, prose, table

SMALL, QUICK = 20, 1
ROBOTS, POINTS = 3, 7
FILES = {"RC101": "RC101.txt", "RC208": "RC208.vrp", "PR01": "PR01.vrp", "PR11A": "PR11A.vrp"}
# PyVRP stops after this number of iterations, so that its solution is the same on every machine.
ITERATIONS, SEED = 2_000, 1
# PyVRP computes in whole numbers: 1 unit is 1 cm or 10 ms.
UNITS = 100


def missing(given):
    if find_spec("pyvrp") is None:
        return "there is no Python package pyvrp; see tests/python/requirements.txt"
    if not given.check and given.instances is None:
        return f"--instances: state the folder with {', '.join(FILES.values())}"
    files = [] if given.check else [given.instances / file for file in FILES.values()]
    for file in files:
        if not file.is_file():
            return f"there is no file {file}"
    return None


def small(seed):
    """Returns a random instance: uniform places, and work of U(5, 60) s."""
    draw = random.Random(seed)
    robots = [Robot(f"r{number}", random_place(draw)) for number in range(ROBOTS)]
    return robots, [Point(random_place(draw), round(draw.uniform(5, 60), 3), 0.0, None) for _ in range(POINTS)]


def scenario(robots, points):
    points = [{"kind": "task", "work_s": each.work_s, **place(each.at)} for each in points]
    robots = [{"name": each.name, "start": place(each.at)} for each in robots]
    return small_scenario("small", 2000.0, points, robots)


def least_times(robot, points):
    """Returns the least time of a robot for each set of points, s (Held and Karp)."""
    least = {
        ((last,), last): math.dist(robot.at, point.at) + point.work_s for last, point in enumerate(points)
    }
    for count in range(2, len(points) + 1):
        for chosen in combinations(range(len(points)), count):
            for last in chosen:
                before = tuple(each for each in chosen if each != last)
                times = (least[before, at] + math.dist(points[at].at, points[last].at) for at in before)
                least[chosen, last] = min(times) + points[last].work_s
    sets = {chosen for chosen, _ in least}
    return {chosen: min(least[chosen, last] for last in chosen) for chosen in sets}


def least_makespan(robots, points):
    columns = [
        (rank, chosen, time_s)
        for rank, robot in enumerate(robots)
        for chosen, time_s in sorted(least_times(robot, points).items())
    ]
    return makespan(columns, len(robots), len(points))


def measure_small(lab, seed, allocators):
    robots, points = small(seed)
    optimum = least_makespan(robots, points)
    file = lab.write("small.toml", scenario(robots, points))
    gaps = {}
    for allocator in allocators:
        result, _ = lab.run(file, "--allocator", allocator)
        done = result["outcome"] == "complete"
        gaps[allocator] = result["result"]["makespan_ms"] / 1000 / optimum - 1 if done else None
    return {"optimum_s": optimum, "gaps": gaps}


def imported(lab, name):
    """Imports an instance of vehicle routing. Returns the scenario file and its robots and points."""
    file = lab.folder / f"{name}.toml"
    lab.alliance("import", lab.instances / FILES[name], "--out", file)
    # The problem for both sides has no capacities.
    text = re.sub(r"^(demand|capacity) = .*\n", "", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    # A long reach would shorten the routes.
    changed = text.replace("[service]\n", f"[service]\nreach_m = {REACH_M}\n")
    file.write_text(f"step_ms = 100\n{changed}", encoding="utf-8")
    scenario = tomllib.loads(text)
    start = lambda robot: (robot["start"]["x_m"], robot["start"]["y_m"])
    robots = [Robot(robot["name"], start(robot)) for robot in scenario["robots"]]
    points = [
        Point((each["x_m"], each["y_m"]), each["work_s"], each.get("opens_s", 0.0), each.get("deadline_s"))
        for each in scenario["service"]["points"]
    ]
    assert scenario["body"]["speed_m_s"] == 1.0, "a metre takes a second"
    return file, robots, points


def pyvrp_way(robots, points):
    """Returns the length of PyVRP's routes for the imported problem: open routes, no capacities, all points served in
    their windows.
    """
    import pyvrp
    from pyvrp.stop import MaxIterations

    model = pyvrp.Model()
    units = lambda value: round(value * UNITS)
    add_location = lambda at: model.add_location(units(at[0]), units(at[1]))
    starts = sorted({robot.at for robot in robots})
    places = [(add_location(at), at) for at in [*starts, *(point.at for point in points)]]
    # Routes end anywhere: each way to this place has length 0.
    end = add_location((0, 0))
    last = model.add_depot(end)
    for (start, _), at in zip(places, starts):
        count = sum(robot.at == at for robot in robots)
        model.add_vehicle_type(num_available=count, start_depot=model.add_depot(start), end_depot=last)
    for (location, _), point in zip(places[len(starts) :], points):
        closes = {} if point.deadline_s is None else {"tw_late": units(point.deadline_s - point.work_s)}
        model.add_client(
            location, service_duration=units(point.work_s), tw_early=units(point.opens_s), **closes
        )
    for one, one_at in places:
        model.add_edge(one, end, distance=0)
        model.add_edge(end, one, distance=0)
        for other, other_at in places:
            way = units(math.dist(one_at, other_at))
            model.add_edge(one, other, distance=way, duration=way)
    found = model.solve(MaxIterations(ITERATIONS), seed=SEED, display=False)
    assert found.is_feasible(), "PyVRP serves all points"
    return found.best.distance() / UNITS


def way_of(lab, out, robots, points):
    """Returns the length of the routes that the robots drove: from the start through the points that each has "
    "done."""
    lab.alliance("export", out, f"--instance={out / 'instance.json'}")
    result = json.loads((out / "instance.json").read_text())["result"]
    number = {task["id"]: index for index, task in enumerate(result["tasks"])}
    ends = {task["id"]: task for task in result["tasks"]}
    total = 0.0
    for robot, each in zip(robots, result["robots"]):
        at = robot.at
        for task in each["tasks"]:
            if ends[task]["state"] == "done":
                total += math.dist(at, points[number[task]].at)
                at = points[number[task]].at
    return total


def measure_file(lab, name, allocators):
    file, robots, points = imported(lab, name)
    found = {"robots": len(robots), "points": len(points), "pyvrp_m": pyvrp_way(robots, points)}
    for allocator in allocators:
        result, out = lab.run(file, "--allocator", allocator, log="summary")
        found[allocator] = {
            "done": result["result"]["done"],
            "way_m": way_of(lab, out, robots, points),
        }
    return found


def measure(lab, quick):
    # The weights of `learned` are of another scenario.
    allocators = [name for name in lab.allocators() if name != "learned"]
    seeds = range(QUICK if quick else SMALL)
    found = {"small": {str(seed): measure_small(lab, seed, allocators) for seed in seeds}}
    found["classes"] = classes.measure(lab, range(QUICK if quick else classes.SEEDS), allocators)
    if not quick:
        found["files"] = {name: measure_file(lab, name, allocators) for name in FILES}
    return found


def small_table(trials):
    lines = []
    for allocator in trials[0]["gaps"]:
        gaps = [trial["gaps"][allocator] for trial in trials]
        done = [gap for gap in gaps if gap is not None]
        mean = f"{sum(done) / len(done):.1%}" if done else "–"
        best = sum(gap < 0.01 for gap in done)
        lines.append(
            [f"`{allocator}`", f"{len(done)} of {len(gaps)}", mean, f"{max(done, default=0):.1%}", str(best)]
        )
    return table(["allocator", "complete", "mean gap", "largest gap", "within 1 %"], lines)


def files_table(files):
    header, best = ["allocator"], ["PyVRP"]
    lines = {}
    for name, found in files.items():
        header += [f"{name}: done", "way, m", "gap"]
        best += [f"{found['points']} of {found['points']}", f"{found['pyvrp_m']:,.0f}", "0%"]
        for allocator, each in found.items():
            if isinstance(each, dict):
                is_whole = each["done"] == found["points"]
                gap = f"{each['way_m'] / found['pyvrp_m'] - 1:.0%}" if is_whole else "–"
                lines.setdefault(allocator, [f"`{allocator}`"]).extend(
                    [f"{each['done']} of {found['points']}", f"{each['way_m']:,.0f}", gap]
                )
    return table(header, [best, *(line + ["–"] * (len(header) - len(line)) for line in lines.values())])


def sections(found):
    trials, files = list(found["small"].values()), found["files"]
    rows = [
        Row(
            "RC208: best known route length",
            "776.1, with capacities and return to the depot",
            f"{files['RC208']['pyvrp_m']:,.1f} m by PyVRP for the imported problem",
            OTHER,
            "robots carry any load and do not return to the depot, so that the gaps below refer to PyVRP",
        ),
    ]
    return [
        Section(
            "Gaps to the optimum",
            "The solvers HiGHS (in SciPy) and PyVRP. RC101 and RC208 by Solomon, PR01 and PR11A after Cordeau and "
            "Vidal. RC101 is the file of the repository iRB-Lab/py-ga-VRPTW (commit bf80619), the others are those in "
            "the tests of PyVRP; the figure for RC208 is from its solution file there.",
            "Each allocator but `learned`, whose weights are of another scenario, carries out the instance by robots "
            "that drive. All points are known from the start. "
            "Robots turn at once, pass through each other and drive 1 m/s.",
            rows,
            "\n\n".join(
                [
                    prose(
                        f"**Makespan against the exact optimum.** {len(trials)} random instances with {ROBOTS} "
                        f"robots and {POINTS} points, uniform in {ROOM_M:.0f} × {ROOM_M:.0f} m, with work of U(5, "
                        "60) s. The optimum is by HiGHS over all sets of points in their best order. Gaps of "
                        "complete missions."
                    ),
                    small_table(trials),
                    prose(
                        f"**Properties of points.** {classes.SEEDS} random instances of each class with {ROBOTS} "
                        "robots: 5 points of which two need two robots; 6 points with three successions in two "
                        "chains; 5 points with deliveries; 8 points with windows of 20 to 60 s more than the work "
                        "and values of 1 to 9. The optimum is by HiGHS. It may wait at a point whose predecessors "
                        "are not done, which no robot here can, because it does not receive the point before. For "
                        "the first three classes, the table has the mean gap of the makespan and, in brackets, the "
                        "number of complete missions. For the last, it has the mean share of the largest possible "
                        "value."
                    ),
                    classes.classes_table(found["classes"]),
                    prose(
                        f"**Route length against PyVRP.** PyVRP solves the imported problem in {ITERATIONS:,} "
                        f"iterations (seed {SEED}): open routes without capacities, all points in their windows. "
                        "The way of an allocator is that of its routes: from the start through the points that "
                        "each robot has done. The gap is given if all points are done. Its rules minimize times "
                        "or costs of single tasks, and not the way of the team. PR01 loses the limits on which "
                        "vehicles may serve a customer, and PR11A those on the duration of a route."
                    ),
                    files_table(files),
                ]
            ),
        )
    ]
