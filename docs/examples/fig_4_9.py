"""Draws figure 4.9 of the thesis from the Parquet tables of a run: each robot's motivation to move a spill.

    alliance run thesis-no-interruption
    alliance export runs/latest --parquet
    python fig_4_9.py runs/latest fig_4_9.png

Needs pandas with pyarrow, and matplotlib. The cells (# %%) can be run in a notebook.
"""

# %% Input and output
import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

run = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/latest")
picture = sys.argv[2] if len(sys.argv) > 2 else "fig_4_9.png"
behavior_set = sys.argv[3] if len(sys.argv) > 3 else "move-spill(top)"

# %% Table with a row per tick, robot and behavior set
motivations = pd.read_parquet(run / "parquet" / "motivations.parquet")
motivations["t_s"] = motivations["t_ms"] / 1000
threshold = json.loads((run / "run.json").read_text())["alliance"]["threshold"]

# %% One panel per robot, as in the thesis
levels = motivations[motivations["behavior_set"] == behavior_set]
robots = list(levels["robot"].unique())
figure, panels = plt.subplots(len(robots), sharex=True, sharey=True, figsize=(10, 1.9 * len(robots)), squeeze=False)
colors = {"blue": "#1854a8", "gold": "#de9e00", "green": "#268c54"}
for panel, robot in zip(panels[:, 0], robots):
    level = levels[levels["robot"] == robot].set_index("t_s")
    color = colors.get(robot, "black")
    top = 1.05 * threshold
    panel.fill_between(level.index, top, where=level["state"] == "active", color=color, alpha=0.25, lw=0, label="active")
    panel.fill_between(
        level.index, top, where=level["state"] == "waiting", facecolor="none", edgecolor=color, hatch="///", lw=0, label="waiting"
    )
    panel.axhline(threshold, color="gray", lw=0.8, ls="--")
    panel.plot(level.index, level["motivation"], color=color, lw=1.2, label="motivation")
    panel.set_ylabel(robot)
    panel.set_ylim(0, top)
    panel.margins(x=0)
panels[0, 0].set_title(behavior_set, loc="left")
panels[0, 0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, fontsize="small", frameon=False)
panels[-1, 0].set_xlabel("simulated time, s")
figure.tight_layout()
figure.savefig(picture, dpi=150)
