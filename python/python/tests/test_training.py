"""Trainings: that of `learned` is repeatable, and the weights of the recipes are better than their baselines."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import recipe_curves
import recipes
import train
from conftest import EXAMPLES

TRAIN = """
import train
train.CANDIDATES, train.MISSIONS, train.LIMIT_S = 5, 4, 60.0
train.main({file!r}, 3, {parallel})
"""


def trained(folder, parallel, hash_seed):
    """Returns the file of a training in a process of its own."""
    file = folder / f"{parallel}-{hash_seed}"
    code = TRAIN.format(file=str(file), parallel=parallel)
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(EXAMPLES)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment, timeout=600)
    return file.read_bytes()


def test_a_training_of_learned_is_repeatable(tmp_path):
    one = trained(tmp_path, 1, "0")
    assert one == trained(tmp_path, 2, "7")
    # The weights have moved.
    assert one != train.file_of(np.zeros(train.NUMBERS))


def test_equal_losses_have_the_order_of_their_candidates():
    candidates = np.arange(64.0)[:, None]
    losses = np.ones(64)
    losses[[40, 9]] = 0.5
    assert train.best_of(candidates, losses).ravel().tolist() == [9.0, 40.0, 0.0]


@pytest.mark.parametrize("mission", recipes.MISSIONS)
def test_the_weights_of_a_recipe_are_better_than_idle_and_random_robots(mission, monkeypatch):
    monkeypatch.setattr(recipes, "TESTS", 8)
    trained = recipes.test(mission, json.loads((EXAMPLES / f"recipes/{mission}.json").read_text())).mean()
    found = recipes.baselines(mission)
    # In observe, the allocator `random` chooses between two sets that exclude each other, so it is as good as any other.
    beaten = ["idle", "random actions"] + ["allocator random"] * (mission != "observe")
    for name in beaten:
        assert trained > found[name].mean(), name


def test_the_curves_of_a_recipe_are_kept_and_have_the_range_of_their_seeds(tmp_path, monkeypatch, capsys):
    for name, value in {"TESTS": 4, "POLICIES": 4, "BEST": 2, "EPISODES": 2, "GENERATIONS": 2}.items():
        monkeypatch.setattr(recipes, name, value)
    monkeypatch.setattr(recipe_curves, "SHOWN", (1, 2))
    recipe_curves.main(tmp_path, [1, 2], "push")
    first = capsys.readouterr().out
    last = [np.mean(json.loads((tmp_path / f"push-{seed}.json").read_text())["scores"][-1]) for seed in (1, 2)]
    assert f"| trained, after 2 | {np.mean(last):.2f} [{min(last):.2f} .. {max(last):.2f}] |" in first
    # A second call trains nothing.
    monkeypatch.setattr(recipes, "train", None)
    recipe_curves.main(tmp_path, [1, 2], "push")
    assert capsys.readouterr().out == first
