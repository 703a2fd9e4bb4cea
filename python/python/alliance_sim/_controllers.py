"""Base classes of controllers: `Allocator` selects a behavior set, `Agent` replaces the complete controller."""

from __future__ import annotations

import copy
import json
import math
import pickle
import random
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

from ._engine import Message, Set, Stream
from ._plain import shown

#: Maximum length of a controller's own message, bytes.
MESSAGE_MAX = 1200

#: Attributes that a checkpoint shares with its controller.
SHARED = {"name", "rank", "team", "tasks", "sets", "setup", "rng"}


class Rng(random.Random):
    """Random numbers of a robot, derived from the run's seed, with all methods of `random.Random`.

    Every step restarts them from seed, robot and tick: a repeated step draws the same numbers, and robots do not affect each other.
    A step has at most 2048 numbers of 64 bits. `random.Random(rng.getrandbits(64))` has any number of them.
    """

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        super().__init__()

    def seed(self, *_: Any, **__: Any) -> None:
        """Has no effect: the seed is the run's."""

    def random(self) -> float:
        """Returns a number from 0 to below 1."""
        return (self._stream.next_u64() >> 11) * 2.0**-53

    def getrandbits(self, k: int, /) -> int:
        """Returns an integer of `k` random bits."""
        if k < 0:
            raise ValueError(f"getrandbits: the number of bits is {k}; it must be at least 0")
        words = -(-k // 64)
        number = 0
        for _ in range(words):
            number = number << 64 | self._stream.next_u64()
        return number >> (64 * words - k)

    def setstate(self, *_: Any) -> None:
        """Raises an error: seed, robot and tick determine the numbers."""
        raise NotImplementedError("setstate: the numbers of a step follow from seed, robot and tick; create a random.Random instead")

    def gauss(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        """Returns the same as `normalvariate`, which keeps no value for the next call."""
        return self.normalvariate(mu, sigma)


class Controller:
    """Common base of `Allocator` and `Agent`. Derive from one of these two.

    The same inputs must give the same step on every machine: use no clock, no `random` except `self.rng`, and no order of a set.

    Attributes of an object:

    - `name`: name of the robot. `rank`: its rank in the team, from 0.
    - `team`: names of all robots, by rank. `tasks`: names of all tasks, by id. `sets`: names of the robot's behavior sets.
    - `setup`: setup of the run, as in run.json: `seed`, `scenario`, `alliance`. It is read-only.
    - `rng`: random numbers of the robot.
    - `values`: value of each parameter in this run.
    - `speed`: top speed of the robot, m/s. `skills`: its level of each skill, 1 is normal; empty if the scenario states no skills.

    Attributes of a class:

    - `frozen`: attributes that checkpoints share instead of copying, such as a large net that does not change.
    - `collected`: variables of the class, of a module or of an enclosing function that steps change and never read, such as a list for a
      plot. In one process, a change of any other such variable is an error, because robots in processes do not share it.
    - `parameters`: parameters that a scenario or a plan can set as `allocators.NAME.KEY`: default, least and greatest value by key.
    """

    name: str
    rank: int
    team: tuple[str, ...]
    tasks: tuple[str, ...]
    sets: tuple[str, ...]
    setup: Mapping[str, Any]
    rng: Rng
    frozen: ClassVar[frozenset[str] | set[str]] = frozenset()
    collected: ClassVar[frozenset[str] | set[str]] = frozenset()
    parameters: ClassVar[Mapping[str, tuple[float, float, float]]] = {}
    values: Mapping[str, float]
    speed: float
    skills: Mapping[str, float]

    _is_whole: ClassVar[bool]
    _outbox: list[bytes]

    #: The method that a class defines, with the arguments of its base.
    step: Callable[..., Any]

    def reset(self) -> None:
        """Starts an incarnation, without memory. All attributes of `Controller` are set before."""

    def _send(self, message: bytes) -> None:
        if not isinstance(message, bytes):
            raise TypeError(f"send: {type(message).__name__} is not bytes")
        if len(message) > MESSAGE_MAX:
            raise ValueError(f"send: {len(message)} bytes; at most {MESSAGE_MAX} can be sent")
        sets = len(self.sets)
        if len(self._outbox) > sets:
            raise ValueError(f"send: a robot with {sets} sets sends at most {sets + 1} messages in a step")
        self._outbox.append(message)

    def _begin(
        self,
        name: str,
        rank: int,
        setup: Mapping[str, Any],
        stream: Stream,
        sets: Sequence[str],
        own_name: str,
        team: tuple[str, ...],
        tasks: tuple[str, ...],
    ) -> None:
        self.name, self.rank, self.setup, self.rng, self.sets = name, rank, setup, Rng(stream), tuple(sets)
        self.team, self.tasks = team, tasks
        scenario = setup["scenario"]
        robot = scenario["robots"][rank]
        self.speed = robot.get("speed_m_s", scenario["body"]["speed_m_s"])
        self.skills = robot.get("skills") or {}
        stated = scenario.get("allocators", {}).get(own_name, {})
        self.values = {key: stated.get(key, default) for key, (default, _, _) in type(self).parameters.items()}
        self._outbox = []
        self.reset()

    def __deepcopy__(self, memo: dict[int, Any]) -> Controller:
        shared = SHARED | self.frozen
        twin = type(self).__new__(type(self))
        memo[id(self)] = twin
        for key, value in self.__dict__.items():
            twin.__dict__[key] = value if key in shared else copy.deepcopy(value, memo)
        return twin


class Allocator(Controller):
    """Selects the active behavior set of a robot. The mission's own controller in Rust does everything else.

    The package sends heartbeats with the robot's task, so robots with other allocators can use them.

    Attributes besides those of `Controller`, with the values of the current step:

    - `position`: position of the robot by its own estimate, (x, y), m. `heading`: its heading, rad, counter-clockwise from x. Both are
      `None` while the position sensor is dead.
    - `energy`: remaining energy, J; `None` without a simulation of energy.
    - `laden`: true if the robot carries an object of its task.
    """

    position: tuple[float, float] | None
    heading: float | None
    energy: float | None
    laden: bool

    _is_whole = False
    _bids: dict[int, float]

    def step(self, now: float, messages: Sequence[Message], sets: Sequence[Set]) -> Set | None:
        """Returns the applicable set that is active from now on, or `None` to be idle.

        `now`: simulated time, s. `messages`: heartbeats of teammates, and messages that teammates of the same class sent with `send`, ordered
        by sender and number. `sets`: the robot's behavior sets, always in the same order.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")

    def send(self, words: bytes) -> None:
        """Sends up to 1200 bytes to the teammates of the same class, with this step. They receive them as `Message.content`."""
        self._send(words)

    def bid(self, set: Set, value: float) -> None:
        """Records the value of a set in this step in allocation.csv. The page and the report show it."""
        value = float(value)
        if value - value != 0.0:
            raise ValueError(f"bid: {value} is not a finite number")
        self._bids[set.id] = value

    def _begin(self, *given: Any) -> None:
        self._bids, self.position, self.heading, self.energy, self.laden = {}, None, None, None, False
        super()._begin(*given)


#: Hit of a beam: free distance, m, and direction of the surface there, rad. `None`: the beam is free.
Beam = tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Readings:
    """Sensor readings of a robot in a step. A device is `None` if the robot lacks it or it is dead.

    Lengths are in m, angles in rad counter-clockwise from x. In the robot's frame, x is ahead and y is to the left.

    - `position`: (x, y), m. `heading`: rad.
    - `front_border`, `side_border`: distance from the robot's edge to the border, ahead and to the left, m; infinite beyond the sensor's
      range.
    - `ahead`, `left`, `right`: solids ahead and on both sides, with three beams each. Ahead: left, center, right. Sides: front, center,
      rear. A beam is the free distance, m, and the direction of the surface there, rad; `None` if it is free.
    - `ground`: penetrability of the ground under the center and ahead; 1 is neutral.
    - `energy`: remaining energy, J; `None` without a simulation of energy.
    - `mission`: readings of the mission's own devices by name, as on the bus. observe: `targets`. waste: `items`, `zone`, `at_site`,
      `holding`. push: `bar`, `touch`. service: `points`, `board_line`, `effect`. Other missions: `bytes`.
    """

    position: tuple[float, float] | None
    heading: float | None
    front_border: float | None
    side_border: float | None
    ahead: tuple[Beam, Beam, Beam] | None
    left: tuple[Beam, Beam, Beam] | None
    right: tuple[Beam, Beam, Beam] | None
    ground: tuple[float, float] | None
    energy: float | None
    mission: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Action:
    """Action of a robot in a step. It turns first, then moves straight ahead, both within its limits. It cannot reverse.

    - `speed`: forward speed, m/s. `turn`: turn rate, counter-clockwise, rad/s.
    - `gripper`: for waste `"keep"`, `"pick"` or `"drop"`. `report`: a report, if the robot is at a report site.
    - `work`, `read`: for service the number of the point to work on, and the last line read from the board.
    - `watch`: for observe, observes the targets in range, if the device works.
    - `send`: messages of up to 1200 bytes to the teammates of the same class, received as `Message.content`; at most one more than the
      number of sets.
    - `doing`: name of the active behavior set, one of `Agent.sets`, for heartbeats, log and page. `None`: idle.
    - `progress`: the robot has just had an effect on the world with that set. Heartbeats contain the number of effects.
    """

    speed: float = 0.0
    turn: float = 0.0
    gripper: str = "keep"
    report: bool = False
    work: int | None = None
    read: int | None = None
    watch: bool = True
    send: Sequence[bytes] = ()
    doing: str | None = None
    progress: bool = False

    def __post_init__(self) -> None:
        for name in ("speed", "turn"):
            value = getattr(self, name)
            try:
                value = float(value)
            except (TypeError, ValueError):
                raise TypeError(f"Action: {name} is {shown(value)}, which is not a finite number") from None
            if value - value != 0.0:
                raise ValueError(f"Action: {name} is {value}, which is not a finite number")


class Agent(Controller):
    """Complete controller of a robot. It replaces the mission's own controller in Rust.

    The package sends heartbeats with position and activity, so other robots can use them. It neither repeats nor extends the shared
    knowledge of the mission.
    """

    _is_whole = True

    def step(self, now: float, readings: Readings, messages: Sequence[Message]) -> Action:
        """Returns the action of the robot.

        `now`: simulated time, s. `readings`: sensor readings. `messages`: heartbeats of teammates, and messages that teammates of the same
        class sent with `send`, ordered by sender and number.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")

    def _send_all(self, send: Sequence[bytes]) -> None:
        for message in send:
            self._send(message)


def parameters_of(controller: type[Controller]) -> dict[str, tuple[float, float, float]]:
    """Returns the parameters of a class. Raises a `TypeError` for a declaration with another form, also of `frozen` or `collected`."""
    for attribute in ("frozen", "collected"):
        names_of(controller, attribute)
    checked = {}
    for key, declared in controller.parameters.items():
        try:
            default, least, greatest = map(float, declared)
        except (TypeError, ValueError):
            raise TypeError(f"{controller.__name__}.parameters: {key} is {shown(declared)}; write (default, least, greatest)") from None
        if not (math.isfinite(least) and math.isfinite(greatest) and least <= default <= greatest):
            raise TypeError(f"{controller.__name__}.parameters: {key}: {default} is not between {least} and {greatest}")
        checked[key] = (default, least, greatest)
    return checked


def names_of(controller: type[Controller], attribute: str) -> frozenset[str]:
    """Returns `frozen` or `collected` of a class. Raises a `TypeError` for anything but a set of names."""
    names = getattr(controller, attribute)
    if not isinstance(names, set | frozenset) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"{controller.__name__}.{attribute} is {shown(names)}; write a set of names, such as {{'seen'}}")
    return frozenset(names)


def readings(text: str) -> Readings:
    """Builds `Readings` from the engine's JSON."""
    values = json.loads(text)
    for border in ("front_border", "side_border"):
        if values[border] is False:
            values[border] = math.inf
    for side in ("ahead", "left", "right"):
        if values[side] is not None:
            values[side] = tuple(beam and tuple(beam) for beam in values[side])
    for pair in ("position", "ground"):
        values[pair] = values[pair] and tuple(values[pair])
    return Readings(**values)


def step_twice(controller: Controller, given: tuple[Any, ...]) -> Any:
    """Runs a step also on a copy. Raises a `ValueError` that names the first field with a different value."""
    twin = copy.deepcopy(controller)
    stream = controller.rng._stream
    first = controller.step(*given)
    stream.begin_again()
    second = twin.step(*given)
    stream.begin_again()
    pairs = [("step", first, second)]
    if isinstance(first, Action) and isinstance(second, Action):
        pairs = [(f"Action.{field.name}", getattr(first, field.name), getattr(second, field.name)) for field in fields(Action)]
    attributes, copied = vars(controller), vars(twin)
    skipped = SHARED | controller.frozen
    pairs += [(f"self.{name}", attributes.get(name), copied.get(name)) for name in sorted(attributes.keys() | copied.keys()) if name not in skipped]
    for field, one, another in pairs:
        if not is_same(one, another):
            raise ValueError(f"a step made twice differs: {field} is {_shown(one)} and {_shown(another)}; the step depends on more than its inputs")
    return first


def is_same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    try:
        same = one == other
        if same is True:
            # The order of a dict may matter. The order of a set is ignored.
            return list(one) == list(other) if isinstance(one, dict) else True
        if isinstance(same, bool) and one == one:
            return False
    except Exception:  # A foreign class may raise any error in a comparison.
        pass
    return pickle.dumps(one) == pickle.dumps(other)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def line_of(robot: str, tick: int, error: BaseException) -> str:
    """Returns one line with robot, tick, position and error of a failed controller."""
    frames = traceback.extract_tb(error.__traceback__)
    package = Path(__file__).parent
    # The position in the author's code, not in this package.
    frames_of_author = [frame for frame in frames if Path(frame.filename).parent != package and frame.filename != "<string>"]
    where = f"{Path(frames_of_author[-1].filename).name}:{frames_of_author[-1].lineno}: " if frames_of_author else ""
    try:
        why = " ".join(str(error).split())
    except Exception:  # The class of the error is foreign code.
        why = "the text of the error cannot be created"
    # Control characters would change the terminal.
    why = "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in why)
    return f"{robot}: tick {tick}: {where}{type(error).__name__}: {why}"
