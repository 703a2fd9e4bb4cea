"""Compares an MCAP file with the log of its run, message by message, with the usual reader libraries. Prints the result as JSON.

    read_mcap.py FOLDER FILE
"""

import json
import math
import struct
import sys
from collections import Counter, defaultdict
from itertools import groupby
from pathlib import Path

from google.protobuf.descriptor import FieldDescriptor
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from runlog import rows, single

# The columns that determine the topic of a row.
TOPICS = {
    "motivations": ("robot", "behavior_set"),
    "allocation": ("robot", "behavior_set"),
    "poses": ("robot",),
    "messages": (),
    "events": (),
    "mission": (),
    "targets": ("target",),
}
WARNINGS = {"gone", "stalled", "lost", "energy-out", "applied", "hit", "failed"}

VALUES = {
    FieldDescriptor.TYPE_UINT64: int,
    FieldDescriptor.TYPE_UINT32: int,
    FieldDescriptor.TYPE_DOUBLE: float,
    FieldDescriptor.TYPE_FLOAT: single,
    FieldDescriptor.TYPE_BOOL: {"0": False, "1": True}.__getitem__,
    FieldDescriptor.TYPE_STRING: str,
}


def equal(found, expected, where):
    if found != expected:
        sys.exit(f"{where}: {found!r} is not {expected!r}")


def near(found, expected, where, most=1e-6):
    if not abs(found - expected) <= most:
        sys.exit(f"{where}: {found!r} is not about {expected!r}")


def read(path):
    """Returns the metadata, and the messages of each topic as (ns, message) in file order."""
    topics = defaultdict(list)
    latest = 0
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        for channel in summary.channels.values():
            topics[channel.topic] = []
        for _, channel, header, message in reader.iter_decoded_messages(log_time_order=False):
            equal(header.publish_time, header.log_time, channel.topic)
            equal(header.sequence, len(topics[channel.topic]) + 1, channel.topic)
            # The delivery of a message may be recorded later.
            if channel.topic != "/messages":
                equal(header.log_time >= latest, True, f"the order of {channel.topic} at {header.log_time}")
                latest = max(latest, header.log_time)
            topics[channel.topic].append((header.log_time, message))
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    equal(summary.statistics.message_count, sum(map(len, topics.values())), "message count")
    return metadata, topics


def compare_table(folder, table, topics):
    """Checks that each row has a message with the same values and time, in order. Returns the number of rows."""
    header, lines = rows(folder, table)
    of_topic = defaultdict(list)
    for line in lines:
        names = [line[header.index(column)] for column in TOPICS[table]]
        of_topic["/".join(["", table, *names])].append(line)
    there = {topic for topic in topics if topic == f"/{table}" or topic.startswith(f"/{table}/")}
    equal(set(of_topic) - there, set(), f"topics of {table}")
    for topic in there:
        messages = topics[topic]
        equal(len(messages), len(of_topic[topic]), f"messages of {topic}")
        for (time, message), line in zip(messages, of_topic[topic]):
            fields = message.DESCRIPTOR.fields
            equal([field.name for field in fields], header, f"columns of {topic}")
            equal(time, int(line[0]) * 1_000_000, f"time of {topic}")
            for field, text in zip(fields, line):
                if field.has_presence and not message.HasField(field.name):
                    equal("", text, f"{topic} {field.name}")
                else:
                    equal(getattr(message, field.name), VALUES[field.type](text), f"{topic} {field.name} at {line[0]}")
    return len(lines)


