"""Compares watcher.py with the built-in controller: mean share of targets in sight."""

from alliance_sim import Action, Agent, run
from watcher import Watcher


class Still(Agent):
    def step(self, now, readings, messages):
        return Action()  # observes without moving


print("mean share of five targets in sight of five robots: cmommt, seeds 1 to 10")
for name, controller in {"no motion": Still, "watcher": Watcher, "a-cmommt": None}.items():
    runs = [run("cmommt", controller and {"*": controller}, seed=seed) for seed in range(1, 11)]
    print(f"{name:12} {sum(done.result['a'] for done in runs) / len(runs):.3f}")
