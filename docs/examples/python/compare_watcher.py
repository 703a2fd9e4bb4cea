"""watcher.py beside the simulator's own minds: the share of the targets that are in sight, on average."""

from alliance_agent import Agent, Deed, run
from watcher import Watcher


class Still(Agent):
    def step(self, now, readings, heard):
        return Deed()  # it looks, and stands


print("mean share of five targets in sight of five robots, cmommt, seeds 1 to 10")
for name, mind in {"nobody moves": Still, "watcher": Watcher, "a-cmommt": None}.items():
    runs = [run("cmommt", mind and {"*": mind}, seed=seed) for seed in range(1, 11)]
    print(f"{name:12} {sum(done.result['a'] for done in runs) / len(runs):.3f}")
