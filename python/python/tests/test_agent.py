"""Complete controllers in Python: in one process, as processes of `alliance run`, and their failures."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from alliance_sim import Action, Agent, Allocator, ControllerError, load, run
from conftest import EXAMPLES, program
from greedy import Greedy
from watcher import Watcher

TWINS = json.loads(Path(__file__).with_name("still.json").read_text())
MAIN = "from alliance_sim import Action, Agent, main\n"


class Still(Agent):
    def step(self, now, readings, messages):
        return Action()


class Listener(Agent):
    """Turns by sender, time and order of the received messages."""

    def step(self, now, readings, messages):
        heartbeats = enumerate(message for message in messages if message.state != "message")
        digest = sum((place + 1) * (message.sender + 1) * (round(message.sent * 20) + 1) for place, message in heartbeats)
        return Action(turn=digest % 128 / 128)


def twin_run(tmp_path, controller=Still, seed=1, **options):
    """Runs a controller with the faults of its Rust twin."""
    twin = TWINS[controller.__name__.lower()]
    scenario = tmp_path / "mine.toml"
    scenario.write_text(twin["scenario"])
    return run(scenario, {"gold": controller}, seed, faults=twin["faults"], limit=twin["limit_s"], **options)


@pytest.mark.parametrize("controller", [Still, Listener])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_agent_has_the_hash_of_its_rust_twin(tmp_path, controller, seed):
    expected = TWINS[controller.__name__.lower()]["hashes"][str(seed)]
    assert twin_run(tmp_path, controller, seed).hash == expected
    assert twin_run(tmp_path, controller, seed, twice=True).hash == expected


class Lab:
    """`alliance run` in a separate runtime folder, with a scenario that names the controllers of gold and green."""

    def __init__(self, folder):
        self.folder = folder
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}

    def controller(self, name, code):
        (self.folder / f"{name}.py").write_text(code)
        return f"--controller={name}={sys.executable} {name}.py"

    def start(self, *words):
        return subprocess.Popen(
            [program(), *words], cwd=self.folder, env=self.environment, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )

    def alliance(self, *words, status=(0,)):
        process = self.start(*words)
        _, output = process.communicate(timeout=240)
        assert process.returncode in status, output
        return output

    def mission(self, *words, status=(1,)):
        return self.alliance("run", "mine.toml", "--no-page", "--out=run", *words, status=status)

    def scenario(self, controller, more=""):
        text = f"name = 'mine'\n[[robots]]\nname = 'blue'\n[[robots]]\nname = 'gold'\ncontroller = '{controller}'\n[[robots]]\nname = 'green'\n{more}"
        (self.folder / "mine.toml").write_text(text)
        return self.folder / "mine.toml"

    def log(self, robot):
        return (self.folder / f"run/logs/{robot}.log").read_text()

    def kinds(self, robot, wanted=("joined", "gone", "stalled", "back")):
        events = load(self.folder / "run", "numpy").events
        return [kind for kind in events["kind"][events["robot"] == robot] if kind in wanted]


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


def test_a_process_has_the_same_hash_and_replays_without_python(lab):
    controller = lab.controller("still", f"{MAIN}class Still(Agent):\n    def step(self, now, readings, messages):\n        return Action()\nmain(Still)\n")
    (lab.folder / "mine.toml").write_text(TWINS["still"]["scenario"])
    faults = "".join(f"[[faults.timeline]]\n{line}\n" for line in ("fault.kill = 'gold'\nat_s = 10.0\nfor_s = 5.0", "fault.mute = 'blue'\nat_s = 20.0\nfor_s = 5.0"))
    with (lab.folder / "mine.toml").open("a") as file:
        file.write(faults)
    lab.mission("--limit=40", controller)
    assert load(lab.folder / "run", "numpy").run["hash"] == TWINS["still"]["hashes"]["1"]
    assert lab.kinds("gold") == ["joined", "gone", "joined"]
    assert "identical" in lab.alliance("replay", "run")
    assert "identical" in lab.alliance("replay", "run", controller)


def test_replay_detects_a_changed_allocator(lab):
    scenario = lab.scenario("greedy")
    text = (EXAMPLES / "greedy.py").read_text()
    controller = lab.controller("greedy", text)
    lab.mission("--limit=100", "--controller=greedy@7=" + controller.split("=", 2)[2])
    results = load(lab.folder / "run", "numpy").run
    assert results["controllers"] == {"greedy": {"version": "7"}}
    assert results["hash"] == run(scenario, {"gold": Greedy}, limit=100).hash
    assert "identical" in lab.alliance("replay", "run")
    assert "identical" in lab.alliance("replay", "run", controller)
    changed = lab.controller("greedy", text.replace("option.cost", "-option.cost"))
    output = lab.alliance("replay", "run", changed, status=(1,))
    assert "differs first in tick " in output and ": gold controller, " in output


def test_a_log_of_a_run_in_one_process_replays_without_python(lab):
    done = run(lab.scenario("greedy"), {"gold": Greedy, "green": Still}, limit=60, log=lab.folder / "run")
    assert set(done.file["controllers"]) == {"greedy", "still"}
    output = lab.alliance("replay", "run")
    assert output == f"identical: 1200 ticks, hash {done.hash}\n"


def test_discarded_steps_have_no_effect(lab):
    # The controller stores steps and senders, so any effect of a discarded step is visible in all later steps.
    code = MAIN + (
        "class Counter(Agent):\n    def reset(self):\n        self.steps, self.words = 0, []\n"
        "    def step(self, now, readings, messages):\n        self.steps += 1\n        self.words += [message.sender for message in messages]\n"
        "        return Action(turn=self.steps % 97 / 97, speed=sum(self.words) % 7 / 70, send=[bytes([self.steps % 251])])\nmain(Counter)\n"
    )
    controller = lab.controller("counter", code)
    lab.scenario("counter")
    launcher = lab.start("run", "mine.toml", "--no-page", "--out=run", "--limit=100", "--speed=8x", "--stall-after=0.3", controller)
    gold = None
    for stop in range(6):
        time.sleep(0.7)
        children = Path(f"/proc/{launcher.pid}/task/{launcher.pid}/children").read_text().split()
        gold = next(pid for pid in children if "counter.py" in Path(f"/proc/{pid}/cmdline").read_text())
        os.kill(int(gold), signal.SIGSTOP)
        time.sleep(0.5)
        os.kill(int(gold), signal.SIGCONT)
    _, output = launcher.communicate(timeout=240)
    assert launcher.returncode == 1, output
    assert lab.kinds("gold").count("back") >= 3, "gold was paused too rarely"
    assert load(lab.folder / "run", "numpy").run["unscripted"], "stalls without a fault are unscripted"
    assert "identical" in lab.alliance("replay", "run")
    assert "identical" in lab.alliance("replay", "run", controller)
    assert not Path(f"/proc/{gold}").exists(), "the process of gold still runs"


def test_readings_match_the_log(tmp_path):
    by_robot = {}

    class Looker(Agent):
        collected = {"by_robot"}

        def step(self, now, readings, messages):
            by_robot.setdefault(self.name, []).append(readings)
            return Action(speed=0.2, turn=0.3, doing="search")

    done = run("cmommt", {"*": Looker}, limit=20, log=tmp_path / "run")
    seen = by_robot["gold"]
    poses = load(done.folder, "numpy")["poses"]
    of_gold = poses["robot"] == "gold"
    at = np.stack([poses["x_m"][of_gold], poses["y_m"][of_gold]], 1)
    assert len(seen) == len(at) == 400
    assert np.allclose([readings.position for readings in seen], at, atol=1e-6)
    assert np.allclose([readings.heading for readings in seen], poses["heading_rad"][of_gold], atol=1e-6)
    targets = [target for all in by_robot.values() for readings in all for target in readings.mission["targets"]]
    assert targets and all(np.hypot(*target["offset"]) <= 2.6 for target in targets)
    assert len(at) > 1 and not np.allclose(at[0], at[-1]), "gold does not move"
    sets = poses["behavior_set"][of_gold]
    assert sets[-1] == "search"


def test_an_agent_observes_targets():
    def share(controller):
        return sum(run("cmommt", controller and {"*": controller}, seed=seed).result["a"] for seed in (1, 2, 3)) / 3

    class Blind(Agent):
        def step(self, now, readings, messages):
            return Action(watch=False)

    assert share(Blind) == 0
    assert 0 < share(Still) < share(Watcher)


def test_messages_reach_robots_of_the_same_class_only():
    received_by = {}

    class Talker(Agent):
        collected = {"received_by"}

        def step(self, now, readings, messages):
            received_by.setdefault(self.name, []).extend(message.content for message in messages if message.content)
            return Action(send=[self.name.encode()] if now == 0 else ())

    run("janitorial", {"blue": Talker, "gold": Talker, "green": Still}, limit=2)
    assert received_by == {"blue": [b"gold"], "gold": [b"blue"]}


def step_of(step):
    return type("Bad", (Agent,), {"step": step})


BAD = [
    (step_of(lambda self, now, readings, messages: Action(speed=float("nan"))), "ValueError: Action: speed is nan, which is not a finite number"),
    (step_of(lambda self, now, readings, messages: Action(turn=1e39)), "ValueError: Action: turn is inf, which is not a finite number"),
    (step_of(lambda self, now, readings, messages: Action(speed="fast")), "TypeError: Action: speed is 'fast', which is not a finite number"),
    (step_of(lambda self, now, readings, messages: 3), "TypeError: step returned int; it must return an Action"),
    (
        step_of(lambda self, now, readings, messages: Action(work=2**40)),
        "TypeError: Action: the value of work does not fit; write None or a whole number from 0 to 4294967295",
    ),
    (step_of(lambda self, now, readings, messages: Action(report="yes")), "TypeError: Action: the value of report does not fit; write True or False"),
    (step_of(lambda self, now, readings, messages: Action(doing=1)), "TypeError: Action: the value of doing does not fit; write None or a text"),
    (step_of(lambda self, now, readings, messages: Action(doing="dance")), "ValueError: Action: doing 'dance' is not one of the robot's sets; the sets are "),
    (step_of(lambda self, now, readings, messages: Action(progress=True)), "ValueError: Action: progress needs a set"),
    (step_of(lambda self, now, readings, messages: Action(gripper="open")), "ValueError: Action: gripper is 'open'; use 'keep', 'pick' or 'drop'"),
    (step_of(lambda self, now, readings, messages: Action(send=[b"?"] * 300)), "ValueError: send: a robot with "),
    (step_of(lambda self, now, readings, messages: Action(send=["text"])), "TypeError: send: str is not bytes"),
    (step_of(lambda self, now, readings, messages: 1 / 0), "ZeroDivisionError: division by zero"),
    (Agent, "NotImplementedError: Agent has no step"),
]


@pytest.mark.parametrize(("controller", "expected"), BAD)
def test_a_failed_controller_is_reported_in_one_line(controller, expected):
    with pytest.raises(ControllerError) as error:
        run("waste-cleanup", {"gold": controller}, limit=5)
    output = str(error.value)
    assert output.startswith("gold: tick 0: ") and expected in output and "\n" not in output


def test_a_failed_controller_is_a_crash_and_the_run_continues(lab):
    controller = lab.controller("bad", f"{MAIN}class Bad(Agent):\n    def step(self, now, readings, messages):\n        return Action(speed=float('nan') if now > 2 else 0.1)\nmain(Bad)\n")
    lab.scenario("bad")
    output = lab.mission("--limit=10", controller)
    assert "gold crashed" in output
    assert lab.kinds("gold") == ["joined", "gone"]
    *_, last = lab.log("gold").splitlines()
    assert last == "robot-agent gold: tick 41: bad.py:4: ValueError: Action: speed is nan, which is not a finite number"
    results = load(lab.folder / "run", "numpy").run
    assert (results["result"]["ticks"], results["unscripted"]) == (200, False)
    assert "identical" in lab.alliance("replay", "run")


def test_a_slow_copy_is_reported_once(lab):
    net = "class Net:\n    def __deepcopy__(self, memo):\n        time.sleep(0.06)\n        return self\n"
    heavy = "class Heavy(Agent):\n    def reset(self):\n        self.net = Net()\n    def step(self, now, readings, messages):\n        return Action()\n"
    shared = "    frozen = {'net'}\n"
    controller = lab.controller("heavy", f"import time\n{MAIN}{net}{heavy}main(Heavy)\n")
    lab.scenario("heavy")
    lab.mission("--limit=5", controller)
    warnings = [line for line in lab.log("gold").splitlines() if "a copy of its controller takes" in line]
    assert len(warnings) == 1 and warnings[0].endswith("longer than a step of 50 ms: list constant attributes in `frozen`")
    frozen = lab.controller("heavy", f"import time\n{MAIN}{net}{heavy.replace('    def reset', shared + '    def reset')}main(Heavy)\n")
    (lab.folder / "run").rename(lab.folder / "first")
    lab.mission("--limit=5", frozen)
    assert "a copy of its controller" not in lab.log("gold")


class Chance(Agent):
    def step(self, now, readings, messages):
        return Action(turn=random.random())


class Hidden(Agent):
    def step(self, now, readings, messages):
        self.mood = random.random()
        return Action()


class Order(Agent):
    def reset(self):
        self.todo = {7, 15}  # both have the same slot in the hash table

    def step(self, now, readings, messages):
        return Action(turn=float(next(iter(self.todo))))


class Choosy(Allocator):
    def step(self, now, messages, sets):
        return random.choice([*sets, None])


@pytest.mark.parametrize(("controller", "field"), [(Chance, "Action.turn"), (Hidden, "self.mood"), (Order, "Action.turn")])
def test_twice_detects_hidden_dependencies(controller, field):
    run("waste-cleanup", {"gold": controller}, limit=1)
    with pytest.raises(ControllerError, match=rf"a step made twice differs: {field} is .* and "):
        run("waste-cleanup", {"gold": controller}, limit=1, twice=True)


def test_twice_does_not_change_a_deterministic_controller(lab):
    for scenario, controller in (("janitorial", Greedy), ("cmommt", Watcher)):
        once, twice = (run(scenario, {"*": controller}, limit=30, twice=twice) for twice in (False, True))
        assert once.hash == twice.hash
    # In a process of its own, a difference ends the process.
    lab.scenario("chance")
    controller = lab.controller("chance", f"import random\n{MAIN}class Chance(Agent):\n    def step(self, now, readings, messages):\n        return Action(turn=random.random())\nmain(Chance)\n")
    lab.mission("--limit=2", controller)
    assert lab.kinds("gold") == ["joined"]
    (lab.folder / "run").rename(lab.folder / "once")
    lab.mission("--limit=2", f"{controller} --twice")
    assert "a step made twice differs: Action.turn" in lab.log("gold")
    assert lab.kinds("gold") == ["joined", "gone"]
