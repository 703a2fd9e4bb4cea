"""Allocators in Python, in one process."""

import copy
import json
import math
import random
from pathlib import Path

import alliance_sim
import alliance_sim.math
import numpy as np
import pytest
from alliance_sim import Allocator, ControllerError, ScenarioError, run
from greedy import Greedy

TWIN = json.loads((Path(__file__).parent / "greedy.json").read_text())


@pytest.mark.parametrize("case", TWIN["hashes"])
def test_greedy_has_the_hash_of_its_rust_twin(case):
    mission, seed = case.split()
    size = {key: TWIN[key] for key in ("robots", "size")}
    done = run(mission, {"*": Greedy}, int(seed), faults=TWIN["faults"], limit=TWIN["limit_s"], **size)
    assert done.hash == TWIN["hashes"][case]
    assert all(fault["hits"] > 0 for fault in done.file["faults"])


def test_rust_controllers_have_the_hash_of_the_command(alliance, tmp_path):
    for mission in ("waste-cleanup", "service", "push", "observe"):
        words = ["run", mission, "--robots=3", "--in-process", "--seed=7", "--limit=60", f"--out={tmp_path / mission}", "--json"]
        result = json.loads(alliance(*words, status=(0, 1)).stdout)
        done = run(mission, seed=7, robots=3, limit=60)
        assert done.hash == result["hash"]
        assert done.outcome == result["outcome"]


def test_a_log_has_the_bytes_of_the_command(alliance, tmp_path):
    words = ["run", "janitorial", "--in-process", "--allocator=nearest", "--limit=30", "--log=full", f"--out={tmp_path / 'command'}"]
    alliance(*words, status=(0, 1))
    run("janitorial", {"*": "nearest"}, limit=30, log=tmp_path / "here")
    for file in (tmp_path / "here").glob("*.csv"):
        assert file.read_bytes() == (tmp_path / "command" / file.name).read_bytes(), file.name


def test_the_inputs_of_a_step_in_a_team_of_both_languages():
    seen = []

    class Watcher(Allocator):
        collected = {"seen"}

        def reset(self):
            self.lives = (self.name, self.rank, self.setup["seed"])

        def step(self, now, messages, sets):
            seen.append((now, self.lives, [message.state for message in messages]))
            mine = sets[0]
            assert mine.values["ceased_after_s"] == mine.ceased_after
            assert mine.cost > 0 and mine.max_robots >= 1 and isinstance(mine.name, str)
            assert repr(mine).startswith("<Set 0 ")
            return None

    done = run("janitorial", {"*": "nearest"} | {"gold": Watcher}, 4, limit=5)
    assert done.outcome == "time-limit" and not done.complete and done.seconds == 5
    times = [now for now, _, _ in seen]
    assert times == [tick / 20 for tick in range(100)]
    assert {lives for _, lives, _ in seen} == {("gold", 0, 4)}
    states = {state for _, _, states in seen for state in states}
    assert {"executing", "idle"} <= states, "no heartbeats of Rust robots were received"


def test_messages_reach_robots_of_the_same_class_only():
    received_by = {}

    class Talker(Allocator):
        collected = {"received_by"}

        def step(self, now, messages, sets):
            for message in messages:
                if message.content:
                    assert message.state == "message" and message.task is None
                    received_by.setdefault(self.name, set()).add((message.sender, message.content))
            if now == 0:
                self.send(self.name.encode())

    class Stranger(Talker):
        pass

    run("janitorial", {"blue": Talker, "gold": Talker, "green": Stranger}, limit=2)
    assert received_by == {"blue": {(0, b"gold")}, "gold": {(1, b"blue")}}


def test_bids_are_in_the_log(tmp_path):
    class Bidder(Allocator):
        def step(self, now, messages, sets):
            self.bid(sets[1], 0.25)
            return sets[0] if sets[0].applicable else None

    done = run("waste-cleanup", {"*": Bidder}, limit=2, log=tmp_path / "run")
    rows = alliance_sim.load(done.folder, "numpy")["allocation"]
    assert set(rows["utility"]) == {0.0, 0.25, 1.0}
    of_active = rows["utility"] == 1.0
    assert np.array_equal(rows["holder"][of_active], rows["robot"][of_active])
    assert set(rows["state"][of_active]) == {"active"}


