"""Connects to a run as Foxglove does, and compares its messages with the MCAP file of the run.

    foxglove_client.py compare|hostile|slow|play PROGRAM RUN ARGUMENT...

Starts `PROGRAM run ARGUMENT... --out RUN` and speaks the WebSocket protocol of Foxglove
(https://github.com/foxglove/foxglove-sdk/tree/main/docs). With `compare`, the client also controls the run. With
`hostile`, clients send garbage instead; with `slow`, a client subscribes to everything and does not read. With `play`, the
run is finished, and clients play it. Prints facts as JSON.
"""

import base64
import json
import os
import random
import socket
import struct
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

PROTOCOL = "foxglove.sdk.v1"
PATIENCE = 60
# The number of messages after which a second client subscribes.
LATER = 2000


def equal(found, expected, what):
    if found != expected:
        sys.exit(f"{what}: {found!r} is not {expected!r}")


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


class Client:
    """A connection, with the channels and services that the server advertises."""

    def __init__(self, port):
        self.topics, self.services, self.clocks = {}, {}, []
        self.answers, self.status, self.states = {}, [], []
        until = time.monotonic() + PATIENCE
        while True:
            try:
                url = f"ws://127.0.0.1:{port}"
                self.socket = connect(url, subprotocols=[PROTOCOL], max_size=None, compression=None, max_queue=4)
                break
            except OSError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.05)
        equal(self.socket.subprotocol, PROTOCOL, "subprotocol")
        self.info = json.loads(self.socket.recv(PATIENCE))
        equal(self.info["op"], "serverInfo", "first message")

    def read(self):
        """Reads one frame. Returns the subscription, time and content of a message, and `None` for other frames."""
        frame = self.socket.recv(PATIENCE)
        if isinstance(frame, str):
            value = json.loads(frame)
            if value["op"] == "advertise":
                self.topics.update({channel["topic"]: channel for channel in value["channels"]})
            elif value["op"] == "advertiseServices":
                self.services.update({service["name"]: service for service in value["services"]})
            elif value["op"] == "status":
                self.status.append(value)
            elif value["op"] == "serviceCallFailure":
                self.answers[value["callId"]] = value["message"]
            else:
                sys.exit(f"unexpected frame {frame}")
            return None
        kind, rest = frame[0], frame[1:]
        if kind == 1:
            subscription, at = struct.unpack_from("<IQ", rest)
            return subscription, at, rest[12:]
        if kind == 2:
            self.clocks.append(struct.unpack("<Q", rest)[0])
        elif kind == 3:
            _, call, length = struct.unpack_from("<III", rest)
            equal(rest[12 : 12 + length], b"json", "encoding of a reply")
            self.answers[call] = json.loads(rest[12 + length :])
        elif kind == 5:
            status, now, speed, did_seek, length = struct.unpack_from("<BQf?I", rest)
            self.states.append((("playing", "paused", "buffering", "ended")[status], now, speed, did_seek, rest[18 : 18 + length].decode()))
        else:
            sys.exit(f"unexpected frame of kind {kind}")
        return None

    def control(self, command, speed, seek=None, name="a"):
        """Sends a request for playback."""
        packed = struct.pack("<BBf?QI", 3, command == "pause", speed, seek is not None, seek or 0, len(name))
        self.socket.send(packed + name.encode())

    def read_until(self, is_there):
        """Reads until a state of the playback is there. Returns the messages before it."""
        messages = []
        while not any(is_there(state) for state in self.states):
            if message := self.read():
                messages.append(message)
        return messages

    def wait_for_topics(self):
        # The last topic that the server advertises.
        while "/threshold" not in self.topics:
            self.read()

    def subscribe(self, topics):
        chosen = [{"id": 1000 + self.topics[topic]["id"], "channelId": self.topics[topic]["id"]} for topic in topics]
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": chosen}))

    def call(self, number, request):
        service = self.services["/alliance/control"]
        encoding = b"json"
        header = struct.pack("<BIII", 2, service["id"], number, len(encoding))
        self.socket.send(header + encoding + request.encode())

    def wait_for_run(self):
        """Asks for the faults until the run can answer, because the server starts before it."""
        until = time.monotonic() + PATIENCE
        while not isinstance(self.answers.pop(0, ""), dict):
            if time.monotonic() > until:
                sys.exit("the run does not answer")
            time.sleep(0.1)
            self.call(0, '"list"')
            while 0 not in self.answers:
                self.read()

    def is_over(self):
        return any(value["message"] == "The run is over." for value in self.status)


