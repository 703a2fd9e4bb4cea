"""Checks that an MCAP file has messages for each topic of the layouts. Prints the topics of each layout as JSON.

    read_layouts.py FILE FOXGLOVE-LAYOUT PLOTJUGGLER-LAYOUT
"""

import json
import re
import sys
from pathlib import Path
from xml.etree import ElementTree

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def first_messages(path):
    """Returns the schema name and the first message of each topic."""
    found = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, (schema.name, message))
    return found


def check(messages, topic, field=None):
    if topic not in messages:
        sys.exit(f"no message of {topic}")
    _, message = messages[topic]
    if field is not None and field not in message.DESCRIPTOR.fields_by_name:
        sys.exit(f"{topic} has no field {field}")
    return topic


def strings(value):
    """Yields every text in a JSON document."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield key
            yield from strings(part)
    elif isinstance(value, list):
        for part in value:
            yield from strings(part)
    elif isinstance(value, str):
        yield value


def foxglove(layout, messages):
    """Checks topics, paths "TOPIC".FIELD, and that the panels match the layout."""
    topics = set()
    for text in strings(layout["configById"]):
        path = re.fullmatch(r'(?:"(/[^"]+)"|(/[\w/-]+))(?:\.(\w+))?', text)
        if path:
            quoted, plain, field = path.groups()
            topics.add(check(messages, quoted or plain, field))
    placed = {text for text in strings(layout["layout"]) if "!" in text}
    if placed != set(layout["configById"]):
        sys.exit(f"panels {placed} and {set(layout['configById'])}")
    return topics


def plotjuggler(root, messages):
    topics = set()
    for curve in root.iter("curve"):
        name = curve.get("name")
        for path in [curve.get("curve_x"), curve.get("curve_y")] if curve.get("curve_x") else [name]:
            topic, field = path.rsplit("/", 1)
            topics.add(check(messages, topic, field))
    for splitter in root.iter("DockSplitter"):
        parts = list(splitter)
        if {len(parts), int(splitter.get("count")), len(splitter.get("sizes").split(";"))} != {len(parts)}:
            sys.exit("a splitter has a wrong number of parts")
    return topics


def main(path, foxglove_path, plotjuggler_path):
    messages = first_messages(path)
    named = {
        "foxglove": foxglove(json.loads(Path(foxglove_path).read_text()), messages),
        "plotjuggler": plotjuggler(ElementTree.parse(plotjuggler_path).getroot(), messages),
    }
    print(json.dumps({layout: sorted(topics) for layout, topics in named.items()}))


if __name__ == "__main__":
    main(*sys.argv[1:])
