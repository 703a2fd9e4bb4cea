"""Subscribes to the topics of a live run as a node of ROS would, and compares them with the bag of the run.

    ros_topics.py compare DOMAIN PROGRAM RUN ARGUMENT...
    ros_topics.py hostile|stopped DOMAIN PROGRAM RUN ARGUMENT...

The script is the router and the subscriber, and starts `PROGRAM run ARGUMENT... --out RUN`. With `hostile`, it publishes
garbage on all keys of the run instead; with `stopped`, its subscriber does not read. Prints facts as JSON.
"""

import json
import os
import random
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections import defaultdict
from pathlib import Path

import xxhash
import zenoh
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

STORES = [Stores.ROS2_IRON, Stores.ROS2_JAZZY, Stores.ROS2_KILTED]
# Quality of service in a token: reliable and volatile with 10 messages, or transient local with one.
STREAM, LATCHED = "::,10:,:,:,,", ":1:,1:,:,:,,"
# The time without a message after which all have arrived, s.
QUIET = 1.0
PATIENCE = 60
CHILDREN = []


def equal(found, expected, what):
    if found != expected:
        sys.exit(f"{what}: {found!r} is not {expected!r}")


def open_session(mode, port):
    """Opens a session that waits long before it drops a message, because the machine of a test can be busy."""
    place = "listen" if mode == "router" else "connect"
    other = "connect" if mode == "router" else "listen"
    config = zenoh.Config.from_json5(
        f"""{{ mode: "{mode}", {place}: {{ endpoints: ["tcp/127.0.0.1:{port}"] }}, {other}: {{ endpoints: [] }},
        scouting: {{ multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }},
        transport: {{ link: {{ tx: {{ queue: {{ size: {{ data: 16 }}, congestion_control: {{ drop: {{ wait_before_drop: 5000000 }} }} }} }} }} }} }}"""
    )
    return zenoh.open(config)


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


class Subscriber:
    """A plain subscriber to everything in a domain."""

    def __init__(self, port, domain):
        self.session = open_session("client", port)
        self.samples, self.tokens, self.latest = [], set(), time.monotonic()
        self.subscription = self.session.declare_subscriber(f"{domain}/**", self.take)
        self.liveliness = self.session.liveliness().declare_subscriber(f"@ros2_lv/{domain}/**", self.take_token, history=True)

    def take(self, sample):
        self.samples.append((str(sample.key_expr), sample.payload.to_bytes(), sample.attachment.to_bytes()))
        self.latest = time.monotonic()

    def take_token(self, sample):
        if sample.kind == zenoh.SampleKind.PUT:
            self.tokens.add(str(sample.key_expr))

    def wait(self):
        until = time.monotonic() + PATIENCE
        while time.monotonic() < min(until, self.latest + QUIET):
            time.sleep(0.05)


class LateSubscriber(threading.Thread):
    """A subscriber with durability transient local, from the middle of the run on."""

    def __init__(self, port, first):
        super().__init__()
        self.port, self.first, self.found = port, first, {}

    def run(self):
        until = time.monotonic() + PATIENCE
        while len(self.first.samples) < 2000 and time.monotonic() < until:
            time.sleep(0.01)
        session = open_session("client", self.port)
        keys = {key for key, _, _ in list(self.first.samples) if key.split("/")[1] in ("map", "tf_static")}
        subscribers = [
            zenoh.ext.declare_advanced_subscriber(
                session, key, self.take, history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
            )
            for key in keys
        ]
        until = time.monotonic() + PATIENCE
        while set(self.found) != keys and time.monotonic() < until:
            time.sleep(0.01)
        del subscribers
        session.close()

    def take(self, sample):
        self.found.setdefault(str(sample.key_expr), []).append((sample.payload.to_bytes(), sample.attachment.to_bytes()))


def child(command, **options):
    """Starts a process that ends with this one at the latest."""
    CHILDREN.append(subprocess.Popen(command, **options))
    return CHILDREN[-1]


