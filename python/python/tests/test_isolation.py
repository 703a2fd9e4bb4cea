"""Robots in one process share no memory, as robots in processes do."""

import collections
import copy
import enum
import functools
import json
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import state
from alliance_sim import Action, Agent, Allocator, ControllerError, ScenarioError, run
from greedy import Greedy

TOTAL = 0
BOARD: dict[str, float] = {}
SETS = {}
LARGE = list(range(5000))


@pytest.fixture(autouse=True)
def first_values():
    """Sets the variables of modules to their first values, because a run refuses those that an earlier one has left."""
    yield
    BOARD.clear()
    SETS.clear()
    state.NOTES.clear()
    vars(state).pop("latest", None)
    vars(free).clear()
    LARGE[0] = 0
    Helper.count = 0


def nearest(sets):
    return min((option for option in sets if option.applicable), key=lambda option: (option.cost, option.id), default=None)


class ClassDict(Allocator):
    taken: dict[int, int] = {}

    def step(self, now, messages, sets):
        chosen = next((option for option in sets if option.applicable and self.taken.get(option.task, self.rank) == self.rank), None)
        if chosen:
            self.taken[chosen.task] = self.rank
        return chosen


class NewAttribute(Allocator):
    def step(self, now, messages, sets):
        type(self).last = self.name


class Counter(Allocator):
    def step(self, now, messages, sets):
        global TOTAL
        TOTAL += 1


class Blackboard(Allocator):
    def step(self, now, messages, sets):
        write(self.name, now)


def write(name, now):
    BOARD[name] = now


class OtherModule(Allocator):
    def step(self, now, messages, sets):
        state.NOTES.append(self.name)


class Default(Allocator):
    def step(self, now, messages, sets, cache={}):
        cache[self.name] = now


class HelperClass(Allocator):
    class Memory:
        seen = 0

    def step(self, now, messages, sets):
        self.Memory.seen += 1


class Large(Allocator):
    def step(self, now, messages, sets):
        LARGE[0] = LARGE[0] + 1


class Unpicklable(Allocator):
    def step(self, now, messages, sets):
        SETS[self.name] = sets[0]


def remembered(function):
    memory = {}

    @functools.wraps(function)
    def wrapper(self, now, messages, sets):
        memory[self.name] = now
        return function(self, now, messages, sets)

    return wrapper


class Wrapper(Allocator):
    @remembered
    def step(self, now, messages, sets):
        return None


class Wrapped(Allocator):
    @functools.lru_cache(maxsize=0)
    def step(self, now, messages, sets):
        BOARD[self.name] = now


class LocalImport(Allocator):
    def step(self, now, messages, sets):
        import state

        state.NOTES.append(self.name)


class LateImport(Allocator):
    def step(self, now, messages, sets):
        from late import NOTES

        NOTES.append(self.name)


class AtStart(Allocator):
    born: list[str] = []

    def reset(self):
        self.born.append(self.name)


class Defaults(Allocator):
    claims = collections.defaultdict(lambda: None)

    def step(self, now, messages, sets):
        free = [option for option in sets if option.applicable and self.claims[option.task] in (None, self.rank)]
        chosen = nearest(free)
        if chosen:
            self.claims[chosen.task] = self.rank
        return chosen


class Waiting(Allocator):
    line: queue.Queue[str] = queue.Queue()

    def step(self, now, messages, sets):
        self.line.put(self.name)


class FunctionAttribute(Allocator):
    def step(self, now, messages, sets):
        chosen_by.count += 1


class NewFunctionAttribute(Allocator):
    def step(self, now, messages, sets):
        free.latest = self.name


def chosen_by():
    pass


def free():
    pass


chosen_by.count = 0


class Meta(type):
    seen: list[str] = []


class Metaclass(Allocator, metaclass=Meta):
    def step(self, now, messages, sets):
        type(type(self)).seen.append(self.name)


HANDLERS = {"write": [write]}


class Table(Allocator):
    def step(self, now, messages, sets):
        HANDLERS["write"][0](self.name, now)


WRITE_BLUE = functools.partial(write, "blue")


class Partial(Allocator):
    def step(self, now, messages, sets):
        WRITE_BLUE(now)


class Helper:
    count = 0


HELPERS = [Helper()]


class ClassOfElement(Allocator):
    def step(self, now, messages, sets):
        for helper in HELPERS:
            type(helper).count += 1


class Board:
    def __init__(self):
        self.names = []

    def put(self, name):
        self.names.append(name)


