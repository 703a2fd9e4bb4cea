"""Compares greedy.py with built-in allocators under message loss: mean time from a point's arrival to its completion."""

from greedy import Greedy

from alliance_sim import run

LOSSES = {"none": 0.0, "60 %": 0.6, "95 %": 0.95}
CONTROLLERS = {"greedy": Greedy, "alliance": "alliance", "murdoch": "murdoch", "nearest": "nearest"}

print(f"{'response, s':<12}" + "".join(f"{lost:>8}" for lost in LOSSES))
for name, controller in CONTROLLERS.items():
    means = []
    for share in LOSSES.values():
        faults = [{"fault": {"drop": {"p": share}}}]
        runs = [run("service", {"*": controller}, seed, faults=faults, robots=10, size=40) for seed in range(1, 11)]
        means.append(sum(done.result["response"]["mean_ms"] for done in runs) / len(runs) / 1000)
    print(f"{name:<12}" + "".join(f"{mean:>8.1f}" for mean in means))