def test_random_numbers_depend_on_seed_robot_and_step():
    def drawn(seed):
        numbers = {}

        class Draws(Allocator):
            collected = {"numbers"}

            def step(self, now, messages, sets):
                numbers[self.name, now] = (self.rng.random(), self.rng.randrange(1000), self.rng.gauss(), self.rng.choice("abc"))

        run("janitorial", {"*": Draws}, seed, limit=1)
        return numbers

    assert drawn(1) == drawn(1)
    assert len(set(drawn(1).values())) == 60
    assert not set(drawn(1).values()) & set(drawn(2).values())
    numbers = [number for number, *_ in drawn(3).values()]
    assert all(0 <= number < 1 for number in numbers) and min(numbers) < 0.1 and max(numbers) > 0.9


def test_a_restarted_robot_has_no_memory():
    lives = []

    class Forgetful(Allocator):
        collected = {"lives"}

        def reset(self):
            self.steps = 0

        def step(self, now, messages, sets):
            self.steps += 1
            if self.name == "gold" and self.steps == 1:
                lives.append(now)

    faults = [{"at_s": 1.0, "fault": {"kill": "gold"}}, {"at_s": 2.0, "fault": {"restart": "gold"}}]
    done = run("janitorial", {"*": Forgetful}, faults=faults, limit=3)
    assert lives[0] == 0 and len(lives) == 2 and 2 <= lives[1] <= 2.1
    assert done.result["robots"]["gold"]["incarnations"] == 2


class Boom(Allocator):
    def step(self, now, messages, sets):
        return 1 / 0 if now >= 1 else None


class Wrong(Allocator):
    def step(self, now, messages, sets):
        return sets[0].id


class Lame(Allocator):
    def step(self, now, messages, sets):
        return next((option for option in sets if not option.applicable), None)


class Nan(Allocator):
    def step(self, now, messages, sets):
        self.bid(sets[0], float("nan"))


class Loud(Allocator):
    def step(self, now, messages, sets):
        self.send(bytes(1201))


class Chatty(Allocator):
    def step(self, now, messages, sets):
        for _ in range(300):
            self.send(b"?")


class Unborn(Allocator):
    def reset(self):
        raise OSError("no such net")


class Drawer(Allocator):
    """Draws more numbers than a step has."""

    def step(self, now, messages, sets):
        self.rng.getrandbits(64 * 2049)


LINE = {
    name: number
    for number, line in enumerate(Path(__file__).read_text().splitlines(), 1)
    for name in ("1 / 0 if", "float(\"nan\")", "bytes(1201)", "send(b\"?\")", "no such net", "64 * 2049")
    if name in line and "LINE" not in line and "for name in" not in line
}