PUT = Board().put


class Bound(Allocator):
    def step(self, now, messages, sets):
        PUT(self.name)


class ModuleAttribute(Allocator):
    def step(self, now, messages, sets):
        state.latest = self.name


class Whole(Agent):
    log: list[str] = []

    def step(self, now, readings, messages):
        self.log.append(self.name)
        return Action()


@pytest.mark.parametrize(
    ("controller", "name"),
    [
        (ClassDict, "ClassDict.taken"),
        (NewAttribute, "NewAttribute.last"),
        (Counter, "test_isolation.TOTAL"),
        (Blackboard, "test_isolation.BOARD"),
        (OtherModule, "state.NOTES"),
        (Default, "Default.step.cache"),
        (HelperClass, "Memory.seen"),
        (Large, "test_isolation.LARGE"),
        (Unpicklable, "test_isolation.SETS"),
        (Wrapper, "Wrapper.step.memory"),
        (Wrapped, "test_isolation.BOARD"),
        (LocalImport, "state.NOTES"),
        (LateImport, "late.NOTES"),
        (AtStart, "AtStart.born"),
        (Defaults, "Defaults.claims"),
        (Waiting, "Waiting.line"),
        (FunctionAttribute, "chosen_by.count"),
        (NewFunctionAttribute, "free.latest"),
        (Table, "test_isolation.BOARD"),
        (Partial, "test_isolation.BOARD"),
        (ClassOfElement, "Helper.count"),
        (Bound, "test_isolation.PUT"),
        (ModuleAttribute, "state.latest"),
        (Metaclass, "Meta.seen"),
        (Whole, "Whole.log"),
    ],
)
def test_a_shared_variable_is_refused_by_name(controller, name):
    with pytest.raises(ControllerError) as error:
        run("janitorial", {"*": controller}, limit=2)
    line = str(error.value)
    verb = "added" if name in ("NewAttribute.last", "free.latest", "state.latest") else "changed"
    assert line.startswith(("blue: tick ", "gold: tick ", "green: tick ")) and f": RuntimeError: {name} was {verb}, " in line.replace("<locals>.", "")
    assert "robots in processes do not" in line


@pytest.mark.parametrize("attribute", ["collected", "frozen"])
def test_names_in_another_form_than_a_set_are_refused(attribute):
    for names in ("seen", 3, {1}):
        with pytest.raises(TypeError, match=rf"^Named\.{attribute} is .*; write a set of names, such as"):
            run("janitorial", {"*": type("Named", (Greedy,), {attribute: names})}, limit=1)


class Mode(enum.Flag):
    SEARCH = enum.auto()
    CARRY = enum.auto()


def test_combined_flags_are_no_error():
    class Flags(Allocator):
        def step(self, now, messages, sets):
            assert Mode.SEARCH | Mode.CARRY
            return nearest(sets)

    assert run("janitorial", {"*": Flags}, limit=1).outcome == "time-limit"


def test_packages_of_the_user_are_not_searched(tmp_path):
    """A package below PYTHONUSERBASE stores a value when it is first used, as numpy does."""
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    folder = tmp_path / "lib" / name / "site-packages"
    folder.mkdir(parents=True)
    (folder / "cached.py").write_text("CACHE = {}\ndef root(value):\n    return CACHE.setdefault(value, value**0.5)\n")
    lines = (
        "import site, sys; sys.path.append(site.getusersitepackages())\n"
        "import cached\nfrom alliance_sim import Allocator, run\n"
        "class Uses(Allocator):\n    def step(self, now, messages, sets): cached.root(2.0)\n"
        "print(run('janitorial', {'*': Uses}, limit=1).outcome)"
    )
    done = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, env={**os.environ, "PYTHONUSERBASE": str(tmp_path)})
    assert done.stdout == "time-limit\n", done.stderr


def test_a_variable_of_an_enclosing_function_is_refused_unless_it_is_collected():
    seen = []

    class Watcher(Allocator):
        def step(self, now, messages, sets):
            seen.append(self.name)

    with pytest.raises(ControllerError, match=r"Watcher.step.seen was changed"):
        run("janitorial", {"*": Watcher}, limit=1)
    seen.clear()
    run("janitorial", {"*": type("Collector", (Watcher,), {"collected": {"seen"}})}, limit=1)
    assert len(seen) == 60


