"""Tables of runs, sweeps and comparisons as data frames."""

import sys

import numpy as np
import pytest
from alliance_sim import load, run
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
    assert results.run["scenario"]["name"] == "waste-cleanup" or results.run["result"]["ticks"] == 400


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


def test_load_reads_a_comparison(alliance, tmp_path):
    plan = """
question = "Which of two?"
seeds = 3
[grid]
allocator = ["nearest", "random"]
[missions.default]
scenario = "waste-cleanup"
set = { limit_s = 20.0 }
[faults.none]
"""
    (tmp_path / "plan.toml").write_text(plan)
    alliance("compare", "plan.toml", "--out=compared")
    results = load(tmp_path / "compared", "numpy")
    assert set(results["cells"]["allocator"]) == {"nearest", "random"}
    assert len(results["results"]["seed"]) == 6
