"""Types of the engine, which is written in Rust."""

from collections.abc import Mapping, Sequence
from os import PathLike
from types import ModuleType
from typing import Any, final

__all__ = [
    "AllianceError",
    "BOUND",
    "BUILD",
    "ControllerError",
    "EnvironmentBatch",
    "EnvironmentStates",
    "Message",
    "ScenarioError",
    "Set",
    "Stream",
    "VERSION",
    "execute_plan",
    "full_table",
    "math",
    "restored_message",
    "run",
    "run_agent",
]

class AllianceError(Exception):
    """An error of the simulator. The message is the line that the program prints."""

class ScenarioError(AllianceError):
    """A mistake in the request. The message states the position, the problem and the remedy."""

class ControllerError(AllianceError):
    """A controller written in Python failed. The message states the robot, the tick and the position. The cause is the original exception."""

#: Version and build of the engine.
VERSION: str
BUILD: str
#: Largest absolute value in an observation.
BOUND: float
#: Functions of the module `alliance_sim.math`.
math: ModuleType

@final
class Set:
    """A behavior set of the robot in a step. The constructor is for tests of a controller."""

    def __new__(
        cls,
        id: int,
        name: str,
        task: int,
        *,
        task_name: str = "",
        applicable: bool = True,
        active: bool = False,
        since: float = 0.0,
        cost: float = ...,
        reward: float = 1.0,
        round: float = 0.0,
        max_robots: int = 1,
        priority: int = 0,
        opens_in: float = 0.0,
        ceased_after: float = 10.0,
        values: Mapping[str, Any] | None = None,
        place: tuple[float, float] | None = None,
        travel: float | None = None,
    ) -> Set: ...
    @property
    def id(self) -> int:
        """Id of the set, the same for all robots."""
    @property
    def name(self) -> str:
        """Name of the set."""
    @property
    def task(self) -> int:
        """Id of the set's task, an index of `Controller.tasks`."""
    @property
    def task_name(self) -> str:
        """Name of the set's task."""
    @property
    def applicable(self) -> bool:
        """True if the set can be active in this step."""
    @property
    def active(self) -> bool:
        """True if the set was active at the end of the previous step."""
    @property
    def since(self) -> float:
        """Start of the present state, active or not, s."""
    @property
    def cost(self) -> float:
        """Estimated time of one unit of work with travel and wait, s, from the robot's own knowledge; infinite without an estimate."""
    @property
    def place(self) -> tuple[float, float] | None:
        """Place to which the robot drives for the next unit of work, (x, y), m, from the robot's own knowledge; `None` without a known place."""
    @property
    def travel(self) -> float:
        """Estimated travel time to `place`, s, a part of `cost`; 0 for work without a place, infinite without an estimate."""
    @property
    def work(self) -> float:
        """Estimated time of one unit of work at `place`, s: `cost` without travel and wait; infinite without an estimate."""
    @property
    def opens_in(self) -> float:
        """Time until the work of the unit can begin, s. `cost` contains the wait."""
    @property
    def reward(self) -> float:
        """Value of one unit of work, in the mission's own measure."""
    @property
    def round(self) -> float:
        """Time at which the task became due again, s. Messages about earlier rounds are void."""
    @property
    def max_robots(self) -> int:
        """Maximum number of robots that may perform the task at once."""
    @property
    def priority(self) -> int:
        """Priority of the task; a higher one goes first."""
    @property
    def ceased_after(self) -> float:
        """Time without messages after which a teammate counts as lost, s."""
    @property
    def values(self) -> Mapping[str, Any]:
        """Values of all ALLIANCE parameters of the set, as in run.json."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Set: ...
    def __deepcopy__(self, _memo: Any) -> Set: ...
    def __getnewargs_ex__(self) -> tuple[tuple[int, str, int], dict[str, Any]]:
        """Returns the arguments of the constructor, for pickle."""

@final
class Message:
    """A heartbeat of a teammate, or a message of a teammate of the same class. The constructor is for tests of a controller."""

    def __new__(
        cls,
        sender: int,
        state: str = "idle",
        *,
        incarnation: int = 1,
        sent: float = 0.0,
        task: int | None = None,
        set: int | None = None,
        since: float = 0.0,
        progress: int = 0,
        position: tuple[float, float] | None = None,
        carrying: bool = False,
        content: bytes | None = None,
        shared_knowledge: Any = None,
    ) -> Message: ...
    @property
    def sender(self) -> int:
        """Rank of the sender, an index of `Controller.team`."""
    @property
    def incarnation(self) -> int:
        """Incarnation of the sender, from 1."""
    @property
    def sent(self) -> float:
        """Simulated time at which it was sent, s."""
    @property
    def state(self) -> str:
        """`executing`, `waiting`, `idle` or `released`; `message` for a controller's own message, of which only `content` is set below."""
    @property
    def task(self) -> int | None:
        """Id of the task; `None` when idle."""
    @property
    def set(self) -> int | None:
        """Id of the behavior set; `None` when idle."""
    @property
    def since(self) -> float:
        """Start of that state, s."""
    @property
    def progress(self) -> int:
        """Number of effects on the task so far."""
    @property
    def position(self) -> tuple[float, float] | None:
        """Position of the sender by its own estimate, (x, y), m."""
    @property
    def carrying(self) -> bool:
        """True if the sender carries an item."""
    @property
    def shared_knowledge(self) -> Any:
        """Shared knowledge of the sender, in the mission's own form with the names of docs/WIRE.md; `None` without any."""
    @property
    def size(self) -> int:
        """Size of the message on the bus, bytes, with its seal. A message of the constructor has no shared knowledge in it."""
    @property
    def content(self) -> bytes:
        """Content of the controller's own message."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Message: ...
    def __deepcopy__(self, _memo: Any) -> Message: ...
    def __reduce__(self) -> tuple[Any, ...]:
        """Returns the call that pickle repeats."""

@final
class Stream:
    def begin_again(self) -> None: ...
    def next_u64(self) -> int: ...

@final
class EnvironmentStates: ...

@final
class EnvironmentBatch:
    agents: list[str]
    columns: list[str]
    shape: tuple[int, int, int, int]
    part_size: int
    setup: str
    def __new__(
        cls,
        asked: dict[str, Any],
        level: str,
        length: tuple[float | None, int | None],
        size: tuple[int, int],
        shaping: list[tuple[str, float]],
        extras: tuple[bool, bool],
    ) -> EnvironmentBatch: ...
    def reset(self, seeds: list[int | None]) -> None: ...
    def ends(self) -> list[tuple[int, list[float], str | None, str, int]]: ...
    def picture(self, index: int, width_px: int) -> tuple[int, int, bytes] | None: ...
    def step(self, actions: Any, auto_reset: bool) -> bool: ...
    def see(self, part: int, observation: Any, mask: Any, alive: Any, reward: Any, done: Any) -> None: ...
    def record(self, index: int, folder: PathLike[str]) -> None: ...
    def close(self) -> None: ...
    def states(self, mask: list[bool]) -> EnvironmentStates: ...
    def restore(self, saved: EnvironmentStates, mask: list[bool]) -> None: ...
    def copied(self) -> EnvironmentBatch: ...
    def ended(self, index: int) -> tuple[str | None, str | None]: ...
    def row(self, index: int) -> list[float | None]: ...
    def events(self, index: int) -> list[tuple[float, list[str]]]: ...
    def faults(self, index: int) -> list[str]: ...
    def poses(self, index: int) -> list[list[float]]: ...
    def sets(self, agent: int) -> list[str]: ...
    def feature_names(self, agent: int) -> list[str]: ...

def run(asked: dict[str, Any], folder: PathLike[str] | None, level: str) -> str: ...
def full_table(folder: PathLike[str], file_name: str) -> str | None: ...
def execute_plan(words: list[str], controllers: list[tuple[str, type]], modules: Sequence[PathLike[str]]) -> int: ...
def restored_message(bytes: bytes, mission: str | None, stated: Any) -> Message: ...
def run_agent(words: list[str], name: str, controller: type, twice: bool) -> int: ...