def test_values_of_a_refused_run_are_no_start_of_a_later_one():
    class Once(Allocator):
        first = True
        fails = False

        def step(self, now, messages, sets):
            if self.first:
                type(self).first = False
            assert not self.fails
            return nearest(sets)

    def refused():
        with pytest.raises(ControllerError) as error:
            run("janitorial", {"*": Once}, limit=1)
        return str(error.value)

    assert "Once.first was changed, which" in refused()
    for _ in range(2):
        assert "Once.first was changed by an earlier run of this process: set it to its first value, or start Python again" in refused()
    # Another value is the author's.
    Once.first = True
    assert "Once.first was changed, which" in refused()
    Once.first = 0
    run("janitorial", {"*": Once}, limit=1)
    # A step that fails for another reason leaves its changes, too.
    Once.first, Once.fails = True, True
    assert "AssertionError" in refused()
    Once.fails = False
    assert "Once.first was changed by an earlier run" in refused()


def test_a_large_value_is_compared_at_the_end_of_the_run():
    class Late(Allocator):
        table = list(range(5000))

        def step(self, now, messages, sets):
            if self.name == "blue" and now == 4.9:
                self.table[0] += 1

    with pytest.raises(ControllerError, match=r"^end of the run: RuntimeError: Late.table was changed, "):
        run("janitorial", {"*": Late}, limit=5)


def test_variables_that_do_not_change_are_no_error():
    class Reader(Allocator):
        table = {"a": [1.0, 2.0]}

        def step(self, now, messages, sets):
            assert self.table["a"][1] == 2.0 and len(BOARD) < 10 and LARGE[1] == 1
            return nearest(sets)

    assert run("janitorial", {"*": Reader}, limit=20).outcome == "time-limit"


class Node:
    def __init__(self):
        self.near, self.weigh = [], lambda value: value


def test_values_that_cannot_be_pickled_cause_no_error():
    nodes = [Node() for _ in range(12)]
    for node in nodes:
        node.near = nodes
    chain = None
    for _ in range(100):
        node = Node()
        node.near, chain = chain, node
    draws = np.random.default_rng(1)

    class Reader(Allocator):
        weights = {"w": [np.ones(3)], "act": lambda value: value, "draws": draws, "lock": threading.Lock(), "big": 10**5000}
        table = {**dict.fromkeys(range(20_000), 1.0), "act": lambda value: value}
        road = nodes
        line = chain

        def step(self, now, messages, sets):
            assert self.weights["w"][0][0] == 1.0 and self.table[5] and self.road and self.line
            return nearest(sets)

    assert run("janitorial", {"*": Reader}, limit=20).outcome == "time-limit"


def test_all_variables_that_a_refused_run_has_left_are_refused():
    class Both(Allocator):
        a = b = 0

        def step(self, now, messages, sets):
            type(self).a = 1
            type(self).b = self.b + 1

    def refused():
        with pytest.raises(ControllerError) as error:
            run("janitorial", {"*": Both}, limit=1)
        return str(error.value)

    assert "Both.a was changed, which" in refused()
    Both.a = 0
    assert "Both.b was changed by an earlier run" in refused()


def test_variables_of_the_same_name_are_compared_apart():
    base = type("Twin", (Allocator,), {"taken": [], "step": lambda self, now, messages, sets: base.taken.append(self.name)})
    derived = type("Twin", (base,), {"taken": ()})
    with pytest.raises(ControllerError, match=r"Twin\.taken was changed, which"):
        run("janitorial", {"*": derived}, limit=1)


def test_a_new_attribute_can_be_collected_or_removed():
    class Fresh(Allocator):
        def step(self, now, messages, sets):
            free.noted = self.name

    def refused():
        with pytest.raises(ControllerError) as error:
            run("janitorial", {"*": Fresh}, limit=1)
        return str(error.value)

    assert "free.noted was added, which" in refused()
    assert "free.noted was added by an earlier run of this process: delete it, or start Python again" in refused()
    del free.noted
    assert "free.noted was added, which" in refused()
    Fresh.collected = {"noted"}
    run("janitorial", {"*": Fresh}, limit=1)
    del free.noted


def test_the_setup_is_read_only():
    class Writer(Allocator):
        def step(self, now, messages, sets):
            self.setup["scenario"]["robots"].append("me")

    with pytest.raises(ControllerError, match="self.setup is read-only"):
        run("janitorial", {"*": Writer}, limit=1)

    class Copier(Allocator):
        def reset(self):
            own = copy.deepcopy(self.setup["scenario"])
            own["robots"].append("me")
            own["x"] = 1
            assert type(own) is dict and json.loads(json.dumps(self.setup)) == self.setup
            assert isinstance(self.setup["scenario"], dict) and isinstance(self.setup["scenario"]["robots"], list)

        def step(self, now, messages, sets):
            with pytest.raises(TypeError):
                sets[0].values["x"] = 1

    run("janitorial", {"*": Copier}, limit=1)


