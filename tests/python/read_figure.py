"""Runs the example that draws figure 4.9, and prints its curves as JSON: {ROBOT: [[s, motivation], …]}.

    read_figure.py EXAMPLE RUN PICTURE
"""

import json
import runpy
import sys

import matplotlib

matplotlib.use("Agg")


def main(example, run, picture):
    sys.argv = [example, run, picture]
    panels = runpy.run_path(example)["panels"][:, 0]
    curves = {}
    for panel in panels:
        (curve,) = [line for line in panel.lines if line.get_label() == "motivation"]
        curves[panel.get_ylabel()] = curve.get_xydata().tolist()
    print(json.dumps(curves))


if __name__ == "__main__":
    main(*sys.argv[1:])
