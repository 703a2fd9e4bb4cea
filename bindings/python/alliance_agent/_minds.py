"""What minds in Python are derived from: an allocator alone, or all of it."""

from __future__ import annotations

import copy
import json
import math
import pickle
import random
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

from ._engine import Heard, Set, Stream

#: The longest message of a mind's own, bytes.
SAY_MAX = 1200

#: What a checkpoint shares with its mind.
SHARED = {"name", "rank", "sets", "setup", "rng"}


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


class Mind:
    """What `Allocator` and `Agent` have in common. One of these two is what a mind is derived from.

    The same inputs must give the same step, on every machine: no clock, no `random` but `self.rng`, no order of a set.
    """

    #: Name of the robot.
    name: str
    #: Its place in the team, from 0.
    rank: int
    #: Names of its behavior sets.
    sets: tuple[str, ...]
    #: The run as the team knows it, as in run.json: `seed`, `scenario`, `alliance`. Shared by all robots; not to be changed.
    setup: Mapping[str, Any]
    #: Random numbers.
    rng: Rng
    #: Attributes that are shared by checkpoints and not copied into them, such as a large net that does not change.
    frozen: ClassVar[frozenset[str] | set[str]] = frozenset()

    _is_whole: ClassVar[bool]
    _said: list[bytes]

    def reset(self) -> None:
        """A new life begins: without memory. `name`, `rank`, `sets`, `setup` are known."""

    def _say(self, words: bytes) -> None:
        if not isinstance(words, bytes):
            raise TypeError(f"say: {type(words).__name__} is not bytes")
        if len(words) > SAY_MAX:
            raise ValueError(f"say: {len(words)} bytes; at most {SAY_MAX} can be sent")
        own = len(self.sets)
        if len(self._said) > own:
            raise ValueError(f"say: a robot with {own} sets sends at most {own + 1} messages in a step")
        self._said.append(words)

    def _begin(self, name: str, rank: int, setup: Mapping[str, Any], stream: Stream, sets: Sequence[str]) -> None:
        self.name, self.rank, self.setup, self.rng, self.sets = name, rank, setup, Rng(stream), tuple(sets)
        self._said = []
        self.reset()

    def __deepcopy__(self, memo: dict[int, Any]) -> Mind:
        shared = SHARED | self.frozen
        twin = type(self).__new__(type(self))
        memo[id(self)] = twin
        for key, value in self.__dict__.items():
            twin.__dict__[key] = value if key in shared else copy.deepcopy(value, memo)
        return twin