def test_messages_and_sets_can_be_kept():
    class Keeper(Allocator):
        def reset(self):
            self.last, self.chosen = {}, None

        def step(self, now, messages, sets):
            for message in messages:
                self.last[message.sender] = message
                assert pickle.loads(pickle.dumps(message)) == message and pickle.loads(pickle.dumps(message)).size == message.size
            assert pickle.loads(pickle.dumps(sets)) == sets
            self.chosen = nearest(sets)
            return self.chosen

    plain = run("service", {"*": Keeper}, robots=3, limit=20)
    assert run("service", {"*": Keeper}, robots=3, limit=20, twice=True).hash == plain.hash


def test_an_allocator_knows_its_body():
    known = {}

    class Curious(Allocator):
        collected = {"known"}

        def step(self, now, messages, sets):
            known.setdefault(self.name, []).append((self.position, self.speed, self.laden, dict(self.skills)))
            return nearest(sets)

    run("janitorial", {"*": "nearest", "gold": Curious}, limit=5)
    speed = run("janitorial", limit=1).file["scenario"]["body"]["speed_m_s"]
    first, last = known["gold"][0], known["gold"][-1]
    assert first[1:] == (speed, False, {"dust": 0.5, "garbage": 1.0})
    assert type(first[0]) is tuple and len(first[0]) == 2
    assert first[0] != last[0], "the position does not follow the robot"


def test_ctrl_c_and_exit_pass():
    class Endless(Allocator):
        def step(self, now, messages, sets):
            time.sleep(0.05)

    # A shell starts background jobs with the signal ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        run("janitorial", {"*": Endless}, limit=300)
    timer.join()

    class Leaver(Allocator):
        def step(self, now, messages, sets):
            raise SystemExit(7)

    with pytest.raises(SystemExit) as left:
        run("janitorial", {"*": Leaver}, limit=5)
    assert left.value.code == 7


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"seed": -1}, "seed: -1 is out of range; it must be at least 0"),
        ({"seed": "7"}, "seed: '7' is not a whole number"),
        ({"seed": 2**64}, "seed: 18446744073709551616 is out of range"),
        ({"robots": 0}, "robots: 0 is out of range; it must be at least 1"),
        ({"robots": 10**9}, "robots: invalid value '1000000000'; use a whole number from 1 to 10000"),
        ({"scenario": b"service"}, "scenario: b'service' is neither a name, nor a file, nor a dict"),
        ({"controllers": [Greedy]}, "is not a dict; write {'*': …} for all robots"),
        ({"controllers": {1: Greedy}}, "controllers: 1 is not the name of a robot"),
    ],
)
def test_wrong_arguments_have_a_clear_message(arguments, expected):
    with pytest.raises(ScenarioError) as error:
        run(**{"scenario": "service"} | arguments)
    assert expected in str(error.value)


def test_sets_and_messages_can_be_made_for_tests():
    from alliance_sim import Message, Set

    dust = Set(0, "dust", 0, cost=5.0, ceased_after=10.0)
    floor = Set(1, "floor", 1, cost=2.0, applicable=False, active=True, since=3.0)
    greedy = Greedy()
    greedy.rank = 0
    greedy.reset()
    assert greedy.step(1.0, [], [dust, floor]) is dust
    claim = Message(1, "executing", task=0, set=0, since=0.5, position=(1.0, 2.0))
    assert (claim.state, claim.task, claim.since, claim.position) == ("executing", 0, 0.5, (1.0, 2.0))
    assert greedy.step(1.0, [claim], [dust, floor]) is None
    assert Message(2, content=b"hello").content == b"hello" and Message(2, content=b"").state == "message"
    for value in (dust, floor, claim, Message(2, content=b"hello")):
        copied = pickle.loads(pickle.dumps(value))
        assert copied == value and hash(copied) == hash(value) and repr(copied) == repr(value)
        assert copy.deepcopy(value) is value and copy.copy(value) is value
    assert dust != floor and claim != Message(1, "executing", task=0, set=0, since=0.6, position=(1.0, 2.0)) and dust != 1
    with pytest.raises(ValueError, match="state: there is no 'busy'; use one of executing, waiting, idle, released"):
        Message(1, "busy")
