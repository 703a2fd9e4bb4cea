"""Decodes and encodes each message of a bag of ROS 2 with Cyclone DDS. Prints the number of messages by type as JSON.

    reencode_rosbag.py BAG

Cyclone DDS is a middleware of ROS 2. Its types are made from the definitions in the bag.
"""

import dataclasses
import json
import sys
from collections import Counter
from pathlib import Path

from cyclonedds.idl import IdlStruct, types
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Nodetype

# The types of Cyclone DDS for those of ROS, where their names differ.
BASES = {"bool": bool, "string": str, "byte": types.uint8}


class Types:
    """The types of a bag for Cyclone DDS, by their names in ROS."""

    def __init__(self, definitions):
        self.definitions, self.made = definitions, {}

    def struct(self, name):
        if name not in self.made:
            _, fields = self.definitions[name]
            # Cyclone DDS needs the module of a class, for types that it finds by name.
            body = {"__annotations__": {field: self.field(*kind) for field, kind in fields}, "__module__": __name__}
            made = type(IdlStruct)(name.rsplit("/", 1)[1], (IdlStruct,), body, typename=name.replace("/", "."))
            self.made[name] = dataclasses.dataclass(made)
        return self.made[name]

    def field(self, kind, detail):
        if kind == Nodetype.NAME:
            return self.struct(detail)
        if kind == Nodetype.BASE:
            name, _ = detail
            return BASES.get(name) or getattr(types, name)
        (kind_of_item, item), length = detail
        inner = self.field(kind_of_item, item)
        return types.array[inner, length] if kind == Nodetype.ARRAY else types.sequence[inner]


def main(path):
    counts = Counter()
    with AnyReader([path]) as reader:
        made = Types(reader.typestore.fielddefs)
        for connection, at, raw in reader.messages():
            raw, kind = bytes(raw), made.struct(connection.msgtype)
            again = kind.deserialize(raw).serialize(use_version_2=False)
            if again != raw:
                sys.exit(f"{connection.topic} at {at} ns: {again.hex()} is not {raw.hex()}")
            counts[connection.msgtype] += 1
    print(json.dumps(counts))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
