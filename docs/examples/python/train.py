"""Trains weights for the allocator `learned` with an evolution strategy: python3 train.py FILE [GENERATIONS [PROCESSES]].

By default there are 6 generations in 2 processes.

A candidate is a linear score of 9 features. Its loss is the mean time from a point's arrival to its end in missions of `service` on drawn
layouts, in logarithms so that all sizes count the same. In half of the missions a robot is killed or messages are lost. Every candidate of
a generation has the same missions. The same number of generations gives the same file
to the byte, with any number of processes.
"""

import json
import struct
import sys
import time
from multiprocessing import Pool

import numpy as np

from alliance_sim import math, run

#: Shapes of the tensors. More layers, such as (8, 9), (8,), (1, 8), (1,), need more generations.
SHAPES = {"0.weight": (1, 9), "0.bias": (1,)}
#: Weights that stay 0: age and claims. With them, robots at one place can give up a shared task at the same time, again and again.
FIXED = [3, 4]
NUMBERS = sum(int(np.prod(shape)) for shape in SHAPES.values())
SIZES = [(3, 9), (6, 18)]
LIMIT_S = 400.0
FAULTS = [
    [],
    [{"fault": {"drop": {"p": 0.4}}, "at_s": 0.0}],
    [{"fault": {"kill": "r1"}, "at_s": 30.0}],
    [],
]
CANDIDATES, BEST, MISSIONS = 10, 3, 4


def safetensors(tensors):
    """Returns a file in the format safetensors, as `safetensors.numpy.save` does."""
    header, numbers = {}, b""
    for name, tensor in tensors.items():
        begin = len(numbers)
        numbers += np.ascontiguousarray(tensor, "<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [begin, len(numbers)]}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + numbers


def file_of(vector):
    """Returns the file of a candidate, which is a vector of all its weights."""
    parts = np.split(vector, np.cumsum([int(np.prod(shape)) for shape in SHAPES.values()])[:-1])
    return safetensors({name: part.reshape(shape) for (name, shape), part in zip(SHAPES.items(), parts, strict=True)})


def scenario(robots, size):
    """Returns the scenario `service` of this size as a dict, without absent values."""

    def stated(value):
        if isinstance(value, dict):
            return {key: stated(below) for key, below in value.items() if below is not None}
        return [stated(below) for below in value] if isinstance(value, list) else value

    return stated(run("service", seed=1, limit=0.1, robots=robots, size=size).file["scenario"])


def response_s(mission, allocator, seed, faults):
    """Returns the mean time from a point's arrival to its end in a run, s. For open points the end is that of the run."""
    result = run(mission, {"*": allocator}, seed, faults=faults, limit=LIMIT_S, randomise={"layout"}).result
    done, left = result["done"], result["open"]
    mean_ms = result["response"]["mean_ms"] or 0.0
    return (mean_ms * done / 1000 + LIMIT_S * left) / (done + left)


def loss(task):
    """Returns the loss of a candidate in the missions of a generation."""
    vector, seeds = task
    allocators = {"learned": {"weights": "hex:" + file_of(vector).hex()}}
    times = []
    for seed in seeds:
        mission = {**MISSION[seed // len(FAULTS) % len(SIZES)], "allocators": allocators}
        times.append(response_s(mission, "learned", seed, FAULTS[seed % len(FAULTS)]))
    # In this order and with these functions, all machines have the same bits.
    return sum(map(math.log, times)) / len(times)


MISSION = [scenario(*size) for size in SIZES]


def best_of(candidates, losses):
    """Returns the candidates with the least losses. Of equal ones the first is better: the default sort of NumPy depends on the processor."""
    return candidates[np.argsort(losses, kind="stable")[:BEST]]


def main(path, generations=6, processes=2):
    rng, began = np.random.default_rng(1), time.monotonic()
    mean, spread = np.zeros(NUMBERS), np.full(NUMBERS, 1.0)
    spread[FIXED] = 0.0
    with Pool(processes) as pool:
        for generation in range(generations):
            # Seeds of the training begin at 1,000.
            seeds = [1000 + MISSIONS * generation + number for number in range(MISSIONS)]
            candidates = mean + spread * rng.standard_normal((CANDIDATES, NUMBERS))
            candidates[0] = mean
            losses = np.array(pool.map(loss, [(candidate, seeds) for candidate in candidates], chunksize=1))
            best = best_of(candidates, losses)
            mean = 0.4 * mean + 0.6 * best.mean(0)
            spread = np.maximum(0.6 * spread + 0.4 * best.std(0), 0.1)
            spread[FIXED] = 0.0
            seconds = time.monotonic() - began
            print(f"{generation + 1:3} mean {np.exp(losses[0]):6.1f} s, best {np.exp(losses.min()):6.1f} s, after {seconds:4.0f} s", flush=True)
            with open(path, "wb") as file:
                file.write(file_of(mean))


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:4]))