def places(topics):
    """Returns the pose of each robot by time in ms: (x, y, heading)."""
    found = {}
    for time, message in topics["/tf"]:
        robots = found[time // 1_000_000] = {}
        for frame in message.transforms:
            equal(frame.timestamp.ToNanoseconds(), time, "stamp of /tf")
            equal(frame.parent_frame_id, "world", "parent")
            robots[frame.child_frame_id] = (
                frame.translation.x,
                frame.translation.y,
                2 * math.atan2(frame.rotation.z, frame.rotation.w),
            )
    return found


def compare_places(folder, places, step_ms):
    equal(list(places), [step_ms * tick for tick in range(len(places))], "times of /tf")
    header, lines = rows(folder, "poses")
    for line in lines:
        row = dict(zip(header, line))
        x, y, heading = places[int(row["t_ms"])][row["robot"]]
        equal((x, y), (single(row["x_m"]), single(row["y_m"])), f"place of {row['robot']} at {row['t_ms']}")
        near(math.remainder(heading - float(row["heading_rad"]), math.tau), 0.0, "heading")


def scene(topics):
    """Returns the states of each topic below /scene as (ms, entity)."""
    found = {}
    for topic, messages in topics.items():
        if topic.startswith("/scene/"):
            states = found[topic.removeprefix("/scene/")] = []
            for time, message in messages:
                (entity,) = message.entities
                equal(len(message.deletions), 0, topic)
                equal(entity.timestamp.ToNanoseconds(), time, topic)
                equal(entity.frame_locked, True, topic)
                states.append((time // 1_000_000, entity))
    return found


def at(states, t_ms):
    """Returns the state at a time, as after a seek."""
    latest = None
    for time, entity in states:
        if time > t_ms:
            break
        latest = entity
    return latest


def compare_items(folder, scene, step_ms):
    """Checks the items. A row of mission.csv has the items after its step, at the start of the next step."""
    header, lines = rows(folder, "mission")
    if "items_carried" not in header:
        return
    for line in lines:
        row = dict(zip(header, map(lambda text: int(text or 0), line)))
        after = row["t_ms"] + step_ms
        on_floor = row["items_in_spills"] + row["items_on_floor"] + row["items_delivered"]
        equal(len(at(scene["items"], after).spheres), on_floor, f"items at {after}")
        carried = 0
        for name, states in scene.items():
            robot = at(states, after) if name.startswith("robots/") else None
            carried += len(robot.spheres) if robot else 0
        equal(carried, row["items_carried"], f"carried items at {after}")


def distance_to_solid(point, obstacles, places, own_name, scenario):
    """Returns the distance from a point to the surface of the nearest other solid, negative inside."""
    x, y = point
    room, radius = scenario["room"], scenario["body"]["radius_m"]
    distances = [x, y, room["width_m"] - x, room["height_m"] - y]
    for name, (robot_x, robot_y, _) in places.items():
        if name != own_name:
            distances.append(math.hypot(robot_x - x, robot_y - y) - radius)
    for cube in obstacles.cubes if obstacles else ():
        if cube.color.a == 1.0:
            out_x = abs(x - cube.pose.position.x) - cube.size.x / 2
            out_y = abs(y - cube.pose.position.y) - cube.size.y / 2
            distances.append(math.hypot(max(out_x, 0), max(out_y, 0)) + min(max(out_x, out_y), 0))
    return min(distances)


def compare_sensors(topics, scene, places, scenario):
    """Checks that sensor beams end at a solid. Returns the number of points per device."""
    found = Counter()
    radius = scenario["body"]["radius_m"]
    for topic, messages in topics.items():
        if not topic.startswith("/sensors/"):
            continue
        _, _, robot, device = topic.split("/")
        for time, message in messages:
            t_ms = time // 1_000_000
            equal(message.timestamp.ToNanoseconds(), time, topic)
            equal(message.frame_id, robot, topic)
            x, y, heading = places[t_ms][robot]
            if device == "border":
                angles = (message.start_angle, message.end_angle)
                points = [
                    (distance * math.cos(angle), distance * math.sin(angle))
                    for distance, angle in zip(message.ranges, angles)
                    if math.isfinite(distance)
                ]
            else:
                equal([field.name for field in message.fields], ["x", "y", "z"], topic)
                points = [point[:2] for point in struct.iter_unpack("<3f", message.data)]
            for ahead, left in points:
                point = (
                    x + ahead * math.cos(heading) - left * math.sin(heading),
                    y + ahead * math.sin(heading) + left * math.cos(heading),
                )
                # A beam that ends at the body's edge means contact with a solid, which may be nearer.
                if max(abs(ahead), abs(left)) < radius + 1e-4:
                    continue
                distance = distance_to_solid(point, at(scene["obstacles"], t_ms), places[t_ms], robot, scenario)
                # A body stops 1 mm before contact, and so does a beam of the same width.
                near(distance, 0.0, f"{topic} at {t_ms} ms: {point}", 1.1e-3)
                found[device] += 1
    return found


def compare_log(folder, topics):
    header, lines = rows(folder, "events")
    equal(len(topics["/log"]), len(lines), "messages of /log")
    warnings = 0
    for (time, message), line in zip(topics["/log"], lines):
        row = dict(zip(header, line))
        equal(time, int(row["t_ms"]) * 1_000_000, "time of /log")
        equal(message.name, row["robot"] or "world", "name in /log")
        level = "WARNING" if row["kind"] in WARNINGS else "INFO"
        names = message.DESCRIPTOR.fields_by_name["level"].enum_type.values_by_number
        equal(names[message.level].name, level, row["kind"])
        for part in line[1:]:
            equal(part in message.message or part == row["robot"], True, f"{part!r} in {message.message!r}")
        warnings += level == "WARNING"
    return warnings


def site(marks):
    """Returns the color changes of the only rectangle among the marks as [ms, red]."""
    colors = ([time, round(entity.cubes[0].color.r, 2)] for time, entity in marks if entity.cubes)
    return [next(same) for _, same in groupby(colors, key=lambda color: color[1])]


def main(folder, path):
    run = json.loads((folder / "run.json").read_text())
    scenario = run["scenario"]
    step_ms = scenario["step_ms"]
    metadata, topics = read(path)
    tables = [table for table in TOPICS if (folder / f"{table}.csv").exists()]
    counts = {table: compare_table(folder, table, topics) for table in tables}
    where = places(topics)
    compare_places(folder, where, step_ms)
    states = scene(topics)
    compare_items(folder, states, step_ms)
    sensor_points = compare_sensors(topics, states, where, scenario)
    warnings = compare_log(folder, topics)
    labels = {
        name: [entity.texts[0].text if entity.texts else "" for _, entity in shown]
        for name, shown in states.items()
        if name.startswith("robots/")
    }
    print(
        json.dumps(
            {
                "metadata": metadata,
                "counts": counts,
                "topics": {topic: len(messages) for topic, messages in topics.items()},
                "last_ms": max(where),
                "sensed": sensor_points,
                "warnings": warnings,
                "labels": labels,
                "obstacles": [[time, len(entity.cubes)] for time, entity in states["obstacles"]],
                "marks": [text.text for text in states["marks"][0][1].texts],
                "site": site(states["marks"]),
                "threshold": [[time // 1_000_000, message.motivation] for time, message in topics["/threshold"]],
            }
        )
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
