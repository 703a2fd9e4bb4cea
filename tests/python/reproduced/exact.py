"""Exact optima of small assignments, by HiGHS."""

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
