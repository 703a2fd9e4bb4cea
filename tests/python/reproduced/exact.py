"""Exact optima of small assignments and schedules, by HiGHS."""

import math

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp


def _incidence(columns, robots, tasks):
    """Returns which columns contain each robot, and which contain each task.

    A column is (robot, tasks, number).
    """
    of_robot, of_task = np.zeros((robots, len(columns))), np.zeros((tasks, len(columns)))
    for index, (robot, each, _) in enumerate(columns):
        of_robot[robot, index] = 1
        of_task[list(each), index] = 1
    return of_robot, of_task


def partition(columns, robots, tasks):
    """Returns the largest sum of scores with at most one column of each robot and at most one of each task."""
    of_robot, of_task = _incidence(columns, robots, tasks)
    scores = np.array([score for _, _, score in columns])
    limits = [LinearConstraint(rows, ub=1) for rows in (of_robot, of_task)]
    found = milp(-scores, constraints=limits, integrality=np.ones(len(columns)), bounds=Bounds(0, 1))
    assert found.success, found.message
    return -float(found.fun)


def makespan(columns, robots, tasks):
    """Returns the least time by which all tasks are done, with at most one column of each robot. The last variable is
    that time.
    """
    of_robot, of_task = _incidence(columns, robots, tasks)
    times = of_robot * np.array([time for _, _, time in columns])
    wider = lambda rows, last: np.hstack([rows, np.full((len(rows), 1), float(last))])
    limits = [
        LinearConstraint(wider(of_robot, 0), ub=1),
        LinearConstraint(wider(of_task, 0), lb=1, ub=1),
        LinearConstraint(wider(times, -1), ub=0),
    ]
    goal = np.append(np.zeros(len(columns)), 1.0)
    kinds = np.append(np.ones(len(columns)), 0)
    upper = np.append(np.ones(len(columns)), np.inf)
    found = milp(goal, constraints=limits, integrality=kinds, bounds=Bounds(0, upper))
    assert found.success, found.message
    return float(found.fun)


class _Rows:
    """Linear constraints, from terms of a variable and its factor."""

    def __init__(self, variables):
        self.variables, self.rows, self.lower, self.upper = variables, [], [], []

    def add(self, terms, least=-np.inf, most=np.inf):
        row = np.zeros(self.variables)
        for at, factor in terms:
            row[at] += factor
        self.rows.append(row)
        self.lower.append(least)
        self.upper.append(most)

    def constraint(self):
        return LinearConstraint(np.array(self.rows), self.lower, self.upper)


def schedule(starts, tasks):
    """Returns the least makespan of robots with 1 m/s, s, or the largest value if the tasks have windows.

    Variables: the ways of each robot between places, the start of each task, whether it is done, and the makespan. A
    robot may drive to a task before its predecessors are done, and waits there.
    """
    count, robots = len(tasks), range(len(starts))
    places = [*starts, *(at for task in tasks for at in (task.at, task.end))]
    longest = max(math.dist(one, other) for one in places for other in places)
    horizon = sum(task.duration_s + longest for task in tasks) + max(task.deadline_s or 0.0 for task in tasks)
    ways = [(r, i, j) for r in robots for i in range(-1, count) for j in range(count) if i != j]
    way = {each: number for number, each in enumerate(ways)}
    start, done, last = len(ways), len(ways) + count, len(ways) + 2 * count
    rows = _Rows(last + 1)
    for r in robots:
        rows.add([(way[r, -1, j], 1) for j in range(count)], most=1)
    for j, task in enumerate(tasks):
        into = [[(way[r, i, j], 1) for i in range(-1, count) if i != j] for r in robots]
        rows.add([*sum(into, []), (done + j, -task.slots)], 0, 0)
        for r in robots:
            rows.add([*into[r], (done + j, -1)], most=0)
            rows.add([*((way[r, j, k], 1) for k in range(count) if k != j), *((at, -1) for at, _ in into[r])], most=0)
        for i in task.after:
            rows.add([(start + j, 1), (start + i, -1)], least=tasks[i].duration_s)
        rows.add([(last, 1), (start + j, -1)], least=task.duration_s)
    # A task that follows another one, or the start of a robot, begins after the way from there.
    for (r, i, j), number in way.items():
        place, busy_s = (starts[r], 0.0) if i < 0 else (tasks[i].end, tasks[i].duration_s)
        before = [] if i < 0 else [(start + i, -1)]
        needed = busy_s + math.dist(place, tasks[j].at)
        rows.add([(start + j, 1), (number, -horizon), *before], least=needed - horizon)
    has_windows = tasks[0].deadline_s is not None
    goal = np.zeros(last + 1)
    low, high = np.zeros(last + 1), np.ones(last + 1)
    high[start:done], high[last] = horizon, np.inf
    if has_windows:
        goal[done:last] = [-task.value for task in tasks]
        low[start:done] = [task.opens_s for task in tasks]
        # The start of a task that is left out has no meaning.
        high[start:done] = [task.deadline_s - task.duration_s for task in tasks]
    else:
        goal[last] = 1
        low[done:last] = 1
    kinds = np.ones(last + 1)
    kinds[start:done] = kinds[last] = 0
    bounds = Bounds(low, high)
    found = milp(goal, constraints=rows.constraint(), integrality=kinds, bounds=bounds, options={"mip_rel_gap": 1e-6})
    assert found.success, found.message
    return -float(found.fun) if has_windows else float(found.fun)
