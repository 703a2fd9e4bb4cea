"""Reads vehicle routing files with the package vrplib and prints tasks and vehicles as JSON, as an import should have them.

    read_vrplib.py FILE...
"""

import json
import sys
from pathlib import Path

import vrplib


def problem(path):
    is_solomon = "VEHICLE\n" in path.read_text()
    found = vrplib.read_instance(path, instance_format="solomon" if is_solomon else "vrplib", compute_edge_weights=False)
    depot = 0 if is_solomon else int(found["depot"][0])
    nodes = range(len(found["node_coord"]))

    def column(name, node):
        return float(found[name][node]) if name in found else None

    tasks = []
    for node in nodes:
        if node == depot:
            continue
        window = [float(time) for time in found["time_window"][node]] if "time_window" in found else None
        place = [float(at) for at in found["node_coord"][node]]
        tasks.append({"place": place, "demand": column("demand", node), "window": window, "service": column("service_time", node)})
    return {
        "name": found["name"],
        "capacity": float(found["capacity"]),
        "vehicles": found.get("vehicles"),
        "depot": [float(at) for at in found["node_coord"][depot]],
        "tasks": tasks,
    }


if __name__ == "__main__":
    print(json.dumps([problem(Path(path)) for path in sys.argv[1:]]))
