"""Types of the engine, which is written in Rust."""

from os import PathLike
from typing import Any, final

class AllianceError(Exception):
    """An error of the simulator. The message is the line that the program prints."""

class ScenarioError(AllianceError):
    """A mistake in the request. The message states the position, the problem and the remedy."""

class ControllerError(AllianceError):
    """A controller written in Python failed. The message states the robot, the tick and the position. The cause is the original exception."""

@final
class Set:
    """A behavior set of the robot in a step."""

    #: Id of the set, the same for all robots.
    id: int
    name: str
    #: Id of the set's task.
    task: int
    task_name: str
    #: The set can be active in this step.
    applicable: bool
    #: The set was active at the end of the previous step.
    active: bool
    #: Start of the present state, active or not, s.
    since: float
    #: Estimated time of one unit of work, s, from the robot's own knowledge; infinite without an estimate.
    cost: float
    #: Value of one unit of work, in the mission's own measure.
    reward: float
    #: Time at which the task became due again, s. Messages about earlier rounds are void.
    round: float
    #: Maximum number of robots that may perform the task at once.
    max_robots: int
    #: Priority of the task; a higher one goes first.
    priority: int
    #: Time without messages after which a teammate counts as lost, s.
    ceased_after: float
    #: Values of all ALLIANCE parameters of the set, as in run.json.
    values: dict[str, Any]

@final
class Message:
    """A heartbeat of a teammate, or a message of a teammate of the same class."""

    #: Rank and incarnation of the sender.
    sender: int
    incarnation: int
    #: Send time, s.
    sent: float
    #: `executing`, `waiting`, `idle` or `released`; `message` for a controller's own message, of which only `content` is set below.
    state: str
    #: Ids of the task and the set; `None` when idle.
    task: int | None
    set: int | None
    #: Start of that state, s.
    since: float
    #: Number of effects on the task so far.
    progress: int
    #: Position of the sender by its own estimate, m.
    position: tuple[float, float] | None
    #: The sender carries an item.
    carrying: bool
    #: Shared knowledge of the sender about the mission, as JSON values; bytes for missions with their own types.
    shared_knowledge: Any
    #: Content of the controller's own message.
    content: bytes

@final
class Stream:
    def begin_again(self) -> None: ...
    def next_u64(self) -> int: ...

@final
class EnvironmentBatch:
    agents: list[str]
    columns: list[str]
    shape: tuple[int, int, int, int]
    part_size: int
    setup: str
    def __new__(cls, asked: dict[str, Any], level: str, period_s: float, envs: int, threads: int) -> EnvironmentBatch: ...
    def reset(self, seed: int) -> None: ...
    def step(self, actions: Any, auto_reset: bool) -> None: ...
    def see(self, part: int, observation: Any, mask: Any, alive: Any, reward: Any, done: Any) -> None: ...
    def record(self, index: int, folder: PathLike[str]) -> None: ...
    def close(self) -> None: ...
    def ended(self, index: int) -> tuple[str | None, str | None]: ...
    def row(self, index: int) -> list[float | None]: ...
    def events(self, index: int) -> list[tuple[float, list[str]]]: ...
    def faults(self, index: int) -> list[str]: ...
    def poses(self, index: int) -> list[list[float]]: ...
    def sets(self, agent: int) -> list[str]: ...
    def feature_names(self, agent: int) -> list[str]: ...

def run(asked: dict[str, Any], folder: PathLike[str] | None, level: str) -> str: ...
def full_table(folder: PathLike[str], file_name: str) -> str | None: ...
def run_agent(words: list[str], name: str, controller: type, twice: bool) -> int: ...

class math:
    @staticmethod
    def acos(x: float) -> float: ...
    @staticmethod
    def asin(x: float) -> float: ...
    @staticmethod
    def atan(x: float) -> float: ...
    @staticmethod
    def atan2(y: float, x: float) -> float: ...
    @staticmethod
    def cbrt(x: float) -> float: ...
    @staticmethod
    def cos(x: float) -> float: ...
    @staticmethod
    def cosh(x: float) -> float: ...
    @staticmethod
    def exp(x: float) -> float: ...
    @staticmethod
    def expm1(x: float) -> float: ...
    @staticmethod
    def hypot(x: float, y: float) -> float: ...
    @staticmethod
    def log(x: float) -> float: ...
    @staticmethod
    def log10(x: float) -> float: ...
    @staticmethod
    def log1p(x: float) -> float: ...
    @staticmethod
    def log2(x: float) -> float: ...
    @staticmethod
    def pow(x: float, y: float) -> float: ...
    @staticmethod
    def sin(x: float) -> float: ...
    @staticmethod
    def sinh(x: float) -> float: ...
    @staticmethod
    def sqrt(x: float) -> float: ...
    @staticmethod
    def tan(x: float) -> float: ...
    @staticmethod
    def tanh(x: float) -> float: ...
