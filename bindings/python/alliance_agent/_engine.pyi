"""The engine, in Rust. What is not told in the package's own modules is told here."""

from os import PathLike
from typing import Any, final

class AllianceError(Exception):
    """What went wrong, in the one line that the program has for it."""

class ScenarioError(AllianceError):
    """A mistake in what was asked for: what, where, and what would be right."""

class MindError(AllianceError):
    """A mind written in Python failed: which robot's, in which tick, and where. Its cause is what was raised there."""

@final
class Set:
    """A behavior set of the robot in a step."""

    #: Its number, the same for all robots.
    id: int
    name: str
    #: Number of the task that it performs.
    task: int
    task_name: str
    #: Whether it can be active in this step.
    applicable: bool
    #: Whether it was active after the step before.
    active: bool
    #: Since when it is active, or not, s.
    since: float
    #: Estimated time of a unit of its work, s, from what the robot itself knows; infinite if it cannot tell.
    cost: float
    #: What a unit is worth, in the mission's own measure.
    reward: float
    #: Since when the task is due again, s; what was said about an older round is void.
    round: float
    #: How many robots may perform the task at once.
    max_robots: int
    #: Of the task; higher goes first.
    priority: int
    #: A teammate that has been silent for so long has ceased, s.
    ceased_after: float
    #: Every ALLIANCE value in force of the set, as in run.json.
    values: dict[str, Any]

@final
class Heard:
    """A heartbeat of a teammate, or what a teammate of the same class said."""

    #: Rank of the sender, and number of its life.
    sender: int
    incarnation: int
    #: When it was sent, s.
    sent: float
    #: `executing`, `waiting`, `idle` or `released`; `said` of what a mind says itself, of which there is nothing below but `said`.
    state: str
    #: Numbers of its task and set; `None` when idle.
    task: int | None
    set: int | None
    #: Since when it has been in that state, s.
    since: float
    #: Effects that it has achieved on the task so far.
    progress: int
    #: Where the sender believes to be, m.
    position: tuple[float, float] | None
    #: Whether it carries something.
    carrying: bool
    #: What it knows of the mission, as JSON has it; bytes of missions with types of their own.
    lore: Any
    #: What its mind said.
    said: bytes

@final
class Stream:
    def begin_again(self) -> None: ...
    def next_u64(self) -> int: ...

@final
class Worlds:
    agents: list[str]
    columns: list[str]
    shape: tuple[int, int, int, int]
    part_size: int
    setup: str
    def __new__(cls, asked: dict[str, Any], level: str, period_s: float, envs: int, threads: int) -> Worlds: ...
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
def live(words: list[str], name: str, mind: type, twice: bool) -> int: ...

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