def start(program, run, port, domain, arguments):
    command = [program, "run", *arguments, "--out", run, f"--ros={domain}", f"--ros-router=tcp/127.0.0.1:{port}"]
    return child(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_sample(process, has_sample):
    """Waits until a subscriber has a sample while the run of a process continues."""
    until = time.monotonic() + PATIENCE
    while not has_sample() or process.poll() is not None:
        if process.poll() is not None:
            sys.exit(f"the run ended with {process.returncode} before the first sample: {process.communicate()[1]}")
        if time.monotonic() > until:
            sys.exit(f"there was no sample within {PATIENCE} s")
        time.sleep(0.01)


def finish(process):
    _, stderr = process.communicate(timeout=10 * PATIENCE)
    if process.returncode not in (0, 1):
        sys.exit(f"the run ended with {process.returncode}: {stderr}")
    return stderr


def compare(program, run, domain, subscriber, late):
    """Compares all samples with the bag of the run. Returns the number of messages by topic."""
    subprocess.run([program, "export", run, "--rosbag"], check=True, capture_output=True)
    stores = [get_typestore(store) for store in STORES]
    samples = defaultdict(list)
    for key, payload, attachment in subscriber.samples:
        samples[key].append((payload, attachment))
    tokens = {token.rsplit("/", 4)[1].replace("%", "/"): token for token in subscriber.tokens if "/MP/" in token}
    (node,) = [token for token in subscriber.tokens if "/NN/" in token]
    equal(node.split("/")[5:], ["NN", "%", "%", "alliance"], "token of the node")
    counts, last_clock = {}, 0
    with AnyReader([Path(run) / "rosbag"]) as reader:
        equal(set(tokens), {connection.topic for connection in reader.connections}, "topics with tokens")
        bag = defaultdict(list)
        for connection, at, raw in reader.messages():
            bag[connection.topic].append((at, bytes(raw)))
        for connection in reader.connections:
            topic = connection.topic
            for store in stores:
                equal(connection.digest, store.hash_rihs01(connection.msgtype), f"type hash of {topic}")
            package, _, name = connection.msgtype.split("/")
            kind = f"{package}::msg::dds_::{name}_"
            key = f"{domain}{topic}/{kind}/{connection.digest}"
            durability = connection.ext.offered_qos_profiles[0].durability.value
            policies = LATCHED if durability == 1 else STREAM
            start = tokens[topic].split("/")[:9]
            equal(start[:2] + start[3:4] + start[5:], ["@ros2_lv", domain, "0", "MP", "%", "%", "alliance"], "token")
            equal(tokens[topic].split("/")[9:], [topic.replace("/", "%"), kind, connection.digest, policies], "token")
            gid = xxhash.xxh3_128(tokens[topic].encode()).intdigest().to_bytes(16, "little")
            found = samples.pop(key, [])
            equal(len(found), len(bag[topic]), f"messages of {topic}")
            for number, ((payload, attachment), (at, raw)) in enumerate(zip(found, bag[topic]), start=1):
                equal(payload == raw, True, f"payload {number} of {topic}")
                expected = number.to_bytes(8, "little") + at.to_bytes(8, "little") + bytes([16]) + gid
                equal(attachment, expected, f"attachment {number} of {topic}")
                message = stores[1].deserialize_cdr(payload, connection.msgtype)
                again = bytes(stores[1].serialize_cdr(message, connection.msgtype))
                equal(again == payload, True, f"re-encoded message {number} of {topic}")
                if topic == "/clock":
                    now = message.clock.sec * 1_000_000_000 + message.clock.nanosec
                    equal((now, now > last_clock), (at, True), "/clock")
                    last_clock = now
            counts[topic] = len(found)
            if topic in ("/map", "/tf_static"):
                (latest, *rest) = late.found.get(key, [(None, None)])
                equal(latest[0] in [raw for _, raw in bag[topic]], True, f"{topic} of a late subscriber")
                equal(len(latest[1]), 33, "attachment for a late subscriber")
                equal(len({attachment for _, attachment in [latest, *rest]}), 1 + len(rest), f"repetitions of {topic}")
    equal(dict(samples), {}, "other messages")
    return counts


def disturb(session, keys, ended):
    """Publishes garbage on the keys of the run, and claims to be its publishers."""
    draw = random.Random(1)
    tokens = [session.liveliness().declare_token(f"@ros2_lv/0/x/0/{number}/MP/%/%/alliance/%clock/x/x/x") for number in range(20)]
    while not ended.is_set():
        for key in list(keys):
            session.put(key, draw.randbytes(draw.randrange(5000)), attachment=draw.randbytes(draw.randrange(40)))
        session.put("alliance/any/control", b"garbage")
        for _ in session.get("**", timeout=0.1):
            pass
    del tokens


def main(mode, domain, program, run, *arguments):
    port = free_port()
    _router = open_session("router", port)
    if mode == "compare":
        subscriber = Subscriber(port, domain)
        late = LateSubscriber(port, subscriber)
        late.start()
        finish(start(program, run, port, domain, arguments))
        subscriber.wait()
        late.join()
        facts = {"topics": compare(program, run, domain, subscriber, late)}
    elif mode == "hostile":
        subscriber, ended = Subscriber(port, domain), threading.Event()
        process = start(program, run, port, domain, arguments)
        wait_for_sample(process, lambda: subscriber.samples)
        keys = {key for key, _, _ in list(subscriber.samples)}
        attack = threading.Thread(target=disturb, args=(open_session("client", port), keys, ended))
        attack.start()
        finish(process)
        ended.set()
        attack.join()
        facts = {"samples": len(subscriber.samples)}
    else:
        words = [sys.executable, __file__, "wait", domain, str(port)]
        stopped = child(words, stdout=subprocess.PIPE)
        process = start(program, run, port, domain, arguments)
        wait_for_sample(process, lambda: select.select([stopped.stdout], [], [], 0)[0])
        if not stopped.stdout.readline():
            sys.exit("the subscriber failed")
        stopped.send_signal(signal.SIGSTOP)
        finish(process)
        facts = {}
    print(json.dumps(facts))


def run_script(main):
    """Runs a script with its arguments, and ends the process with its status and all children."""
    status = 0
    try:
        main(*sys.argv[1:])
    except SystemExit as problem:
        print(problem, file=sys.stderr)
        status = 1
    except Exception:
        traceback.print_exc()
        status = 1
    finally:
        for process in CHILDREN:
            process.kill()
            process.wait()
    # The threads of open sessions would keep the process.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    if sys.argv[1] == "wait":
        held = Subscriber(sys.argv[3], sys.argv[2])
        while not held.samples:
            time.sleep(0.01)
        print("a sample", flush=True)
        time.sleep(10 * PATIENCE)
    else:
        run_script(main)
