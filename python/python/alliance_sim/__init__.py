"""Robot controllers, allocators and learning environments for alliance-sim, a distributed simulator of fault-tolerant robot teams.

- `Allocator`: selects a robot's behavior set. `Agent`: a complete controller; its step receives `Readings` and returns a `Deed`.
- `run`: runs a whole mission in this process.
- `main`: runs the process of one robot of a live run.
- `env.parallel_env`, `env.VecEnv`: learning environments with faults.
- `load`: reads the tables of a run folder, a comparison or a sweep.
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
