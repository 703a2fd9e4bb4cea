"""A zenoh session for a program in a language without a zenoh library, such as tests/node/agent.mjs. It forwards payloads as bytes and
contains none of their types.

Both directions have the same frames: length of the rest (4 bytes, little-endian), operation (a letter), length of the key (2 bytes), key,
payload.

    to the relay:  C settings as JSON (first frame) · S subscribe · A watch liveliness · T declare a liveliness token · P publish · Q query
    from it:       S message · A liveliness token has ended · R reply to a query · E end of its replies

Needs the package eclipse-zenoh. It ends with its standard input, so that its token ends with the program.
"""

import json
import os
import sys
import threading

import zenoh

lock = threading.Lock()


def send(operation, key=b"", payload=b""):
    frame = operation.encode() + len(key).to_bytes(2, "little") + key + payload
    with lock:
        sys.stdout.buffer.write(len(frame).to_bytes(4, "little") + frame)
        sys.stdout.buffer.flush()


def receive():
    """Returns operation, key and payload of the next frame."""
    length = sys.stdin.buffer.read(4)
    if len(length) < 4:
        os._exit(0)
    frame = sys.stdin.buffer.read(int.from_bytes(length, "little"))
    end = 3 + int.from_bytes(frame[1:3], "little")
    return chr(frame[0]), frame[3:end].decode(), frame[end:]


def open_session(settings):
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def forward(sample):
    send("S", str(sample.key_expr).encode(), sample.payload.to_bytes())


def watch(sample):
    if sample.kind == zenoh.SampleKind.DELETE:
        send("A", str(sample.key_expr).encode())


def main():
    _, _, settings = receive()
    session = open_session(json.loads(settings))
    # Everything that is declared lives as long as the process.
    declared = []
    while True:
        operation, key, payload = receive()
        if operation == "S":
            declared.append(session.declare_subscriber(key, forward, allowed_origin=zenoh.Locality.REMOTE))
        elif operation == "A":
            declared.append(session.liveliness().declare_subscriber(key, watch, history=True))
        elif operation == "T":
            declared.append(session.liveliness().declare_token(key))
        elif operation == "P":
            session.put(key, payload, priority=zenoh.Priority.INTERACTIVE_HIGH)
        elif operation == "Q":
            options = {"target": zenoh.QueryTarget.ALL, "consolidation": zenoh.ConsolidationMode.NONE}
            for reply in session.get(key, payload=payload, **options):
                if reply.ok:
                    send("R", key.encode(), reply.ok.payload.to_bytes())
            send("E", key.encode())


if __name__ == "__main__":
    main()