def late_message(port, topic):
    """Returns the first message of a topic that a new client receives."""
    client = Client(port)
    client.wait_for_topics()
    client.subscribe([topic])
    while not (message := client.read()):
        pass
    client.socket.close()
    return message[1:]


def receive(port):
    """Receives a run that waits for its start. Returns the client, all messages, and a message of a late client."""
    client = Client(port)
    client.wait_for_topics()
    while not client.services:
        client.read()
    client.subscribe(client.topics)
    client.wait_for_run()
    client.call(1, '{"clock": ')
    client.call(2, '{"fault": {"fault": {"kill": "nobody"}}}')
    client.call(3, '{"fault": {"fault": {"kill": "gold"}, "at_s": 10, "for_s": 5}}')
    # Calls are concurrent.
    while len(client.answers) < 3:
        client.read()
    client.call(4, '{"clock": "resume"}')
    messages, late = [], None
    while not client.is_over():
        if message := client.read():
            messages.append(message)
        if late is None and len(messages) > LATER:
            late = late_message(port, "/scene/room")
    client.socket.close()
    return client, messages, late


def compare(program, run, client, messages, late):
    """Compares channels and messages with the MCAP file of the run."""
    whole = recorded(program, run)
    names = {1000 + channel["id"]: topic for topic, channel in client.topics.items()}
    found = [(names[subscription], at, data) for subscription, at, data in messages]
    with open(Path(run) / "run.mcap", "rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        for channel in summary.channels.values():
            schema, live = summary.schemas[channel.schema_id], client.topics[channel.topic]
            expected = (channel.message_encoding, schema.name, schema.encoding, schema.data)
            shown = (live["encoding"], live["schemaName"], live["schemaEncoding"], base64.b64decode(live["schema"] + "=="))
            equal(shown, expected, f"channel {channel.topic}")
        topics = {channel.topic for channel in summary.channels.values()}
        equal(set(client.topics), topics, "topics")
    equal(len(found), len(whole), "number of messages")
    for number, (live, logged) in enumerate(zip(found, whole)):
        equal(live[:2], logged[:2], f"topic and time of message {number}")
        equal(live[2] == logged[2], True, f"content of message {number} of {live[0]}")
    equal([at for _, at, _ in found], sorted(at for _, at, _ in found), "order of time")
    rooms = [message[1:] for message in found if message[0] == "/scene/room"]
    equal(late in rooms, True, "message for a late client")
    equal(client.clocks, sorted(client.clocks), "clock")
    # The clock overtakes messages, so the last time can arrive after the end of the run.
    equal(0 < client.clocks[-1] <= whole[-1][1], True, "last clock")
    return Counter(topic for topic, _, _ in found)


def recorded(program, run):
    """Returns topic, time and content of the messages in the MCAP file of a run."""
    subprocess.run([program, "export", run, "--mcap"], check=True, capture_output=True)
    with open(Path(run) / "run.mcap", "rb") as file:
        messages = make_reader(file).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, message.data) for _, channel, message in messages]


