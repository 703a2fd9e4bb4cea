"""Checks that a bag has the topics of an RViz layout with the right types. Prints the topics as JSON.

    read_rviz.py LAYOUT BAG
"""

import json
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML

# The types that the displays of RViz subscribe to.
TYPES = {
    "rviz_default_plugins/LaserScan": "sensor_msgs/msg/LaserScan",
    "rviz_default_plugins/Map": "nav_msgs/msg/OccupancyGrid",
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
    "rviz_default_plugins/Odometry": "nav_msgs/msg/Odometry",
    "rviz_default_plugins/PointCloud2": "sensor_msgs/msg/PointCloud2",
}
# The numbers of durabilities in metadata.yaml.
DURABILITIES = {"Transient Local": 1, "Volatile": 2}


def main(layout, bag):
    manager = YAML(typ="safe").load(layout.read_text())["Visualization Manager"]
    if manager["Global Options"]["Fixed Frame"] != "map":
        sys.exit("the fixed frame is not map")
    with AnyReader([bag]) as reader:
        connections = {connection.topic: connection for connection in reader.connections}
    found = []
    for display in manager["Displays"]:
        if "Topic" not in display:
            continue
        topic = display["Topic"]["Value"]
        connection = connections.get(topic)
        if connection is None or connection.msgtype != TYPES[display["Class"]]:
            sys.exit(f"{display['Class']} of {topic}: {connection}")
        # A volatile publisher does not match a subscriber for late messages.
        offered = connection.ext.offered_qos_profiles[0].durability.value
        if offered > DURABILITIES[display["Topic"]["Durability Policy"]]:
            sys.exit(f"durability of {topic}")
        found.append(topic)
    print(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
