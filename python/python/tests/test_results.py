"""Tables of runs, sweeps and comparisons as data frames."""

import sys

import numpy as np
import pytest
from alliance_sim import AllianceError, load, run
from conftest import needed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    run("waste", {"*": "nearest"}, 3, limit=20, log=folder)
    return folder


def test_load_returns_the_tables_of_a_run(folder):
    results = load(folder, "numpy")
    assert {"events", "poses", "mission", "messages", "allocation", "ticks"} <= set(results)
    poses = results.poses
    assert len(poses["t_ms"]) == 400 * 3 and poses["x_m"].dtype == np.float64 and poses["t_ms"].dtype.kind == "i"
    assert set(poses["robot"]) == {"blue", "gold", "green"}
    assert results.run["scenario"]["name"] == "waste-cleanup" and results.run["result"]["ticks"] == 400


def test_a_compact_log_has_the_rows_of_a_full_one(folder, tmp_path):
    run("waste", {"*": "nearest"}, 3, limit=20, log=tmp_path / "run", level="compact")
    full, compact = load(folder, "numpy"), load(tmp_path / "run", "numpy")
    assert set(full) == set(compact)
    for table in set(full) - {"ticks"}:
        for name, values in full[table].items():
            assert np.array_equal(values, compact[table][name], equal_nan=values.dtype.kind == "f"), f"{table}: {name}"


def test_a_damaged_compact_log_is_refused(tmp_path):
    run("waste", {"*": "nearest"}, 3, limit=20, log=tmp_path / "run", level="compact")
    poses = tmp_path / "run" / "poses.csv"
    rows = poses.read_text().splitlines(keepends=True)
    poses.write_text("".join(rows[:20] + rows[21:]))
    with pytest.raises(AllianceError, match="the log is damaged: poses.csv agrees with its seals for"):
        load(tmp_path / "run", "numpy")["poses"]



def test_data_frames_are_those_of_the_installed_library(folder):
    pandas = needed("pandas")
    for results in load(folder), load(folder, "pandas"):
        assert isinstance(results["events"], pandas.DataFrame)
    numbers = load(folder, "numpy")
    frame = load(folder, "pandas")
    for name in numbers:
        assert list(frame[name].columns) == list(numbers[name])
        for key, values in numbers[name].items():
            if values.dtype.kind == "f":
                assert np.array_equal(frame[name][key].to_numpy(float), values, equal_nan=True)
    polars = needed("polars")
    assert isinstance(load(folder, "polars")["poses"], polars.DataFrame)


def test_without_a_library_load_returns_arrays(folder, monkeypatch):
    for library in "pandas", "polars":
        monkeypatch.setitem(sys.modules, library, None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert isinstance(load(folder)["events"], dict)


def test_an_incomplete_table_is_read_up_to_its_last_complete_line(folder, tmp_path):
    whole = (folder / "poses.csv").read_text()
    (tmp_path / "poses.csv").write_text(whole[: len(whole) // 2 + 7])
    rows = len(load(tmp_path, "numpy").poses["t_ms"])
    assert rows == whole[: len(whole) // 2 + 7].count("\n") - 1


def test_missing_tables_are_reported(folder, tmp_path):
    with pytest.raises(FileNotFoundError, match="there are no tables; name the folder of a run"):
        load(tmp_path)
    with pytest.raises(KeyError, match="has no table 'event'; it has "):
        load(folder)["event"]
    with pytest.raises(AttributeError, match="has no table 'evnts'"):
        load(folder).evnts
    with pytest.raises(ValueError, match="frame: there is no 'excel'; use pandas, polars or numpy"):
        load(folder, "excel")


@pytest.fixture(scope="module")
def odd_names(tmp_path_factory):
    """A run of robots whose names look like numbers and missing values."""
    folder = tmp_path_factory.mktemp("runs") / "odd"
    names = ["01", "1", "1e1", "true", "None", "nan"]
    scenario = {
        "limit_s": 20.0,
        "service": {"kinds": [{"name": "1e3", "work_s": {"min": 1.0, "max": 2.0}}], "random": [{"n": 6}]},
        "robots": [{"name": name} for name in names],
    }
    run(scenario, {"*": "nearest"}, log=folder)
    return folder, names


@pytest.mark.parametrize("frame", ["numpy", "pandas", "polars"])
def test_names_are_texts(odd_names, frame):
    folder, names = odd_names
    if frame != "numpy":
        needed(frame)
    results = load(folder, frame)
    assert list(results.poses["robot"])[: len(names)] == names
    assert set(results.events["robot"]) <= {*names, ""}
    assert set(results.messages["sender"]) <= set(names) and set(results.messages["receiver"]) <= set(names)
    # The other columns keep their types.
    assert sum(results.poses["t_ms"]) > 0 and sum(results.poses["x_m"]) > 0.0
    assert set(results.poses["carrying"]) == {False}


def test_names_are_as_in_parquet(odd_names, alliance):
    folder, _ = odd_names
    polars = needed("polars")
    alliance("export", str(folder), "--parquet")
    results = load(folder, "polars")
    for path in (folder / "parquet").glob("*.parquet"):
        expected = polars.read_parquet(path)
        texts = [name for name, type in expected.schema.items() if type == polars.String]
        table = results[path.stem]
        assert [name for name, type in table.schema.items() if type == polars.String] == texts, path.stem
        assert table.select(texts).equals(expected.select(texts)), path.stem


def test_load_reads_a_comparison(alliance, tmp_path):
    plan = """
question = "Which of two?"
seeds = 3
[grid]
allocator = ["nearest", "random"]
[missions."01"]
scenario = "waste-cleanup"
set = { limit_s = 20.0 }
[faults.none]
"""
    (tmp_path / "plan.toml").write_text(plan)
    alliance("compare", "plan.toml", "--out=compared")
    results = load(tmp_path / "compared", "numpy")
    assert set(results["cells"]["allocator"]) == {"nearest", "random"}
    assert len(results["results"]["seed"]) == 6
    # The name of the mission looks like a number.
    assert set(results["results"]["mission"]) == set(results["cells"]["mission"]) == {"01"}
