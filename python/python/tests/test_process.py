"""Controllers in Python as processes of a live run: join, kill, stop, end."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from alliance_sim import load, run
from conftest import EXAMPLES, ROOT, needed, program
from greedy import Greedy

BOOM = """
from alliance_sim import Allocator, main
class Boom(Allocator):
    def step(self, now, messages, sets):
        if now >= 1:
            raise RuntimeError("out of luck")
main(Boom)
"""


class Lab:
    """A world and its robots, in a separate runtime folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
        self.running: list[subprocess.Popen[str]] = []

    def start(self, *command: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            command, cwd=self.folder, env=self.environment, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        self.running.append(process)
        return process

    def world(self, *words: str) -> subprocess.Popen[str]:
        return self.start(program(), "cluster", "world", "--out=run", *words)

    def greedy(self, robot: str) -> subprocess.Popen[str]:
        return self.start(sys.executable, str(EXAMPLES / "greedy.py"), "--robot", robot)

    def agent(self, robot: str) -> subprocess.Popen[str]:
        return self.start(program(), "cluster", "agent", "--robot", robot)

    def wait_until(self, holds) -> None:
        for _ in range(1200):
            if holds():
                return
            time.sleep(0.05)
        raise AssertionError("timeout after one minute")

    def rows(self, table: str) -> int:
        try:
            return (self.folder / "run" / f"{table}.csv").read_text().count("\n")
        except FileNotFoundError:
            return 0


@pytest.fixture
def lab(tmp_path):
    lab = Lab(tmp_path)
    yield lab
    for process in lab.running:
        process.kill()
        process.wait()
        process.stderr.close()


def end(process: subprocess.Popen[str]) -> tuple[int, str]:
    _, output = process.communicate(timeout=120)
    return process.returncode, output


def test_a_team_of_python_processes_is_identical_to_the_run_in_one_process(lab):
    world = lab.world("janitorial", "--seed=3", "--limit=30")
    robots = [lab.greedy(robot) for robot in ("blue", "gold", "green")]
    assert end(world)[0] in (0, 1)
    for robot in robots:
        status, output = end(robot)
        assert status == 0, output
    expected = run("janitorial", {"*": Greedy}, 3, limit=30)
    rows = load(lab.folder / "run", "numpy")
    assert rows.run["hash"] == expected.hash
    assert rows.run["result"] == expected.result
    assert len(rows.allocation["t_ms"]) > 0


def test_a_kill_is_a_crash_and_a_new_process_a_new_incarnation(lab):
    world = lab.world("janitorial", "--speed=4x", "--limit=40", "--log=full")
    gold, blue, green = lab.greedy("gold"), lab.agent("blue"), lab.agent("green")
    lab.wait_until(lambda: lab.rows("ticks") > 500)
    gold.send_signal(signal.SIGKILL)
    gold.wait()
    again = lab.greedy("gold")
    for process in (world, blue, green, again):
        status, output = end(process)
        assert status in (0, 1), output
    events = load(lab.folder / "run", "numpy").events
    of_gold = events["kind"][events["robot"] == "gold"]
    order = [kind for kind in of_gold if kind in ("joined", "gone")]
    assert order == ["joined", "gone", "joined"]


def test_a_stopped_robot_is_silent_until_it_continues(lab):
    world = lab.world("janitorial", "--speed=8x", "--limit=80", "--stall-after=0.5")
    gold, blue, green = lab.greedy("gold"), lab.greedy("blue"), lab.agent("green")
    lab.wait_until(lambda: lab.rows("ticks") > 500)
    gold.send_signal(signal.SIGSTOP)
    lab.wait_until(lambda: "stalled" in (lab.folder / "run/events.csv").read_text())
    gold.send_signal(signal.SIGCONT)
    for process in (world, gold, blue, green):
        status, output = end(process)
        assert status in (0, 1), output
    events = load(lab.folder / "run", "numpy").events
    of_gold = [kind for kind in events["kind"][events["robot"] == "gold"] if kind in ("joined", "stalled", "back", "gone")]
    assert of_gold[:3] == ["joined", "stalled", "back"]


def test_sigterm_exits_with_0_and_a_failed_controller_with_one_line(lab):
    lab.world("janitorial", "--speed=2x", "--limit=600")
    (lab.folder / "boom.py").write_text(BOOM)
    gold, blue, green = lab.greedy("gold"), lab.agent("blue"), lab.start(sys.executable, "boom.py", "--robot=green")
    status, output = end(green)
    assert status == 101
    *_, last = output.splitlines()
    assert last == "robot-agent green: tick 20: boom.py:6: RuntimeError: out of luck"
    assert "Traceback" not in output
    gold.send_signal(signal.SIGTERM)
    status, output = end(gold)
    assert status == 0, output
    assert blue.poll() is None, "the run ended"


def test_wrong_arguments_are_reported(lab):
    status, output = end(lab.start(sys.executable, str(EXAMPLES / "greedy.py"), "--robot", "no good"))
    assert status == 2
    assert output.startswith("greedy.py: ") and output.count("\n") == 1 and "--robot" in output
    status, output = end(lab.start(sys.executable, str(EXAMPLES / "greedy.py"), "--robot=gold", "--run=none"))
    assert status == 3 and "none" in output


def test_another_protocol_version_of_the_world_is_reported(lab, monkeypatch):
    """A stand-in for a world with the next protocol version refuses the agent."""
    zenoh = needed("zenoh")
    needed("xxhash")
    monkeypatch.syspath_prepend(ROOT / "tests/python")
    import agent

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    team = {"endpoint": endpoint, "password": "password"}
    run = {"run": "other", "endpoint": "", "pid": os.getpid(), "token": "secret", "team": team, "started": 0}
    (lab.folder / "users").write_text("team:password\n")
    config = zenoh.Config()
    settings = {"mode": "router", "listen/endpoints": [endpoint], "transport/auth/usrpwd/dictionary_file": str(lab.folder / "users")}
    settings |= dict.fromkeys(("scouting/multicast/enabled", "scouting/gossip/enabled", "timestamping/enabled"), False)
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    bus = agent.Bus.__new__(agent.Bus)
    bus.derive_keys(run, "gold")

    def refuse(query):
        request = bus.open(str(query.key_expr), "JoinRequest", query.payload.to_bytes())
        refusal = ("Refused", ("Version", {"agent": request["version"], "world": agent.VERSION + 1}))
        query.reply(query.key_expr, bus.seal(f"{query.key_expr}/{request['nonce']:032x}", "JoinReply", refusal))

    with zenoh.open(config) as session:
        session.declare_queryable(f"{bus.prefix}/join/**", refuse)
        (lab.folder / "alliance").mkdir(mode=0o700)
        (lab.folder / "alliance/other.json").write_text(json.dumps(run))
        status, output = end(lab.greedy("gold"))
    *_, last = output.splitlines()
    versions = f"the agent uses protocol version {agent.VERSION}, the world uses {agent.VERSION + 1}"
    assert last == f"robot-agent gold: refused: {versions}: start both from the same build"
    assert status == 3
