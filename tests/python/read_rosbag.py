"""Compares a bag of ROS 2 with the log of its run. Prints facts about it as JSON.

    read_rosbag.py RUN BAG

Two independent readers decode every message: `rosbags` and `mcap-ros2-support`.
"""

import csv
import json
import math
import struct
import sys
from collections import defaultdict
from itertools import groupby
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.typesys import Stores, get_typestore

from ros_texts import check_texts

# The versions of ROS whose types the bag has.
STORES = [Stores.ROS2_HUMBLE, Stores.ROS2_IRON, Stores.ROS2_JAZZY, Stores.ROS2_KILTED]
LATCHED = {"/tf_static", "/markers", "/map", "/alliance/tasks", "/alliance/allocations", "/alliance/faults"}
# The first time of a bag, ns.
START_NS = 1
# A constant of Marker that ROS 2 Humble does not have.
NEWER = "int32 ARROW_STRIP=12\n"
ADD, DELETE = 0, 2


def equal(found, expected, what):
    if found != expected:
        sys.exit(f"{what}: {found!r} is not {expected!r}")


def near(found, expected, what, tolerance=1e-6):
    if not abs(found - expected) <= tolerance:
        sys.exit(f"{what}: {found!r} is not {expected!r}")


def rows(folder, table):
    with open(folder / f"{table}.csv", newline="") as file:
        return list(csv.DictReader(file))


def single(text):
    """Returns a number after rounding to single precision."""
    return struct.unpack("<f", struct.pack("<f", float(text)))[0]


def t_ms(time_ns):
    """Returns the simulated time of a message, ms."""
    whole, rest = divmod(time_ns - START_NS, 1_000_000)
    equal(rest, 0, f"rest of the time {time_ns} ns")
    return whole


