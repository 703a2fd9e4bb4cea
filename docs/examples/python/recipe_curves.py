"""Trains the recipes of recipes.py with several seeds, prints a table and draws the learning curves as an SVG (needs matplotlib).

    python3 recipe_curves.py FOLDER SEEDS [MISSION...]    # seeds 1 to SEEDS, all missions by default

FOLDER receives the scores of each training, and keeps them: a second call trains only what is missing. All seeds and baselines have the same
episodes of the test. A seed counts as surely better than a baseline if the 95 % interval of the paired difference is above 0.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

import recipes

COLORS = {"alliance": "#1854a8", "random": "#b0282d"}
#: Generations of the table, which are those that recipes.py prints.
SHOWN = (1, 3, 10, recipes.GENERATIONS)


def kept(file, compute):
    """Returns the content of a file, which is computed if it does not exist."""
    if not file.exists():
        file.write_text(json.dumps(compute()))
    return json.loads(file.read_text())


def training(mission, seed):
    """Returns the processor time and the scores of the test after each generation."""
    seconds, scores, began = [], [], time.process_time()
    for weights in recipes.train(mission, seed):
        seconds.append(time.process_time() - began)
        scores.append(recipes.test(mission, weights).tolist())
        # The time of the test does not count.
        began = time.process_time() - seconds[-1]
    return {"seconds": seconds, "scores": scores}


def baselines(mission):
    return {name: found.tolist() for name, found in recipes.baselines(mission).items()}


def surely_better(scores, baseline):
    differences = np.asarray(scores) - baseline
    return differences.mean() > 1.96 * differences.std() / np.sqrt(len(differences))


def table(results):
    """Yields the lines of a Markdown table: baselines with 95 % intervals, trainings with the mean and range over the seeds."""

    def line(name, cell):
        return f"| {name} | " + " | ".join(cell(mission) for mission in results) + " |"

    def interval(mission, name):
        found = np.array(results[mission]["baselines"][name])
        return f"{found.mean():.2f} ± {1.96 * found.std() / np.sqrt(found.size):.2f}"

    def learned(mission, generation):
        found = [np.mean(seed["scores"][generation - 1]) for seed in results[mission]["seeds"]]
        return f"{np.mean(found):.2f} [{min(found):.2f} .. {max(found):.2f}]"

    def better(mission, name):
        last = [seed["scores"][-1] for seed in results[mission]["seeds"]]
        baseline = results[mission]["baselines"][name]
        more, sure = sum(np.mean(one) > np.mean(baseline) for one in last), sum(surely_better(one, baseline) for one in last)
        return f"{more}, surely {sure}, of {len(last)}"

    def spent(mission):
        found = [seed["seconds"][-1] for seed in results[mission]["seeds"]]
        return f"{np.mean(found):.0f} [{min(found):.0f} .. {max(found):.0f}]"

    names = list(next(iter(results.values()))["baselines"])
    yield line("", lambda mission: f"{mission}, {recipes.UNITS[mission]}")
    yield "|---" * (1 + len(results)) + "|"
    for name in names:
        yield line(name, lambda mission: interval(mission, name))
    for generation in SHOWN:
        yield line(f"trained, after {generation}", lambda mission: learned(mission, generation))
    for name in names:
        yield line(f"seeds better than {name}", lambda mission: better(mission, name))
    yield line("processor time, s", spent)


def draw(results, file):
    """Draws a panel per mission: a line per seed, their mean, and the baselines."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update({"font.size": 8, "svg.fonttype": "none", "svg.hashsalt": "curves"})
    figure, panels = plt.subplots(1, len(results), figsize=(7.5, 2.3), layout="constrained", squeeze=False)
    for panel, (mission, found) in zip(panels[0], results.items(), strict=True):
        curves = np.mean([seed["scores"] for seed in found["seeds"]], -1)
        generations = np.arange(1, curves.shape[1] + 1)
        panel.fill_between(generations, curves.min(0), curves.max(0), color="#1b7f3b", alpha=0.2, linewidth=0, label="range of seeds")
        panel.plot(generations, curves.mean(0), color="#1b7f3b", linewidth=1.5, label=f"trained, mean of {len(curves)} seeds")
        for name, color in COLORS.items():
            panel.axhline(np.mean(found["baselines"][f"allocator {name}"]), color=color, linewidth=1, linestyle="--", label=f"allocator {name}")
        panel.axhline(np.mean(found["baselines"]["random actions"]), color="#8d897f", linewidth=1, linestyle=":", label="random actions")
        panel.set(title=f"{mission}: {recipes.UNITS[mission]}", xlabel="generation", xlim=(1, len(generations)), ylim=(0, None), xticks=(1, 5, 10, 15, 20))
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(file, metadata={"Date": None})


def main(folder, seeds, *missions):
    folder, missions = Path(folder), missions or tuple(recipes.MISSIONS)
    folder.mkdir(parents=True, exist_ok=True)
    results = {mission: {"baselines": kept(folder / f"{mission}.json", lambda: baselines(mission)), "seeds": []} for mission in missions}
    for seed in range(1, seeds + 1):
        for mission, found in results.items():
            found["seeds"].append(kept(folder / f"{mission}-{seed}.json", lambda: training(mission, seed)))
            print(f"{mission}, seed {seed}: {np.mean(found['seeds'][-1]['scores'][-1]):.2f}", file=sys.stderr, flush=True)
    print(*table(results), sep="\n")
    draw(results, folder / "curves.svg")


if __name__ == "__main__":
    words = sys.argv[1:]
    if len(words) < 2 or not words[1].isdecimal() or int(words[1]) < 1 or not set(words[2:]) <= set(recipes.MISSIONS):
        print(f"usage: recipe_curves.py FOLDER SEEDS [{'|'.join(recipes.MISSIONS)}]...", file=sys.stderr)
        sys.exit(2)
    main(words[0], int(words[1]), *words[2:])
