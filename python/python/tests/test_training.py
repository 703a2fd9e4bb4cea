"""The training of `learned` gives the same bytes again, whatever the number of processes."""

import os
import subprocess
import sys

import numpy as np
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
