"""An allocator of one's own beside the built-in ones: the same missions, without faults and with a radio that loses messages."""

from greedy import Greedy

from alliance_agent import run

LOSSES = [{"fault": {"drop": {"p": 0.6}}}]

print(f"{'allocator':<12}{'calm, s':>10}{'losses, s':>12}")
for name, mind in {"greedy": Greedy, "alliance": "alliance", "murdoch": "murdoch", "nearest": "nearest"}.items():
    means = []
    for faults in None, LOSSES:
        runs = [run("service", {"*": mind}, seed, faults=faults, robots=5, size=20) for seed in range(1, 6)]
        means.append(sum(done.seconds for done in runs) / len(runs))
    print(f"{name:<12}{means[0]:>10.1f}{means[1]:>12.1f}")
