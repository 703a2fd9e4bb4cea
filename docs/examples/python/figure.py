"""Figure for a paper: completion times of three allocators under message loss, with 95 % intervals, as a vector graphic of column width.

    pip install matplotlib
    python3 figure.py [FILE]            default: loss.pdf
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

from alliance_sim import load

LOSSES = [0, 30, 60, 90]
RULES = {"alliance": "o", "cbba": "s", "murdoch": "^"}
PLAN = """
seeds = 10
[grid]
allocator = ["alliance", "cbba", "murdoch"]
[missions.six]
robots = 6
size = 4
[faults.loss-0]
""" + "".join(
    f"[faults.loss-{lost}]\ntimeline = [{{ fault.drop = {{ from = 'all', to = 'all', p = {lost / 100} }}, at_s = 0.0 }}]\n"
    for lost in LOSSES[1:]
)


def compared():
    """Runs the comparison and returns its table `cells` as rows."""
    with TemporaryDirectory() as folder:
        plan = Path(folder) / "loss.toml"
        plan.write_text(PLAN)
        command = [Path(sys.executable).with_name("alliance"), "compare", plan, "--out", Path(folder) / "loss"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cells = load(Path(folder) / "loss", "numpy").cells
    return [dict(zip(cells, row)) for row in zip(*cells.values())]


def draw(rows, file):
    plt.rcParams.update({"font.size": 8, "svg.fonttype": "none", "pdf.fonttype": 42})
    figure, axes = plt.subplots(figsize=(88 / 25.4, 60 / 25.4), layout="constrained")
    for rule, marker in RULES.items():
        found = {row["faults"]: row for row in rows if row["allocator"] == rule and row["metric"] == "makespan_s"}
        cells = [found[f"loss-{lost}"] for lost in LOSSES]
        means = [cell["mean"] for cell in cells]
        below = [cell["mean"] - cell["mean_from"] for cell in cells]
        above = [cell["mean_to"] - cell["mean"] for cell in cells]
        axes.errorbar(LOSSES, means, [below, above], marker=marker, markersize=4, capsize=2, linewidth=1, label=rule)
    axes.set(xlabel="messages lost, %", ylabel="time to completion, s", xticks=LOSSES)
    axes.legend(frameon=False)
    figure.savefig(file)


if __name__ == "__main__":
    file = sys.argv[1] if len(sys.argv) > 1 else "loss.pdf"
    rows = compared()
    draw(rows, file)
    print(f"{file}: {sum(row['runs'] for row in rows if row['metric'] == 'makespan_s'):.0f} runs")
