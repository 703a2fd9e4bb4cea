"""Shrinks fault schedules that leave a mission incomplete, with hypothesis as an independent shrinker.

Usage: python3 analysis/hunts/hypothesis_shrink.py analysis/hunts/incomplete.toml 300 ALLOCATOR…
The plan supplies the scenario, and 300 is the number of runs. Needs the packages alliance-sim and hypothesis.
"""
import sys
import tomllib

from alliance_sim import run
from hypothesis import HealthCheck, Phase, find, settings
from hypothesis import strategies as st
from hypothesis.errors import NoSuchExample

scenario = tomllib.load(open(sys.argv[1], "rb"))["scenario"]
limit, most = 600.0, int(sys.argv[2])
names = [robot["name"] for robot in scenario["robots"]]
robots, shares = st.sampled_from(names), st.floats(0.1, 1.0)
time = st.floats(0.0, 200.0).map(lambda at: round(at, 2))
duration = st.none() | st.floats(0.5, 60.0).map(lambda at: round(at, 2))
ends = st.sampled_from(["all", *names])


def order(fault, lasts):
    return st.builds(lambda fault, at_s, for_s: {"fault": fault, "at_s": at_s} | ({"for_s": for_s} if for_s and lasts else {}),
                     fault, time, duration)


def of_robot(kind, lasts=True):
    return order(robots.map(lambda name: {kind: name}), lasts)


orders = st.one_of(
    *[of_robot(kind) for kind in ["kill", "terminate", "pause", "mute", "deaf", "power", "babble"]],
    of_robot("restart", lasts=False),
    order(st.builds(lambda sender, p: {"drop": {"from": sender, "p": round(p, 2)}}, ends, shares), True),
    order(robots.map(lambda name: {"partition": {"groups": [[name], [other for other in names if other != name]]}}), True),
)
schedules = st.tuples(st.integers(1, 5), st.lists(orders, min_size=1, max_size=4))

for allocator in sys.argv[3:]:
    calls, first = 0, None

    def breaks(case):
        global calls, first
        seed, faults = case
        calls += 1
        done = run(scenario | {"allocator": allocator}, seed=seed, faults=faults, limit=limit)
        is_broken = done.outcome != "complete"
        if is_broken and first is None:
            first = (calls, len(faults))
        return is_broken

    options = settings(max_examples=most, deadline=None, derandomize=True, database=None,
                       suppress_health_check=list(HealthCheck), phases=[Phase.generate, Phase.shrink])
    try:
        seed, faults = find(schedules, breaks, settings=options)
        print(f"{allocator}: found in run {first[0]} with {first[1]} faults, {len(faults)} left after {calls} runs, seed {seed}: {faults}", flush=True)
    except NoSuchExample:
        print(f"{allocator}: none in {calls} runs", flush=True)
