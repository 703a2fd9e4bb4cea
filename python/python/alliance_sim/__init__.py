"""Robot controllers, allocators and learning environments for alliance-sim, a distributed simulator of fault-tolerant robot teams.

- `Allocator`: selects a robot's behavior set. `Agent`: a complete controller; its step receives `Readings` and returns an `Action`.
- `run`: runs a whole mission in this process.
- `compare`, `sweep`, `tune`: many runs with statistics, also of controllers in Python beside the built-in allocators.
- `main`: runs the process of one robot of a live run.
- `env.parallel_env`, `env.VecEnv`, `env.RobotEnv`: learning environments with faults.
- `load`: reads the tables of a run folder, a comparison or a sweep.
"""

from ._controllers import Action, Agent, Allocator, Readings, Rng
from ._engine import VERSION as __version__
from ._engine import AllianceError, ControllerError, Message, ScenarioError, Set
from ._plans import compare, sweep, tune
from ._process import main
from ._results import Results, load
from ._run import Run, run

__all__ = [
    "Action",
    "Agent",
    "AllianceError",
    "Allocator",
    "ControllerError",
    "Message",
    "Readings",
    "Results",
    "Rng",
    "Run",
    "ScenarioError",
    "Set",
    "__version__",
    "compare",
    "load",
    "main",
    "run",
    "sweep",
    "tune",
]