def stamp_ns(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def heading(rotation):
    equal((rotation.x, rotation.y), (0.0, 0.0), "tilt")
    return 2 * math.atan2(rotation.z, rotation.w)


def read(path):
    """Reads every message with `rosbags`, and checks types, hashes, order and bytes. Returns messages by topic."""
    stores = [get_typestore(store) for store in STORES]
    found, last, total = defaultdict(list), 0, 0
    with AnyReader([path]) as reader:
        facts = {
            "message_count": reader.message_count,
            "start_ns": reader.start_time,
            "types": sorted({connection.msgtype for connection in reader.connections}),
            "topics": {connection.topic: connection.msgcount for connection in reader.connections},
        }
        for connection in reader.connections:
            for store in stores:
                hash = store.hash_rihs01(connection.msgtype)
                equal(connection.digest, hash, f"type hash of {connection.topic}")
                definition, _ = store.generate_msgdef(connection.msgtype, ros_version=2)
                equal(lines(connection.msgdef.data), lines(definition), f"definition of {connection.msgtype}")
            # The reader's own types come from the definitions in the file.
            equal(reader.typestore.hash_rihs01(connection.msgtype), connection.digest, "hash of the definition")
            (qos,) = connection.ext.offered_qos_profiles
            latched = connection.topic in LATCHED or connection.topic.endswith("/status")
            durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
            equal((qos.durability, qos.reliability), (durability, QosReliability.RELIABLE), connection.topic)
        for connection, time, raw in reader.messages():
            raw = bytes(raw)
            message = reader.deserialize(raw, connection.msgtype)
            equal(bytes(reader.typestore.serialize_cdr(message, connection.msgtype)), raw, f"bytes of {connection.topic}")
            equal(time >= last, True, "order of times")
            found[connection.topic].append((time, message))
            last, total = time, total + 1
    equal(total, facts["message_count"], "messages")
    for topic, count in facts["topics"].items():
        equal(len(found[topic]), count, f"messages of {topic}")
    return facts, found


def lines(definition):
    """Returns the lines of each type in a definition. Readers accept the types in any order."""
    parts = definition.replace(NEWER, "").split("=" * 80 + "\nMSG: ")
    return parts[0].split(), sorted(part.split() for part in parts[1:])


def read_again(path, messages):
    """Reads every message with `mcap-ros2-support` and compares times, and texts of messages without numbers."""
    (file,) = path.glob("*.mcap")
    found = defaultdict(list)
    with open(file, "rb") as opened:
        reader = make_reader(opened, decoder_factories=[DecoderFactory()])
        equal(reader.get_header().profile, "ros2", "profile")
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append((message.log_time, decoded))
    equal({topic: len(of) for topic, of in found.items()}, {topic: len(of) for topic, of in messages.items() if of}, "topics")
    for topic, decoded in found.items():
        for (time, one), (other_time, other) in zip(decoded, messages[topic]):
            equal(time, other_time, f"time of {topic}")
            if topic.startswith("/alliance/"):
                equal(one.data, other.data, topic)
            elif topic.endswith("/ground_truth"):
                equal(position(one), position(other), topic)
    (metadata,) = (record for record in metadata_of(file) if record.name == "run")
    return metadata.metadata


def metadata_of(file):
    with open(file, "rb") as opened:
        yield from make_reader(opened).iter_metadata()


def position(odometry):
    place = odometry.pose.pose.position
    return place.x, place.y, place.z


def ros_name(robot):
    return robot.replace("-", "_")


def compare_poses(folder, messages):
    """Compares every row of poses.csv with the ground truth and the frames. Returns the true pose by robot and time."""
    frames = {}
    for time, message in messages["/tf"]:
        frames[t_ms(time)] = {frame.child_frame_id: frame for frame in message.transforms}
        for frame in message.transforms:
            equal((stamp_ns(frame.header.stamp), frame.header.frame_id), (time, "map"), "header of a frame")
    poses = rows(folder, "poses")
    end_ms = max(frames)
    truth = {}
    for robot, of_robot in groupby(sorted(poses, key=lambda row: row["robot"]), key=lambda row: row["robot"]):
        of_robot = list(of_robot)
        name = ros_name(robot)
        found = messages[f"/{name}/ground_truth"]
        # The final poses have no row.
        equal(len(found) - len(of_robot), int(t_ms(found[-1][0]) == end_ms), f"poses of {robot}")
        for (time, message), row in zip(found, of_robot):
            equal((t_ms(time), stamp_ns(message.header.stamp)), (int(row["t_ms"]), time), f"time of {robot}")
            equal(message.child_frame_id, f"{name}/base_link", "frame")
            place = message.pose.pose.position
            equal((place.x, place.y), (single(row["x_m"]), single(row["y_m"])), f"place of {robot} at {row['t_ms']}")
            turned = heading(message.pose.pose.orientation)
            near(math.remainder(turned - float(row["heading_rad"]), math.tau), 0.0, f"heading of {robot}")
            equal(message.twist.twist.linear.x, single(row["speed_m_s"]), f"speed of {robot}")
            frame = frames[t_ms(time)][f"{name}/base_link"]
            equal((frame.transform.translation.x, frame.transform.translation.y), (place.x, place.y), "frame")
            truth[robot, t_ms(time)] = (place.x, place.y, turned)
    return truth


def compare_odometry(messages, robots, truth):
    """Returns by robot: the number of readings, the times without one, and the times at which one is false."""
    found = {}
    for robot in robots:
        measured = {t_ms(time): message for time, message in messages[f"/{ros_name(robot)}/odom"]}
        false = []
        for time, message in measured.items():
            place = message.pose.pose.position
            if (place.x, place.y) != truth[robot, time][:2]:
                false.append(time)
        times = [time for of, time in truth if of == robot]
        missing = [time for time in times if time not in measured]
        found[robot] = {"readings": len(measured), "missing": missing, "false": false}
    return found


def compare_scans(messages, robots, truth, scenario):
    """Checks that the beams of scans that meet something are in the cloud of all beams. Returns counts."""
    radius = scenario["body"]["radius_m"]
    counts = {"scans": 0, "hits": 0, "points": 0, "border": 0}
    for robot in robots:
        name = ros_name(robot)
        clouds = dict(messages[f"/{name}/avoidance"])
        for time, scan in messages[f"/{name}/scan"]:
            equal(scan.header.frame_id, f"{name}/beams", "frame of a scan")
            counts["scans"] += 1
            cloud = clouds[time]
            points = [point[:2] for point in struct.iter_unpack("<3f", cloud.data.tobytes())]
            equal(len(points), cloud.width, "points")
            counts["points"] += len(points)
            for index in (0, 2):
                distance = float(scan.ranges[index])
                if math.isfinite(distance):
                    angle = scan.angle_min + index * scan.angle_increment
                    end = distance * math.cos(angle), distance * math.sin(angle)
                    equal(any(math.dist(end, point) < 1e-5 for point in points), True, f"beam of {robot}")
                    equal(radius - 1e-6 <= distance <= scan.range_max + 1e-6, True, "range")
                    counts["hits"] += 1
        room = scenario["room"]
        for time, scan in messages[f"/{name}/border"]:
            for index, distance in enumerate(map(float, scan.ranges)):
                if math.isfinite(distance):
                    x, y, turned = truth[robot, t_ms(time)]
                    angle = turned + scan.angle_min + index * scan.angle_increment
                    x, y = x + distance * math.cos(angle), y + distance * math.sin(angle)
                    near(min(x, y, room["width_m"] - x, room["height_m"] - y), 0.0, "border", 1e-3)
                    counts["border"] += 1
    return counts


def compare_events(folder, messages):
    events = rows(folder, "events")
    found = messages["/alliance/events"]
    equal(len(found), len(events), "events")
    for (time, message), row in zip(found, events):
        event = json.loads(message.data)
        equal(t_ms(time), event["t_ms"], "time of an event")
        equal({key: str(value) for key, value in event.items()}, row, "event")
    return len(events)


def compare_allocations(folder, messages, step_ms):
    """Compares the latest allocation after each step with the behavior set in the step's row of poses.csv."""
    changes = [(t_ms(time), json.loads(message.data)) for time, message in messages["/alliance/allocations"]]
    tasks = [(t_ms(time), json.loads(message.data)) for time, message in messages["/alliance/tasks"]]
    for of in changes, tasks:
        for time, state in of:
            equal(state["t_ms"], time, "time of a state")
    for row in rows(folder, "poses"):
        time = int(row["t_ms"]) + step_ms
        robots = {robot["robot"]: robot for robot in latest(changes, time)["robots"]}
        equal(robots[row["robot"]]["behavior_set"] or "", row["behavior_set"], f"{row['robot']} at {time}")
        task = robots[row["robot"]]["task"]
        executing = {task["task"] for task in latest(tasks, time)["tasks"] if row["robot"] in task["robots"]}
        equal(executing, {task} if task else set(), f"task of {row['robot']} at {time}")
    return len(changes)


def latest(states, time):
    """Returns the state at a time. Times are asked for in any order, so the search is from the end of a sorted list."""
    low, high = 0, len(states)
    while low < high:
        middle = (low + high) // 2
        if states[middle][0] <= time:
            low = middle + 1
        else:
            high = middle
    return states[low - 1][1]


def compare_markers(folder, messages):
    """Returns the numbers of obstacles over time, and the texts at robots."""
    shown, obstacles, texts = {}, [], defaultdict(list)
    for time, message in messages["/markers"]:
        drawn = set()
        for marker in message.markers:
            key = marker.ns, marker.id
            if marker.action == DELETE:
                equal(key in shown, True, f"deleted {key}")
                del shown[key]
                continue
            equal((marker.action, stamp_ns(marker.header.stamp)), (ADD, time), "marker")
            equal(min(marker.scale.x, marker.scale.y) > 0 or bool(marker.text), True, f"size of {key}")
            shown[key] = marker
            drawn.add(key)
            if marker.ns == "activities" and marker.text not in texts[marker.header.frame_id][-1:]:
                texts[marker.header.frame_id].append(marker.text)
        equal(set(shown), drawn, "each message has the whole scene")
        count = sum(ns == "obstacles" for ns, _ in shown)
        if not obstacles or obstacles[-1][1] != count:
            obstacles.append([t_ms(time), count])
    return obstacles, texts


def compare_maps(messages, scenario):
    """Checks the size of the maps. Returns the number of cells by value in each."""
    found = []
    for time, grid in messages["/map"]:
        info = grid.info
        equal(len(grid.data), info.width * info.height, "cells")
        near((info.width - 2) * info.resolution, scenario["room"]["width_m"], "width of the map", info.resolution)
        near((info.height - 2) * info.resolution, scenario["room"]["height_m"], "height of the map", info.resolution)
        values = [int(value) for value in grid.data]
        found.append([t_ms(time), {value: values.count(value) for value in sorted(set(values))}])
    return found


def main(folder, path):
    run = json.loads((folder / "run.json").read_text())
    scenario = run["scenario"]
    robots = [robot["name"] for robot in scenario["robots"]]
    facts, messages = read(path)
    facts["run"] = read_again(path, messages)
    for kind in ("tasks", "allocations", "faults", "events"):
        check_texts(kind, [message.data for _, message in messages[f"/alliance/{kind}"]])
    ticks = [t_ms(time) for time, _ in messages["/clock"]]
    equal(ticks, [scenario["step_ms"] * tick for tick in range(len(ticks))], "times of /clock")
    for time, message in messages["/clock"]:
        equal(stamp_ns(message.clock), time, "/clock")
    truth = compare_poses(folder, messages)
    obstacles, texts = compare_markers(folder, messages)
    (static,) = messages["/tf_static"]
    equal([frame.header.frame_id for frame in static[1].transforms], [f"{ros_name(robot)}/base_link" for robot in robots], "/tf_static")
    facts |= {
        "poses": len(truth),
        "end_ms": ticks[-1],
        "odometry": compare_odometry(messages, robots, truth),
        "scans": compare_scans(messages, robots, truth, scenario),
        "events": compare_events(folder, messages),
        "allocations": compare_allocations(folder, messages, scenario["step_ms"]),
        "obstacles": obstacles,
        "texts": texts,
        "maps": compare_maps(messages, scenario),
        "faults": [json.loads(message.data) for _, message in messages["/alliance/faults"]],
        "levels": {
            robot: [level for level, _ in groupby(int(message.status[0].level) for _, message in messages[f"/{ros_name(robot)}/status"])]
            for robot in robots
        },
    }
    print(json.dumps(facts))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
