"""Comparisons, sweeps and searches with controllers in Python."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from alliance_sim import Allocator, ScenarioError, compare, load, run, sweep, tune
from conftest import EXAMPLES, program
from greedy import Greedy

LOSS = [{"fault": {"drop": {"p": 0.3}}, "at_s": 0.0}]
PLAN = {
    "scenario": "janitorial",
    "limit_s": 40.0,
    "seeds": [3, 4],
    "grid": {"allocator": ["alliance", "greedy", "nearest"]},
    "faults": {"none": {}, "loss": {"timeline": LOSS}},
}
TOML = """
scenario = "janitorial"
limit_s = 40.0
seeds = [3, 4]
[grid]
allocator = ["alliance", "greedy", "nearest"]
[faults.none]
[faults.loss]
timeline = [{ fault.drop = { p = 0.3 }, at_s = 0.0 }]
"""
PICKY = """
from alliance_sim import Allocator, main

class Picky(Allocator):
    parameters = {"patience_s": (5.0, 0.0, 60.0)}

    def step(self, now, messages, sets):
        free = [option for option in sets if option.applicable]
        if now < self.values["patience_s"] or not free:
            return None
        return min(free, key=lambda option: (option.cost, option.id))

if __name__ == "__main__":
    main(Picky)
"""




@pytest.fixture
def command(tmp_path):
    """Runs a command of the program with this interpreter for controllers, and checks its exit status."""

    def run_command(*words: str, status: int = 0, **variables: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "ALLIANCE_PYTHON": sys.executable, **variables}
        done = subprocess.run([program(), *words], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
        assert done.returncode == status, done.stderr
        return done

    return run_command


def test_a_plan_draws_starts_and_layouts_for_each_seed(tmp_path):
    plan = {**PLAN, "randomise": ["start", "layout"], "grid": {"allocator": ["nearest", "greedy"]}, "faults": {"none": {}}}
    rows = load(compare(plan, [Greedy], out=tmp_path / "mine", jobs=1).folder, "numpy").results
    assert len(set(rows["hash"])) == 4
    for rule, seed, found in zip(rows["allocator"], rows["seed"], rows["hash"], strict=True):
        controller = Greedy if rule == "greedy" else str(rule)
        assert found == run("janitorial", {"*": controller}, int(seed), limit=40, randomise=["start", "layout"]).hash


def test_a_comparison_has_the_runs_of_the_controller(tmp_path):
    results = compare(PLAN, [Greedy], out=tmp_path / "mine", jobs=2)
    rows = load(results.folder, "numpy").results
    assert rows["allocator"].tolist().count("greedy") == 4
    for rule, faults, seed, found in zip(rows["allocator"], rows["faults"], rows["seed"], rows["hash"], strict=True):
        controller = Greedy if rule == "greedy" else str(rule)
        expected = run("janitorial", {"*": controller}, int(seed), faults=LOSS if faults == "loss" else [], limit=40)
        assert found == expected.hash, (rule, faults, seed)
    names = set(load(results.folder, "numpy")["cells"]["allocator"])
    assert names == {"alliance", "greedy", "nearest"}
    assert "greedy" in (results.folder / "comparison.html").read_text()


def test_the_command_and_its_shards_have_the_same_results(command, tmp_path):
    compare(PLAN, [Greedy], out=tmp_path / "here")
    (tmp_path / "plan.toml").write_text(TOML)
    controller = ["--controller", f"greedy={EXAMPLES / 'greedy.py'}"]
    done = command("compare", "plan.toml", *controller, "--out", "whole")
    expected = (tmp_path / "here/results.csv").read_bytes()
    assert (tmp_path / "whole/results.csv").read_bytes() == expected
    assert f"--controller greedy={EXAMPLES / 'greedy.py'} --cell 0" in done.stderr
    for shard in ("0/2", "1/2"):
        command("compare", "plan.toml", *controller, "--shard", shard, "--out", "shards")
    command("compare", "--merge", "shards")
    assert (tmp_path / "shards/results.csv").read_bytes() == expected
    again = command("compare", "plan.toml", *controller, "--out", "whole")
    assert "12 of them done before" in again.stderr
    # The journal belongs to one version of the controller.
    changed = tmp_path / "greedy.py"
    changed.write_text((EXAMPLES / "greedy.py").read_text() + "\n# changed\n")
    refused = command("compare", "plan.toml", "--controller", f"greedy={changed}", "--out", "whole", status=2)
    assert "holds another sweep, or this one before it was changed" in refused.stderr


def test_a_suite_runs_and_checks_a_controller(command, tmp_path):
    controller = ["--controller", f"greedy={EXAMPLES / 'greedy.py'}"]
    bench = ["bench", "v1", "--allocator", "greedy", *controller, "--jobs", "1", "--out", "mine"]
    environment = {**os.environ, "ALLIANCE_PYTHON": sys.executable}
    journal = tmp_path / "mine/journal.jsonl"
    with subprocess.Popen([program(), *bench], cwd=tmp_path, env=environment, stderr=subprocess.PIPE) as begun:
        # The header and the first of 180 runs.
        while begun.poll() is None and (not journal.exists() or journal.read_text().count("\n") < 2):
            time.sleep(0.05)
        begun.send_signal(signal.SIGINT)
    header, text = journal.read_text().splitlines()[:2]
    row = json.loads(text)
    del row["sum"]
    assert row["end"]["ended"]["hash"] == run("waste-cleanup", {"*": Greedy}, 1, limit=1200).hash
    # A cheat leaves one run to the program, and states this row, which he has changed, for all others.
    row["end"]["ended"]["messages_sent"] += 1
    rows = [json.dumps({**row, "run": number}) for number in range(179)]
    journal.write_text("\n".join([header, *rows]) + "\n")
    done = command(*bench)
    assert "179 of them done before" in done.stderr
    result = json.loads((tmp_path / "mine/result.json").read_text())
    assert {each["allocator"] for each in result["runs"]} == {"greedy"}
    # At least one of the two repeated runs is from the cheat.
    refuted = command("bench", "check", "mine/result.json", *controller, status=1)
    assert "2 of 180 runs repeated" in refuted.stderr and "when repeated" in refuted.stderr
    refused = command("bench", "check", "mine/result.json", status=2)
    assert "name their files with --controller" in refused.stderr
    changed = tmp_path / "greedy.py"
    changed.write_text((EXAMPLES / "greedy.py").read_text() + "\n# changed\n")
    refused = command("bench", "check", "mine/result.json", "--controller", f"greedy={changed}", status=2)
    assert "the files of --controller differ from those that made this result" in refused.stderr


def test_a_run_of_a_plan_can_be_repeated_in_processes_and_replayed_without_python(command, tmp_path):
    (tmp_path / "plan.toml").write_text(TOML)
    controller = f"greedy={EXAMPLES / 'greedy.py'}"
    rows = load(sweep(PLAN, [Greedy], out=tmp_path / "sweep").folder, "numpy").results
    number = int(rows["run"][(rows["allocator"] == "greedy") & (rows["faults"] == "loss")][0])
    printed = command("sweep", "plan.toml", "--controller", controller, "--scenario", str(number))
    (tmp_path / f"run-{number}.toml").write_text(printed.stdout)
    words = printed.stderr.strip().partition(": alliance ")[2]
    assert words.startswith(f"run run-{number}.toml --seed ") and "--controller 'greedy=python3 " in words
    words = words.replace("python3 ", f"{sys.executable} ")
    done = subprocess.run(f"{program()} {words} --out repeated --no-page --speed max", shell=True, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    repeated = load(tmp_path / "repeated").run["hash"]
    assert repeated == rows["hash"][rows["run"] == number][0]
    replayed = command("replay", "repeated", PATH="", ALLIANCE_PYTHON="/none")
    assert f"hash {repeated}" in replayed.stderr


def test_a_failed_controller_fails_its_runs_only(tmp_path):
    (tmp_path / "boom.py").write_text(
        "from alliance_sim import Allocator\n\nclass Boom(Allocator):\n    def step(self, now, messages, sets):\n        return {}[self.name]\n"
    )
    sys.path.insert(0, str(tmp_path))
    import boom

    plan = {**PLAN, "grid": {"allocator": ["nearest", "boom"]}, "faults": {}}
    with pytest.warns(RuntimeWarning, match="failed: gold: tick 0: boom.py:5: KeyError: 'gold'"):
        results = sweep(plan, [boom.Boom], out=tmp_path / "out")
    rows = load(results.folder, "numpy").results
    assert [bool(one) for one in rows["hash"] != ""] == [rule == "nearest" for rule in rows["allocator"]]


def test_parameters_of_a_controller_can_be_varied_and_tuned(tmp_path):
    (tmp_path / "picky.py").write_text(PICKY)
    sys.path.insert(0, str(tmp_path))
    from picky import Picky

    plan = {"scenario": "janitorial", "limit_s": 120.0, "seeds": [1], "grid": {"allocator": ["picky"], "allocators": {"picky": {"patience_s": [5.0, 50.0]}}}}
    rows = load(sweep(plan, [Picky], out=tmp_path / "sweep").folder, "numpy").results
    assert len(set(rows["hash"])) == 2
    assert rows["hash"][0] == run("janitorial", {"*": Picky}, 1, limit=120.0).hash, "5 s is the default"
    plan["grid"]["allocators"] = {"picky": {"patience_s": [70.0]}}
    with pytest.raises(ScenarioError, match="patience_s"):
        sweep(plan, [Picky], out=tmp_path / "refused")
    search = {
        "scenario": "janitorial",
        "limit_s": 60.0,
        "tune": {
            "metric": "par2_s",
            "training": {"from": 1, "to": 2},
            "selection": {"from": 3, "to": 3},
            "test": {"from": 4, "to": 5},
            "budget": 12,
            "seeds_per_candidate": 2,
            "finalists": 1,
            "parameters": {"picky": {"allocators": {"picky": {"patience_s": {"from": 0.0, "to": 40.0}}}}},
        },
    }
    results = tune(search, [Picky], out=tmp_path / "tuned")
    assert "patience_s" in (results.folder / "tuning.html").read_text()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--controller", "greedy=none.py"), "--controller greedy: none.py: there is no such file"),
        (("--controller", "gredy={greedy}"), "there is no controller 'gredy'; there are greedy"),
        (("--controller", "greedy={greedy}", "--controller", "greedy={greedy}"), "it is given twice"),
        (("--controller", "greedy"), "use NAME=FILE, such as greedy=greedy.py"),
        (("--controller", "nearest={greedy}"), "--controller nearest: 'nearest' is one of the simulator's allocators; give the class another name"),
        ((), "there is no allocator 'greedy'"),
    ],
)
def test_mistakes_are_reported_in_one_line(command, tmp_path, words, expected):
    (tmp_path / "plan.toml").write_text(TOML)
    words = [word.format(greedy=EXAMPLES / "greedy.py") for word in words]
    done = command("compare", "plan.toml", *words, status=2)
    assert expected in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert not (tmp_path / "comparisons").exists()


def test_without_the_package_the_command_names_the_remedy(command, tmp_path):
    (tmp_path / "plan.toml").write_text(TOML)
    without = tmp_path / "without"
    # `-S`: no installed packages.
    without.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
    other = tmp_path / "other"
    other.write_text("#!/bin/sh\necho 0123\n")
    for python, expected in [
        (Path("/none/python3"), "No such file"),
        (without, "No module named 'alliance_sim'"),
        (other, "its package has the build 0123, and this program the build "),
    ]:
        if python.exists():
            python.chmod(0o755)
        words = ("compare", "plan.toml", "--controller", "greedy=greedy.py")
        done = command(*words, status=2, ALLIANCE_PYTHON=str(python), PYTHONPATH="")
        assert str(python) in done.stderr and expected in done.stderr and "set ALLIANCE_PYTHON to it" in done.stderr
        assert done.stderr.count("\n") == 1, done.stderr


def test_a_file_can_contain_several_controllers(command, tmp_path):
    (tmp_path / "plan.toml").write_text('scenario = "janitorial"\nlimit_s = 5.0\nseeds = [1]\n[grid]\nallocator = ["first", "second"]\n')
    step = "    def step(self, now, messages, sets):\n        return None\n\n"
    text = f"from alliance_sim import Allocator\n\nclass First(Allocator):\n{step}class Second(Allocator):\n{step}"
    (tmp_path / "two.py").write_text(text)
    command("sweep", "plan.toml", "--controller", "first=two.py", "--controller", "second=two.py", "--out", "out")
    assert load(tmp_path / "out", "numpy").results["allocator"].tolist() == ["first", "second"]


def test_a_journal_belongs_to_one_version_of_the_modules(command, tmp_path):
    (tmp_path / "plan.toml").write_text('scenario = "janitorial"\nlimit_s = 5.0\nseeds = [1]\n[grid]\nallocator = ["mine"]\n')
    (tmp_path / "mine.py").write_text("import rule\nfrom alliance_sim import Allocator\n\nclass Mine(Allocator):\n    step = rule.step\n")
    rule = "def step(self, now, messages, sets):\n    return None\n"
    (tmp_path / "rule.py").write_text(rule)
    words = ("sweep", "plan.toml", "--controller", "mine=mine.py", "--out", "out")
    command(*words)
    (tmp_path / "unused.py").write_text("")
    assert "1 of them done before" in command(*words).stderr
    (tmp_path / "rule.py").write_text(rule.replace("None", "sets[0]"))
    assert "this one before it was changed" in command(*words, status=2).stderr


def test_files_of_a_plan_in_a_dict_are_relative_to_the_working_directory(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("limit_s = 5.0\n")
    results = sweep({"scenario": "mine.toml", "seeds": [1]}, out="out")
    assert len(load(results.folder, "numpy").results["hash"]) == 1
    with pytest.raises(ScenarioError, match=f"{tmp_path}/none.toml"):
        sweep({"scenario": "none.toml", "seeds": [1]}, out="none")


def test_a_mistake_in_a_dict_names_the_plan_and_not_a_deleted_file(tmp_path):
    with pytest.raises(ScenarioError, match="^plan: football: unknown key"):
        compare({**PLAN, "football": 1}, [Greedy], out=tmp_path / "out")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"controllers": ["greedy"]}, "controllers: 'greedy' is not a class derived from Allocator or Agent"),
        ({"controllers": "greedy"}, "controllers: 'greedy' is not a list of classes"),
        ({"controllers": Greedy}, "controllers: <class 'greedy.Greedy'> is not a list of classes"),
        ({"out": 3}, "out: 3 is not the path of a file or folder"),
        ({"plan": 3}, "plan: 3 is not the path of a file or folder"),
        ({"plan": {"seeds": "\ud800"}}, "plan.seeds: the text '\\ud800' contains a character that UTF-8 cannot encode"),
    ],
)
def test_wrong_arguments_are_named(tmp_path, arguments, expected):
    with pytest.raises(ScenarioError) as error:
        compare(**{"plan": "plan.toml", "out": tmp_path / "out", **arguments})
    assert str(error.value) == expected


@pytest.mark.parametrize("signals", [1, 2])
def test_ctrl_c_ends_a_comparison_without_a_traceback(tmp_path, signals):
    (tmp_path / "plan.toml").write_text('scenario = "janitorial"\nseeds = 2000\n[grid]\nallocator = ["nearest", "greedy"]\n')
    words = ["compare", "plan.toml", "--controller", f"greedy={EXAMPLES / 'greedy.py'}", "--jobs", "1", "--out", "mine"]
    environment = {**os.environ, "ALLIANCE_PYTHON": sys.executable}
    journal = tmp_path / "mine/journal.jsonl"
    begun = subprocess.Popen([program(), *words], cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    while begun.poll() is None and (not journal.exists() or journal.read_text().count("\n") < 2):
        time.sleep(0.05)
    for _ in range(signals):
        begun.send_signal(signal.SIGINT)
    _, errors = begun.communicate(timeout=60)
    assert begun.returncode == 130 and "Traceback" not in errors, errors
    # A second signal may end the process before this line.
    assert signals == 2 or "continue with" in errors, errors


def test_classes_without_a_file_are_refused(tmp_path):
    class Local(Allocator):
        pass

    with pytest.raises(ScenarioError, match="is not at the top level of a file of Python"):
        compare(PLAN, [Local], out=tmp_path / "out")
    with pytest.raises(ScenarioError, match="no allocator 'greedy'"):
        compare(PLAN, out=tmp_path / "out")
    with pytest.raises(ScenarioError, match="football"):
        compare({**PLAN, "football": 1}, [Greedy], out=tmp_path / "out")
