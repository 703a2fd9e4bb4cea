"""Minds, allocators and learning environments for alliance-sim, a distributed simulator of fault-tolerant robot teams.

- `Allocator`: a rule that decides what a robot works on. `Agent`: a whole mind, of which a step gets `Readings` and returns a `Deed`.
- `run` carries out a whole mission in this process.
- `main`: the process of one robot of a live run.
- `env.parallel_env`, `env.VecEnv`: learning environments, faults included.
- `load`: the tables of a run's folder, and what `alliance compare` and `alliance sweep` have found.
"""

from ._engine import AllianceError, Heard, MindError, ScenarioError, Set
from ._minds import Agent, Allocator, Deed, Readings, Rng
from ._process import main
from ._results import Results, load
from ._run import Run, run

__all__ = [
    "Agent",
    "AllianceError",
    "Allocator",
    "Deed",
    "Heard",
    "MindError",
    "Readings",
    "Results",
    "Rng",
    "Run",
    "ScenarioError",
    "Set",
    "load",
    "main",
    "run",
]
