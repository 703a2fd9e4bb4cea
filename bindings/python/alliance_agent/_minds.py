"""What an allocator in Python is derived from."""

from __future__ import annotations

import copy
import random
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from ._engine import Heard, Set, Stream

#: The longest message of a mind's own, bytes.
SAY_MAX = 1200


class Rng(random.Random):
    """Random numbers of a robot's own, of the run's seed, with all that `random.Random` can draw.

    In each step they begin anew, numbered by seed, robot and tick: a step that is made twice draws the same, and no robot
    shifts another's. A step has 2048 numbers of 64 bits.
    """

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        super().__init__()

    def seed(self, *_: Any, **__: Any) -> None:
        """Does nothing: the seed is the run's."""

    def random(self) -> float:
        """A number from 0 to below 1."""
        return (self._stream.next_u64() >> 11) * 2.0**-53

    def getrandbits(self, k: int, /) -> int:
        """A whole number of that many random bits."""
        words = -(-k // 64)
        number = 0
        for _ in range(words):
            number = number << 64 | self._stream.next_u64()
        return number >> (64 * words - k)

    def gauss(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        """As `normalvariate`, which keeps nothing for the next call."""
        return self.normalvariate(mu, sigma)


class Allocator:
    """Decides which behavior set of a robot is active; the rest of the robot is the mission's own, in Rust.

    The same inputs must give the same decision, on every machine: no clock, no `random` but `self.rng`, no order of a set.
    Heartbeats that say what the robot works on are made for it, so robots with other allocators understand it.
    """

    #: Name of the robot.
    name: str
    #: Its place in the team, from 0.
    rank: int
    #: The run as the team knows it, as in run.json: `seed`, `scenario`, `alliance`. Shared by all robots; not to be changed.
    setup: Mapping[str, Any]
    #: Random numbers.
    rng: Rng
    #: Attributes that are shared by checkpoints and not copied into them, such as a large net that does not change.
    frozen: ClassVar[frozenset[str] | set[str]] = frozenset()

    _said: list[bytes]
    _bids: dict[int, float]

    def reset(self) -> None:
        """A new life begins: without memory. `name`, `rank`, `setup` are known."""

    def step(self, now: float, heard: Sequence[Heard], sets: Sequence[Set]) -> Set | None:
        """Returns which of its applicable sets is active from now on; `None`: it is idle.

        `now`: simulated time, s. `heard`: heartbeats of teammates, and what teammates of the same class `say`, by sender and
        number. `sets`: the robot's behavior sets, always in the same order.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")

    def say(self, words: bytes) -> None:
        """Sends up to 1200 bytes to the teammates of the same class, with this step; they hear it as `Heard.said`."""
        if not isinstance(words, bytes):
            raise TypeError(f"say: {type(words).__name__} is not bytes")
        if len(words) > SAY_MAX:
            raise ValueError(f"say: {len(words)} bytes; at most {SAY_MAX} can be sent")
        if len(self._said) > self._own:
            raise ValueError(f"say: a robot with {self._own} sets sends at most {self._own + 1} messages in a step")
        self._said.append(words)

    def bid(self, set: Set, value: float) -> None:
        """Shows in allocation.csv, and so on page and report, what the set is worth to it in this step."""
        value = float(value)
        if value - value != 0.0:
            raise ValueError(f"bid: {value} is no number")
        self._bids[set.id] = value

    def _begin(self, name: str, rank: int, setup: Mapping[str, Any], stream: Stream) -> None:
        self.name, self.rank, self.setup, self.rng = name, rank, setup, Rng(stream)
        self._own = len(setup["alliance"]["robots"][name]["sets"])
        self._said, self._bids = [], {}
        self.reset()

    def __deepcopy__(self, memo: dict[int, Any]) -> Allocator:
        shared = {"setup", "rng"} | self.frozen
        twin = type(self).__new__(type(self))
        memo[id(self)] = twin
        for key, value in self.__dict__.items():
            twin.__dict__[key] = value if key in shared else copy.deepcopy(value, memo)
        return twin


def line_of(robot: str, tick: int, error: BaseException) -> str:
    """Whose mind failed, when, where and why."""
    frames = traceback.extract_tb(error.__traceback__)
    own = Path(__file__)
    # Where its author has written something, not where this package refuses it.
    theirs = [frame for frame in frames if Path(frame.filename) != own]
    where = f"{Path(theirs[-1].filename).name}:{theirs[-1].lineno}: " if theirs else ""
    why = " ".join(str(error).split())
    return f"{robot}: tick {tick}: {where}{type(error).__name__}: {why}"