class Allocator(Mind):
    """Decides which behavior set of a robot is active; the rest of the robot is the mission's own, in Rust.

    Heartbeats that say what the robot works on are made for it, so robots with other allocators understand it.
    """

    _is_whole = False
    _bids: dict[int, float]

    def step(self, now: float, heard: Sequence[Heard], sets: Sequence[Set]) -> Set | None:
        """Returns which of its applicable sets is active from now on; `None`: it is idle.

        `now`: simulated time, s. `heard`: heartbeats of teammates, and what teammates of the same class `say`, by sender and
        number. `sets`: the robot's behavior sets, always in the same order.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")

    def say(self, words: bytes) -> None:
        """Sends up to 1200 bytes to the teammates of the same class, with this step; they hear it as `Heard.said`."""
        self._say(words)

    def bid(self, set: Set, value: float) -> None:
        """Shows in allocation.csv, and so on page and report, what the set is worth to it in this step."""
        value = float(value)
        if value - value != 0.0:
            raise ValueError(f"bid: {value} is no number")
        self._bids[set.id] = value

    def _begin(self, *given: Any) -> None:
        self._bids = {}
        super()._begin(*given)


#: A solid in the way of a beam: how far its free way is, m, and the direction of the solid's surface there, rad; `None`: it is free.
Beam = tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Readings:
    """What a robot senses in a step. Each device is `None` when the robot lacks it or it is dead.

    Lengths in m, angles in rad counter-clockwise from x; in the robot's own frame x is ahead and y to the left.
    """

    position: tuple[float, float] | None
    heading: float | None
    #: Distance from the robot's edge to the border straight ahead and to the left; infinite beyond the sensor's range.
    front_border: float | None
    side_border: float | None
    #: What is solid ahead and beside the robot, by three beams each: ahead left, center, right; on the sides front, center, rear.
    ahead: tuple[Beam, Beam, Beam] | None
    left: tuple[Beam, Beam, Beam] | None
    right: tuple[Beam, Beam, Beam] | None
    #: Penetrability under the center, and ahead; 1 is neutral.
    ground: tuple[float, float] | None
    #: Energy left, J; `None` where energy is not simulated.
    energy: float | None
    #: What the mission's own devices tell, by name, as on the bus: of observe `targets`, of waste `items`, `zone`, `at_site` and
    #: `holding`, of push `bar` and `touch`, of service `points`, `told` and `effect`; of any other mission its `bytes`.
    mission: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Deed:
    """What a robot does in a step. It turns first and then moves straight ahead, both within its limits; it does not reverse."""

    #: Forward, m/s.
    speed: float = 0.0
    #: Counter-clockwise, rad/s.
    turn: float = 0.0
    #: Of waste: `"keep"`, `"pick"` or `"drop"`; and whether it reports, at a place for that.
    gripper: str = "keep"
    report: bool = False
    #: Of service: the number of a point that it works on, and up to where it has read the board.
    work: int | None = None
    read: int | None = None
    #: Of observe: whether it looks, with a device that works: what is in range then is observed.
    watch: bool = True
    #: Up to 1200 bytes each for the teammates of the same class, who hear them as `Heard.said`; at most one more than it has sets.
    say: Sequence[bytes] = ()
    #: Name of the behavior set that it carries out, one of `Agent.sets`: heartbeats, log and page tell of it. `None`: it is idle.
    doing: str | None = None
    #: Whether it has just had an effect on the world with that: heartbeats count these.
    progress: bool = False

    def __post_init__(self) -> None:
        for name in ("speed", "turn"):
            value = getattr(self, name)
            try:
                value = float(value)
            except (TypeError, ValueError):
                raise TypeError(f"Deed: {name} is {value!r}, which is no number") from None
            if value - value != 0.0:
                raise ValueError(f"Deed: {name} is {value}, which is no number")


class Agent(Mind):
    """A whole mind: all that the robot does is decided by it. Nothing of the mission's own mind in Rust is left.

    Heartbeats that say where it is and what it is doing are made for it, so robots of any kind understand it; what other robots tell
    of the mission's matters it neither repeats nor adds to.
    """

    _is_whole = True

    def step(self, now: float, readings: Readings, heard: Sequence[Heard]) -> Deed:
        """Returns what the robot does.

        `now`: simulated time, s. `readings`: what it senses. `heard`: heartbeats of teammates, and what teammates of the same class
        `say`, by sender and number.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")

    def _speak(self, say: Sequence[bytes]) -> None:
        for words in say:
            self._say(words)


def readings(text: str) -> Readings:
    """From the engine's words."""
    told = json.loads(text)
    for border in ("front_border", "side_border"):
        if told[border] is False:
            told[border] = math.inf
    for side in ("ahead", "left", "right"):
        if told[side] is not None:
            told[side] = tuple(beam and tuple(beam) for beam in told[side])
    for pair in ("position", "ground"):
        told[pair] = told[pair] and tuple(told[pair])
    return Readings(**told)


def step_twice(mind: Mind, given: tuple[Any, ...]) -> Any:
    """Makes the step from a copy as well, and raises a `ValueError` that names the first field in which the two differ."""
    twin = copy.deepcopy(mind)
    stream = mind.rng._stream
    first = mind.step(*given)
    stream.begin_again()
    second = twin.step(*given)
    stream.begin_again()
    pairs = [("step", first, second)]
    if isinstance(first, Deed) and isinstance(second, Deed):
        pairs = [(f"Deed.{field.name}", getattr(first, field.name), getattr(second, field.name)) for field in fields(Deed)]
    own, other = vars(mind), vars(twin)
    skipped = SHARED | mind.frozen
    pairs += [(f"self.{name}", own.get(name), other.get(name)) for name in sorted(own.keys() | other.keys()) if name not in skipped]
    for field, one, another in pairs:
        if not _is_same(one, another):
            raise ValueError(f"a step made twice differs: {field} is {_shown(one)} and {_shown(another)}; what else than its inputs decides?")
    return first


def _is_same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    try:
        same = one == other
        if same is True:
            # Of a dict the order may tell, too; a set whose order does not matter may have any.
            return list(one) == list(other) if isinstance(one, dict) else True
        if isinstance(same, bool) and one == one:
            return False
    except Exception:  # Whatever a class of somebody else makes of a comparison.
        pass
    return pickle.dumps(one) == pickle.dumps(other)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def line_of(robot: str, tick: int, error: BaseException) -> str:
    """Whose mind failed, when, where and why."""
    frames = traceback.extract_tb(error.__traceback__)
    own = Path(__file__)
    # Where its author has written something, not where this package refuses it.
    theirs = [frame for frame in frames if Path(frame.filename) != own and frame.filename != "<string>"]
    where = f"{Path(theirs[-1].filename).name}:{theirs[-1].lineno}: " if theirs else ""
    why = " ".join(str(error).split())
    return f"{robot}: tick {tick}: {where}{type(error).__name__}: {why}"