def play(program, run, port):
    """Plays a finished run, pauses, seeks, and compares all messages with its recording."""
    expected = recorded(program, run)
    end = expected[-1][1]
    client = Client(port)
    seconds = {name: client.info[name]["sec"] * 10**9 + client.info[name]["nsec"] for name in ("dataStartTime", "dataEndTime")}
    equal(seconds, {"dataStartTime": 0, "dataEndTime": end}, "time range")
    client.wait_for_topics()
    names = {1000 + channel["id"]: topic for topic, channel in client.topics.items()}

    def named(messages):
        return [(names[subscription], at, data) for subscription, at, data in messages]

    def state_at(time_ns):
        latest = {topic: (topic, at, data) for topic, at, data in expected if at <= time_ns}
        return sorted(latest.values())

    client.subscribe(client.topics)
    # The playback stands at the start. Late subscribers receive the state there.
    first = client.read_until(lambda state: state[0] == "paused")
    while len(first) < len(state_at(0)):
        if message := client.read():
            first.append(message)
    equal(sorted(named(first)), state_at(0), "state at the start")
    client.control("play", 100.0, name="play")
    rest = named(client.read_until(lambda state: state[0] == "ended"))
    while len(rest) + sum(at == 0 for _, at, _ in expected) < len(expected):
        if message := client.read():
            rest += named([message])
    equal(rest == [message for message in expected if message[1] > 0], True, "messages of the playback")
    equal(any(state[0] == "playing" and state[2] == 100.0 and state[4] == "play" for state in client.states), True, "answer")

    # Backward. The state there is repeated.
    seek, client.states = end // 2, []
    client.control("pause", 1.0, seek, "seek")
    found = []
    while len(found) < len(state_at(seek)):
        if message := client.read():
            found.append(message)
    equal(sorted(named(found)), state_at(seek), "state after a jump")
    equal(("paused", seek, 1.0, True, "seek") in client.states, True, "answer to a jump")
    # A second client sees the same time, and its wrong requests change nothing but the command.
    other = Client(port)
    other.wait_for_topics()
    other.read_until(lambda state: state[:3] == ("paused", seek, 1.0))
    other.control("play", float("nan"), name="other")
    other.socket.send(struct.pack("<BBf?QI", 3, 7, 1.0, False, 0, 0))
    other.socket.send(struct.pack("<BBf?QI", 3, 0, 1.0, False, 0, 2**31))
    other.socket.send(b"\x03")
    forward = []
    while len(forward) < 20:
        if message := client.read():
            forward.append(message)
    equal(named(forward), [message for message in expected if message[1] > seek][:20], "messages after a jump")
    client.states = []
    client.control("pause", 1.0, 2**64 - 1, "end")
    client.read_until(lambda state: state == ("ended", end, 1.0, True, "end"))
    return {"messages": len(expected), "capabilities": client.info["capabilities"]}


def disturb(port, draw):
    """Connects once as a hostile client. Returns whether a server answered."""
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=1) as raw:
            raw.send(draw.randbytes(200))
        with connect(f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], max_size=None) as client:
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": n, "channelId": n} for n in range(500)]}))
            client.send(json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/tf", "encoding": "json", "schemaName": ""}]}))
            client.send(struct.pack("<BIII", 2, 1, 1, 4) + b'json{"clock": "pause"}')
            client.send(struct.pack("<BIII", 2, 1, 1, 2**32 - 1) + b"json")
            for _ in range(50):
                client.send(draw.randbytes(draw.randrange(300)))
                client.send("".join(chr(draw.randrange(32, 1000)) for _ in range(draw.randrange(300))))
            client.recv(1)
        return True
    except (OSError, WebSocketException):
        return False


def main(mode, program, run, *arguments):
    port = free_port()
    command = [program, "run", *arguments, "--out", run, f"--foxglove=127.0.0.1:{port}"]
    if mode == "play":
        subprocess.run(command[:-1] + ["--in-process"], check=False, capture_output=True)
        command = [program, "watch", run, f"--foxglove=127.0.0.1:{port}"]
    if mode == "compare":
        command += ["--foxglove-control", "--paused"]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        if mode == "play":
            facts = play(program, run, port)
            process.terminate()
        elif mode == "compare":
            client, messages, late = receive(port)
        elif mode == "slow":
            client = Client(port)
            equal("services" in client.info["capabilities"], False, "services without control")
            client.wait_for_topics()
            client.subscribe(client.topics)
        else:
            draw, connections = random.Random(1), 0
            while process.poll() is None:
                connections += disturb(port, draw)
                time.sleep(0.02)
        _, stderr = process.communicate(timeout=10 * PATIENCE)
        if process.returncode not in (0, 1):
            sys.exit(f"the run ended with {process.returncode}: {stderr}")
    finally:
        process.kill()
    if mode == "compare":
        answers = {str(call): answer for call, answer in client.answers.items()}
        facts = {"topics": compare(program, run, client, messages, late), "answers": answers, "info": client.info}
    elif mode == "slow":
        facts = {}
    elif mode == "hostile":
        facts = {"connections": connections}
    print(json.dumps(facts))
    sys.stdout.flush()
    # A client that does not read would delay the end of this process.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