@pytest.mark.parametrize(
    ("controller", "expected", "cause"),
    [
        (Boom, f"gold: tick 20: test_allocator.py:{LINE['1 / 0 if']}: ZeroDivisionError: division by zero", ZeroDivisionError),
        (Wrong, "gold: tick 0: TypeError: step returned int; it must return one of its sets or None", TypeError),
        (Lame, "which is not applicable; it must return an applicable set or None", ValueError),
        (Nan, f'gold: tick 0: test_allocator.py:{LINE["float(" + chr(34) + "nan" + chr(34) + ")"]}: ValueError: bid: nan is not a finite number', ValueError),
        (Loud, f"gold: tick 0: test_allocator.py:{LINE['bytes(1201)']}: ValueError: send: 1201 bytes; at most 1200 can be sent", ValueError),
        (Chatty, "ValueError: send: a robot with", ValueError),
        (Unborn, f"gold: tick 0: test_allocator.py:{LINE['no such net']}: OSError: no such net", OSError),
        (Drawer, "RuntimeError: a step has at most 2048 random numbers", RuntimeError),
        (Allocator, "gold: tick 0: NotImplementedError: Allocator has no step", NotImplementedError),
    ],
)
def test_a_failed_allocator_is_reported_in_one_line(controller, expected, cause):
    scenario = "waste-cleanup" if controller is Lame else "janitorial"
    with pytest.raises(ControllerError) as error:
        run(scenario, {"*": controller}, limit=5)
    assert expected in str(error.value) and "\n" not in str(error.value)
    assert isinstance(error.value.__cause__, cause)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"scenario": "servise"}, "'servise' is neither a built-in scenario nor a file"),
        ({"scenario": "service", "robots": 10**6 + 1}, "robots"),
        ({"scenario": "janitorial", "controllers": {"nobody": Greedy}}, "controllers: there is no robot 'nobody'; there are gold, blue, green"),
        ({"scenario": "janitorial", "controllers": {"*": "nearst"}}, "there is no allocator 'nearst'"),
        ({"scenario": "janitorial", "controllers": {"*": 3}}, "controllers: 3 of '*' is neither a class"),
        ({"scenario": "janitorial", "controllers": {"gold": type("Greedy", (Allocator,), {}), "*": Greedy}}, "two classes have the name 'greedy'"),
        ({"scenario": "janitorial", "controllers": {"*": type("Nearest", (Allocator,), {})}}, "'nearest' is one of the simulator's allocators"),
        ({"scenario": {"limit_s": -3.0}}, "limit_s: -3"),
        ({"scenario": "janitorial", "faults": [{"fault": {"kill": "nobody"}}]}, "nobody"),
        ({"scenario": "janitorial", "level": "loud"}, "level: there is no 'loud'; there are"),
        ({"scenario": "janitorial", "level": 3}, "level: 3 is not a text"),
        ({"scenario": "janitorial", "log": 3}, "log: 3 is not the path of a file or folder"),
        ({"scenario": "janitorial", "controllers": [1]}, "controllers: [1] is not a dict; write {'*': …} for all robots"),
        ({"scenario": "janitorial", "controllers": {"\ud800": Greedy}}, "controllers: the text '\\ud800' contains a character that UTF-8 cannot encode"),
        ({"scenario": "janitorial", "twice": "x"}, "twice: 'x' is neither True nor False"),
        ({"scenario": "janitorial", "faults": 3}, "faults: 3 is not a list of orders or a dict"),
        ({"scenario": "janitorial", "faults": "kill"}, "faults: 'kill' is not a list of orders or a dict"),
        ({"scenario": "janitorial", "randomise": 3}, "randomise: 3 is not a list of texts; write ['start', 'layout']"),
        ({"scenario": "janitorial", "randomise": [3]}, "randomise: 3 is not a text"),
        ({"scenario": "\ud800"}, "scenario: the text '\\ud800' contains a character that UTF-8 cannot encode"),
        ({"scenario": {"name": "\ud800"}}, "scenario.name: the text '\\ud800' contains a character that UTF-8 cannot encode"),
        ({"scenario": {"\ud800": 1}}, "scenario: the text '\\ud800' contains a character that UTF-8 cannot encode"),
        ({"scenario": "janitorial", "limit": math.nan}, "limit: nan is not a positive number of seconds"),
        ({"scenario": "janitorial", "limit": math.inf}, "limit: inf is not a positive number of seconds"),
        ({"scenario": "janitorial", "limit": -1}, "limit: -1 is not a positive number of seconds"),
        ({"scenario": "janitorial", "limit": "60s"}, "limit: '60s' is not a positive number of seconds"),
        ({"scenario": "janitorial", "limit": 1e300}, "limit: invalid value '1e+300'; 1e300 is out of range"),
    ],
)
def test_a_wrong_argument_is_reported_in_one_line(arguments, expected):
    with pytest.raises(ScenarioError) as error:
        run(**arguments)
    assert expected in str(error.value) and "\n" not in str(error.value)


def test_a_folder_with_a_run_is_refused(tmp_path):
    run("janitorial", limit=1, log=tmp_path)
    with pytest.raises(alliance_sim.AllianceError, match="already holds a run"):
        run("janitorial", limit=1, log=tmp_path)


def test_a_checkpoint_shares_only_frozen_attributes():
    class Learned(Allocator):
        frozen = {"net"}

    controller = Learned()
    controller.net, controller.memory, controller.setup = [1.0], {"a": [1]}, {"seed": 1}
    twin = copy.deepcopy(controller)
    assert twin.net is controller.net and twin.setup is controller.setup
    twin.memory["a"].append(2)
    assert controller.memory == {"a": [1]}


def test_math_functions_are_those_of_libm():
    for name in alliance_sim.math.__all__:
        own, usual = getattr(alliance_sim.math, name), getattr(math, name)
        given = (0.5,) if name not in ("atan2", "hypot", "pow") else (0.5, 0.75)
        assert abs(own(*given) - usual(*given)) <= 2 * math.ulp(usual(*given)), name
    assert math.isnan(alliance_sim.math.log(-1.0)) and alliance_sim.math.log(0.0) == -math.inf


def test_a_scenario_can_be_a_dict():
    scenario = {"name": "own", "limit_s": 2.0, "robots": [{"name": "solo"}], "service": {"points": [{"kind": "dust", "x_m": 1.0, "y_m": 1.0}], "kinds": [{"name": "dust", "work_s": {"min": 5.0, "max": 5.0}}]}}
    assert run(scenario, seed=random.Random(1).randrange(9)).file["scenario"]["name"] == "own"
