"""The allocator `learned`: weights from Python run in the engine, with the decisions of the same network in Python."""

import json
import struct

import numpy as np
import pytest
from alliance_sim import Allocator, ScenarioError, math, run
from conftest import ROOT
from train import safetensors, scenario

SHIPPED = ROOT / "robot-agent/src/allocators/learned/service.safetensors"
FAULTS = [
    {"at_s": 0.0, "fault": {"drop": {"p": 0.3}}},
    {"at_s": 20.0, "for_s": 30.0, "fault": {"kill": "r2"}},
]


def layers(file):
    """Reads the layers of a file: weights and biases as lists of Python's numbers."""
    length = struct.unpack("<Q", file[:8])[0]
    header, numbers = json.loads(file[8 : 8 + length]), file[8 + length :]
    tensors = {}
    for name, entry in header.items():
        tensors[name] = np.frombuffer(numbers[slice(*entry["data_offsets"])], "<f4").reshape(entry["shape"]).astype(float).tolist()
    order = sorted({int(name.split(".")[0]) for name in tensors})
    return [(tensors[f"{number}.weight"], tensors[f"{number}.bias"]) for number in order]


def squash(seconds):
    return seconds / (seconds + 30.0)


def span(seconds):
    """Maps a difference of two times, which are whole milliseconds."""
    return squash(round(seconds * 1000) / 1000)


class Twin(Allocator):
    """The rule of `learned` in Python, with other code."""

    network = None
    frozen = {"network"}

    def reset(self):
        self.claims, self.since = {}, 0.0

    def step(self, now, messages, sets):
        for message in messages:
            known = self.claims.get(message.sender)
            if message.state != "message" and (known is None or known[0] <= (message.incarnation, message.sent)):
                task = message.task if message.state == "executing" else None
                self.claims[message.sender] = ((message.incarnation, message.sent), now, message.since, task)
        able = [one for one in sets if one.applicable]
        active = next((one for one in sets if one.active), None)
        chosen = None
        if active and active.applicable and self.laden:
            chosen = active
        elif able:
            least = min(min(one.cost, 1e6) for one in able)
            scores = {one.id: self.score(self.features(one, least, now)) for one in able}
            chosen = max(able, key=lambda one: (one.priority, scores[one.id], -one.id))
        if (chosen and chosen.id) != (active and active.id):
            self.since = now
        return chosen

    def features(self, one, least, now):
        cost = min(one.cost, 1e6)
        claims = [
            (received, (since, sender))
            for sender, (_, received, since, task) in self.claims.items()
            if task == one.task and round((now - received) * 1000) < round(one.ceased_after * 1000)
        ]
        earlier = [claim for _, claim in claims if not one.active or claim < (self.since, self.rank)]
        silent = min((now - received for received, _ in claims), default=0.0)
        return [
            squash(cost),
            squash(cost - least),
            float(one.active),
            span(now - self.since) if one.active else 0.0,
            min(len(claims) / one.max_robots, 2.0),
            min(len(earlier) / one.max_robots, 2.0),
            span(silent),
            squash(one.opens_in),
            span(now - one.round),
        ]

    def score(self, values):
        for number, (weights, biases) in enumerate(self.network):
            sums = []
            for row, bias in zip(weights, biases, strict=True):
                total = bias
                for weight, value in zip(row, values, strict=True):
                    total += weight * value
                sums.append(total)
            values = sums if number + 1 == len(self.network) else [math.tanh(one) for one in sums]
        return values[0]


def drawn_file():
    rng = np.random.default_rng(5)
    shapes = {"0.weight": (8, 9), "0.bias": (8,), "2.weight": (5, 8), "2.bias": (5,), "4.weight": (1, 5), "4.bias": (1,)}
    return safetensors({name: rng.normal(size=shape) for name, shape in shapes.items()})


@pytest.mark.parametrize("weights", ["shipped", "drawn"])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_engine_decides_like_the_same_network_in_python(tmp_path, weights, seed):
    file = SHIPPED.read_bytes() if weights == "shipped" else drawn_file()
    path = tmp_path / "policy.safetensors"
    path.write_bytes(file)
    twin = type("Twin", (Twin,), {"network": layers(file)})
    mission = scenario(4, 12)
    allocators = {"learned": {"weights": str(path)}}
    options = {"seed": seed, "faults": FAULTS, "limit": 120.0}
    engine = run({**mission, "allocators": allocators}, {"*": "learned"}, log=tmp_path / "engine", **options)
    python = run(mission, {"*": twin}, log=tmp_path / "python", **options)
    assert engine.result == python.result
    assert engine.result["done"] > 3
    tables = [one.load() for one in (engine, python)]
    assert len(tables[0].events) > 20
    assert tables[0].events.to_csv() == tables[1].events.to_csv()
    assert tables[0]["poses"].to_csv() == tables[1]["poses"].to_csv()


def test_a_replay_needs_no_file_of_weights(tmp_path, alliance):
    (tmp_path / "policy.safetensors").write_bytes(drawn_file())
    (tmp_path / "mine.toml").write_text(
        "allocator = 'learned'\nlimit_s = 40\n[allocators.learned]\nweights = 'policy.safetensors'\n"
        "[service]\nkinds = [{ name = 'a', work_s = { min = 2, max = 4 } }]\nrandom = [{ n = 12 }]\n"
        "[[robots]]\nname = 'one'\nskills = { a = 1 }\n[[robots]]\nname = 'two'\nskills = { a = 1 }\n"
    )
    alliance("run", "mine.toml", "--speed", "max", "--out", "runs/processes", "--no-page", status=(0, 1))
    alliance("run", "mine.toml", "--in-process", "--out", "runs/here", status=(0, 1))
    (tmp_path / "policy.safetensors").unlink()
    hashes = {json.loads((tmp_path / f"runs/{name}/run.json").read_text())["hash"] for name in ("processes", "here")}
    assert len(hashes) == 1
    assert f"identical: 800 ticks, hash {hashes.pop()}" in alliance("replay", "runs/processes").stderr
    missing = alliance("run", "mine.toml", "--out", "runs/none", status=(2,)).stderr
    assert "allocators.learned.weights: cannot read 'policy.safetensors'" in missing


def test_wrong_weights_have_one_line(tmp_path):
    mission, path = scenario(4, 12), tmp_path / "policy.safetensors"

    def refusal(content):
        path.write_bytes(content)
        with pytest.raises(ScenarioError) as error:
            run({**mission, "allocators": {"learned": {"weights": str(path)}}}, {"*": "learned"}, limit=1.0)
        assert "\n" not in str(error.value)
        return str(error.value)

    assert "not in the format safetensors" in refusal(b"")
    assert "not in the format safetensors" in refusal(drawn_file()[:-1])
    assert "larger than 65536 bytes" in refusal(bytes(65537))
    assert "0.weight has the shape [1, 3]; it must be [1, 9]" in refusal(safetensors({"0.weight": np.zeros((1, 3)), "0.bias": np.zeros(1)}))
