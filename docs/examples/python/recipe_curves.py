"""Trains the recipes of recipes.py with several seeds and prints a Markdown table of the learning curves.

    python3 recipe_curves.py FOLDER SEED,SEED,... [MISSION...]    # all missions by default

FOLDER receives the scores of each training. A second call trains only what is missing. All seeds and baselines have the same episodes of the
test. A seed is surely better than a baseline if the 95 % interval of the paired difference is above 0.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import recipes

#: Generations of the table.
SHOWN = (1, 3, 10, recipes.GENERATIONS)


def kept(file, compute):
    """Returns the content of a file, which is computed if it does not exist."""
    if not file.exists():
        file.write_text(json.dumps(compute()))
    return json.loads(file.read_text())


def training(mission, seed):
    """Returns the processor time of a training, and the scores of the test after the generations of the table."""
    seconds, scores, began = 0.0, [], time.process_time()
    for generation, weights in enumerate(recipes.train(mission, seed), 1):
        seconds += time.process_time() - began
        if generation in SHOWN:
            scores.append(recipes.test(mission, weights).tolist())
        # The time of a test does not count.
        began = time.process_time()
    return {"seconds": seconds, "scores": scores}


def baselines(mission):
    return {name: found.tolist() for name, found in recipes.baselines(mission).items()}


def interval(scores):
    """Returns the mean of scores and half the width of its 95 % interval."""
    return np.mean(scores), 1.96 * np.std(scores) / np.sqrt(len(scores))


def extent(values, digits=2):
    return f"{np.mean(values):.{digits}f} [{min(values):.{digits}f} .. {max(values):.{digits}f}]"


def table(results):
    """Yields the lines of a Markdown table: baselines with 95 % intervals, trainings with the mean and range over the seeds."""

    def line(name, cell):
        return f"| {name} | " + " | ".join(map(cell, results.values())) + " |"

    def better(found, name):
        gains = [interval(np.subtract(seed["scores"][-1], found["baselines"][name])) for seed in found["seeds"]]
        return f"{sum(mean > 0 for mean, _ in gains)}, surely {sum(mean > half for mean, half in gains)}, of {len(gains)}"

    names = list(next(iter(results.values()))["baselines"])
    yield "| | " + " | ".join(f"{mission}, {recipes.UNITS[mission]}" for mission in results) + " |"
    yield "|---" * (1 + len(results)) + "|"
    for name in names:
        yield line(name, lambda found: "{:.2f} ± {:.2f}".format(*interval(found["baselines"][name])))
    for place, generation in enumerate(SHOWN):
        yield line(f"trained, after {generation}", lambda found: extent([np.mean(seed["scores"][place]) for seed in found["seeds"]]))
    for name in names:
        yield line(f"seeds better than {name}", lambda found: better(found, name))
    yield line("processor time, s", lambda found: extent([seed["seconds"] for seed in found["seeds"]], 0))


def main(folder, seeds, *missions):
    folder, missions = Path(folder), missions or tuple(recipes.MISSIONS)
    folder.mkdir(parents=True, exist_ok=True)
    results = {mission: {"baselines": kept(folder / f"{mission}.json", lambda: baselines(mission)), "seeds": []} for mission in missions}
    for seed in seeds:
        for mission, found in results.items():
            found["seeds"].append(kept(folder / f"{mission}-{seed}.json", lambda: training(mission, seed)))
            print(f"{mission}, seed {seed}: {np.mean(found['seeds'][-1]['scores'][-1]):.2f}", file=sys.stderr, flush=True)
    print(*table(results), sep="\n")


if __name__ == "__main__":
    words = sys.argv[1:]
    if len(words) < 2 or not all(map(str.isdecimal, words[1].split(","))) or not set(words[2:]) <= set(recipes.MISSIONS):
        print(f"usage: recipe_curves.py FOLDER SEED,SEED,... [{'|'.join(recipes.MISSIONS)}]...", file=sys.stderr)
        sys.exit(2)
    main(words[0], map(int, words[1].split(",")), *words[2:])
