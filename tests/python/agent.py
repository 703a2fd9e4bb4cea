"""A robot's controller in plain Python, without the package alliance-sim: a program that follows docs/WIRE.md. The robot stands still and
reports that it is idle.

    agent.py [--robot NAME] [--run ID]       control the robot; or start it by `alliance run --controller still='python3 agent.py'`
             [--controller listener]        turn by the received messages, so that they affect the run's hash
             [--controller worker]          work in the mission service
    agent.py --check TYPE FILE…              decode and encode messages

Needs the packages eclipse-zenoh and xxhash.
"""

import copy
import hmac
import itertools
import json
import os
import pathlib
import queue
import secrets
import signal
import struct
import sys
import tempfile
import time

import xxhash
import zenoh

# The types of the messages, as docs/WIRE.md describes them.
SCHEMA = json.loads(pathlib.Path(__file__).parents[2].joinpath("docs/wire.schema.json").read_text())
TYPES, VERSION = SCHEMA["types"], SCHEMA["version"]


class Reader:
    """Decodes a message. A struct becomes a dict, a variant a pair of name and content, an option of an option `None` or a tuple of one."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, length):
        piece = self.data[self.at : self.at + length]
        if len(piece) < length:
            raise ValueError("the message ends too early")
        self.at += length
        return piece

    def number(self, bits=64):
        first = self.take(1)[0]
        if first <= 250 or bits == 8:
            return first
        width = 2 << (first - 251)
        if 8 * width > min(bits, 128):
            raise ValueError("the number is too wide")
        return int.from_bytes(self.take(width), "little")

    def flag(self):
        first = self.take(1)[0]
        if first > 1:
            raise ValueError("neither 0 nor 1")
        return bool(first)

    def value(self, of):
        if isinstance(of, dict):
            ((form, parts),) = of.items()
            return getattr(self, form)(parts)
        if of in TYPES:
            return self.value(TYPES[of])
        if of in ("text", "bytes"):
            data = self.take(self.number())
            return data.decode() if of == "text" else data
        if of in ("f32", "f64"):
            return struct.unpack("<f" if of == "f32" else "<d", self.take(4 if of == "f32" else 8))[0]
        return self.flag() if of == "bool" else self.number(int(of[1:]))

    def struct(self, fields):
        return {field["name"]: self.value(field["type"]) for field in fields}

    def enum(self, variants):
        variant = variants[self.number(32)]
        return variant["name"], variant["content"] and self.value(variant["content"])

    def option(self, of):
        if not self.flag():
            return None
        return (self.value(of),) if is_option(of) else self.value(of)

    def list(self, of):
        return [self.value(of) for _ in range(self.number())]

    def tuple(self, parts):
        return tuple(self.value(part) for part in parts)


def is_option(of):
    return isinstance(of, dict) and "option" in of


def number(value):
    if value <= 250:
        return bytes([value])
    marker, width = next((251 + i, 2 << i) for i in range(4) if value < 1 << (16 << i))
    return bytes([marker]) + value.to_bytes(width, "little")


def encode(of, value):
    """Encodes a message."""
    if isinstance(of, dict):
        ((form, parts),) = of.items()
        if form == "struct":
            return b"".join(encode(field["type"], value[field["name"]]) for field in parts)
        if form == "tuple":
            return b"".join(map(encode, parts, value))
        if form == "list":
            return number(len(value)) + b"".join(encode(parts, each) for each in value)
        if form == "option":
            return b"\0" if value is None else b"\1" + encode(parts, value[0] if is_option(parts) else value)
        index = next(index for index, variant in enumerate(parts) if variant["name"] == value[0])
        content = parts[index]["content"]
        return number(index) + (encode(content, value[1]) if content else b"")
    if of in TYPES:
        return encode(TYPES[of], value)
    if of in ("text", "bytes"):
        data = value.encode() if of == "text" else value
        return number(len(data)) + data
    if of in ("f32", "f64"):
        return struct.pack("<f" if of == "f32" else "<d", value)
    return bytes([value]) if of in ("bool", "u8") else number(value)


def decode(of, data):
    reader = Reader(data)
    value = reader.value(of)
    if reader.at < len(data):
        raise ValueError(f"{len(data) - reader.at} bytes after the message")
    return value


def decoded(of, data):
    """Returns the message, or `None` if it cannot be decoded."""
    try:
        return decode(of, data)
    except (ValueError, IndexError, UnicodeDecodeError):
        return None


def rotated(word, bits, width):
    """Rotates a word to the left."""
    return (word << bits | word >> (width - bits)) & (1 << width) - 1


def siphash(key, data):
    """Returns SipHash-2-4 with 64 bits."""
    mask, k0, k1 = 2**64 - 1, *struct.unpack("<QQ", key)
    v = [k0 ^ 0x736F6D6570736575, k1 ^ 0x646F72616E646F6D, k0 ^ 0x6C7967656E657261, k1 ^ 0x7465646279746573]

    def rounds(count):
        for _ in range(count):
            for a, b, c, d, first, second in ((0, 1, 2, 3, 13, 16), (2, 1, 0, 3, 17, 21)):
                v[a] = (v[a] + v[b]) & mask
                v[c] = (v[c] + v[d]) & mask
                v[b], v[d] = rotated(v[b], first, 64) ^ v[a], rotated(v[d], second, 64) ^ v[c]
                v[a] = rotated(v[a], 32, 64)

    rest = data + bytes(7 - len(data) % 8) + bytes([len(data) & 255])
    for (word,) in struct.iter_unpack("<Q", rest):
        v[3] ^= word
        rounds(2)
        v[0] ^= word
    v[2] ^= 0xFF
    rounds(4)
    return v[0] ^ v[1] ^ v[2] ^ v[3]


def chacha8(seed, stream, block):
    """Returns the 16 words of a ChaCha8 block. The generator PCG32 expands the 64-bit seed to the key."""
    key, state = [], seed
    for _ in range(8):
        state = (state * 6364136223846793005 + 11634580027462260723) % 2**64
        key.append(rotated(((state >> 18 ^ state) >> 27) % 2**32, 32 - (state >> 59), 32))
    halves = [number >> shift & 0xFFFFFFFF for number in (block, stream) for shift in (0, 32)]
    begin = [*struct.unpack("<4I", b"expand 32-byte k"), *key, *halves]
    v = list(begin)
    columns, diagonals = ([(i, 4 + (i + k) % 4, 8 + (i + 2 * k) % 4, 12 + (i + 3 * k) % 4) for i in range(4)] for k in (0, 1))
    for a, b, c, d in (columns + diagonals) * 4:
        for to, other, turned, bits in ((a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)):
            v[to] = (v[to] + v[other]) & 0xFFFFFFFF
            v[turned] = rotated(v[turned] ^ v[to], bits, 32)
    return [(word + first) & 0xFFFFFFFF for word, first in zip(v, begin)]


def key_of(secret):
    """Returns the seal key of a secret."""
    return xxhash.xxh3_128_intdigest(secret.encode()).to_bytes(16, "little")


class Bus:
    """The session of a team member, with its keys for sealed messages."""

    def __init__(self, run, robot):
        self.derive_keys(run, robot)
        config = zenoh.Config()
        settings = {"mode": "client", "connect/endpoints": [run["team"]["endpoint"]], "listen/endpoints": []}
        settings |= {"transport/auth/usrpwd/user": "team", "transport/auth/usrpwd/password": run["team"]["password"]}
        settings |= dict.fromkeys(("scouting/multicast/enabled", "scouting/gossip/enabled", "timestamping/enabled"), False)
        # A liveliness token must disappear only when the socket is closed.
        settings |= {"transport/link/tx/lease": 86_400_000}
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        self.session = zenoh.open(config)

    def derive_keys(self, run, robot):
        """Derives the keys without a session."""
        self.prefix = f"alliance/{run['run']}"
        own = hmac.new(run["token"].encode(), f"robot-{robot}".encode(), "sha256").hexdigest()[:32]
        self.own = key_of(own)

    def mark(self, key, data=b""):
        return siphash(self.own, key.encode() + b"\0" + data)

    def seal(self, key, of, value):
        data = encode(of, value)
        return data + self.mark(key, data).to_bytes(8, "little")

    def open(self, key, of, sealed):
        """Returns the message, or `None` without a valid seal for this key."""
        data, seal = sealed[:-8], sealed[-8:]
        if self.mark(key, data).to_bytes(8, "little") != seal:
            return None
        return decoded(of, data)


def find_run(wanted, patience_s=10.0):
    """Returns the announcement of a live run: of the wanted id, for which it waits, or of the newest run."""
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    folder = pathlib.Path(base, "alliance")
    if not os.path.isdir(base):
        folder = pathlib.Path(tempfile.gettempdir(), f"alliance-{os.geteuid()}")
    until = time.monotonic() + patience_s
    while time.monotonic() < until:
        files = sorted(folder.glob("*.json"), key=lambda file: file.stat().st_mtime, reverse=True)
        for found in (json.loads(file.read_text()) for file in files):
            if wanted in (None, found["run"]) and os.path.exists(f"/proc/{found['pid']}"):
                return found
        time.sleep(0.02)
    sys.exit("no such run is live")


def join(bus, robot):
    """Joins as a robot and returns the welcome. Retries if the robot is taken, because its former agent may have just ended."""
    key = f"{bus.prefix}/join/{robot}"
    until = time.monotonic() + 1.0
    while True:
        nonce = secrets.randbits(128)
        request = {"version": VERSION, "robot": robot, "pid": os.getpid(), "nonce": nonce}
        query_options = {"target": zenoh.QueryTarget.ALL, "consolidation": zenoh.ConsolidationMode.NONE}
        replies = bus.session.get(key, payload=bus.seal(key, "JoinRequest", request), **query_options)
        sealed = (reply.ok.payload.to_bytes() for reply in replies if reply.ok)
        answers = [bus.open(f"{key}/{nonce:032x}", "JoinReply", answer) for answer in sealed]
        name, contents = next((answer for answer in answers if answer), ("", "no answer"))
        if name == "Welcome":
            return contents
        if contents[0] != "Taken" or time.monotonic() > until:
            sys.exit(f"refused: {contents}")
        time.sleep(0.05)


class Still:
    """A controller that does nothing and sends heartbeats. A copy of it is a checkpoint."""

    def __init__(self, me, setup):
        sets = setup["alliance"]["robots"][me]["sets"].values()
        self.period = max(round(1000 / values["broadcast_rate_hz"]) for values in sets)
        self.since = self.sent = None

    def step(self, now, readings, broadcasts):
        """Returns the actuation and the broadcasts."""
        if self.since is None:
            self.since = now
        messages = []
        if self.sent is None or now - self.sent >= self.period:
            self.sent = now
            messages.append(("Heartbeat", self.heartbeat(readings)))
        return {"speed_m_s": 0.0, "turn_rad_s": 0.0, "action": ("nothing", None)}, messages

    def heartbeat(self, readings):
        devices, items = readings["mission"]
        position = readings["pose"] and readings["pose"]["position"]
        idle = {"state": ("Idle", None), "since": self.since, "set": None, "task": None, "progress": 0}
        return idle | {"position": position, "carrying": devices == "items" and bool(items["holding"]), "shared_knowledge": ("nothing", None)}


class Listener(Still):
    """A controller that turns by sender, time and order of the received heartbeats."""

    def step(self, now, readings, broadcasts):
        actuation, messages = super().step(now, readings, broadcasts)
        heartbeats = (message for message in broadcasts if message["body"][0] == "Heartbeat")
        digest = sum((place + 1) * (message["sender"] + 1) * (message["sent"] // 50 + 1) for place, message in enumerate(heartbeats))
        return actuation | {"turn_rad_s": digest % 128 / 128}, messages


def direction(angle):
    """Returns cosine and sine by additions and multiplications alone, which have the same bits on every machine."""
    x = angle / 8
    xx = x * x
    cos = 1 - (xx / 2) * (1 - (xx / 12) * (1 - (xx / 30) * (1 - xx / 56)))
    sin = x * (1 - (xx / 6) * (1 - (xx / 20) * (1 - (xx / 42) * (1 - xx / 72))))
    for _ in range(3):
        cos, sin = cos * cos - sin * sin, 2 * cos * sin
    return cos, sin


class Worker(Still):
    """A controller for the mission service. It goes straight to the nearest open point that it knows, and works there."""

    #: The most facts that fit into a heartbeat.
    SHARED_MAX = 20

    def __init__(self, me, setup):
        super().__init__(me, setup)
        self.reach_m = setup["scenario"]["service"]["reach_m"]
        # Observed facts by point, and the last line of the board.
        self.known, self.line = {}, None

    def step(self, now, readings, broadcasts):
        self.learn(now, readings, broadcasts)
        actuation, messages = super().step(now, readings, broadcasts)
        work = None
        pose = readings["pose"]
        target = pose and self.nearest(*pose["position"])
        if target:
            x, y = (place - mine for place, mine in zip(target["at"], pose["position"]))
            cos, sin = direction(pose["heading_rad"])
            ahead, left = x * cos + y * sin, y * cos - x * sin
            if x * x + y * y < 0.81 * self.reach_m * self.reach_m:
                work = target["point"]
            elif abs(left) > 0.2 * ahead:
                actuation |= {"turn_rad_s": -1.0 if left < 0 else 1.0}
            else:
                actuation |= {"speed_m_s": 0.25, "turn_rad_s": left / ahead}
        action = encode("service::Action", {"work": work, "read": self.line})
        return actuation | {"action": ("open", action)}, messages

    def learn(self, now, readings, broadcasts):
        """Learns from the board and from the shared knowledge of teammates."""
        for broadcast in broadcasts:
            kind, body = broadcast["body"]
            if kind == "Heartbeat" and body["shared_knowledge"][0] == "open":
                for news in decode({"list": "service::ObservedFact"}, body["shared_knowledge"][1]):
                    self.merge(news)
        form, content = readings["mission"]
        reading = decode("service::SensorReading", content) if form == "open" else {"points": None, "board_line": None}
        for fact in reading["points"] or []:
            self.merge({"fact": fact, "sensed": now})
        if reading["board_line"] is not None:
            self.line = reading["board_line"]

    def merge(self, news):
        age = lambda observed: (observed["fact"]["round"], observed["sensed"])
        old = self.known.get(news["fact"]["point"])
        if old is None or age(news) > age(old):
            self.known[news["fact"]["point"]] = news

    def nearest(self, x, y):
        def distance(fact):
            dx, dy = fact["at"][0] - x, fact["at"][1] - y
            return dx * dx + dy * dy, fact["point"]

        free = (known["fact"] for known in self.known.values() if known["fact"]["left_s"] > 0)
        return min(free, key=distance, default=None)

    def heartbeat(self, readings):
        shared = [self.known[point] for point in sorted(self.known)][: self.SHARED_MAX]
        return super().heartbeat(readings) | {"shared_knowledge": ("open", encode({"list": "service::ObservedFact"}, shared))}


CONTROLLERS = {"still": Still, "listener": Listener, "worker": Worker}


class Links:
    """The effects of the links on the messages of a manifest, as in proto/src/link/. A copy of it is a checkpoint."""

    #: The maximum number of messages in flight. Further messages are dropped.
    CAPACITY = 4096

    def __init__(self, rank, setup):
        self.rank, self.seed, self.step_ms = rank, setup["seed"], setup["scenario"]["step_ms"]
        # The messages in flight in order of arrival, each with its wait condition, due time and duplicate flag;
        # and the receptions of the duplicates.
        self.kept, self.copies = [], []

    def receive(self, tick, arrived):
        """Returns the received broadcasts of a tick, by sender and number, and the receptions. `arrived` has the entries of the manifest, each
        with its broadcasts, or `None` for a missing one."""
        now, received, receptions = tick["now"], [], []
        copies, self.copies = [copy for copy in self.copies if copy["at"] == now], []
        late, ripe = self.ripen(now, tick["held"])
        for entry, broadcasts in arrived:
            indices = {}
            for broadcast in broadcasts:
                if broadcast is None:
                    receptions.append(self.reception(entry, entry["tick"], "Lost", now))
                    continue
                kind = kind_of(broadcast)
                index = indices[kind] = indices.get(kind, -1) + 1
                delivery, wait, due, twice, broadcast = self.delivery(entry["link"], broadcast, kind, index, now)
                at = due if wait == "due" else now
                receptions.append(self.reception(broadcast, broadcast["tick"], delivery, at, broadcast))
                if wait:
                    self.kept.append((broadcast, wait, due, twice))
                if delivery in ("Received", "Damaged"):
                    received.append(broadcast)
                    self.copy(broadcast, now, twice)
        broadcasts = sorted(received + late, key=order)
        # An overtaken message waits one more step.
        for place, (broadcast, wait, due, twice) in enumerate(self.kept):
            if wait == "overtaken" and any(other["sender"] == broadcast["sender"] and order(other) > order(broadcast) for other in broadcasts):
                self.kept[place] = (broadcast, "due", max(due, now + self.step_ms), twice)
        return broadcasts, receptions + ripe + copies

    def ripen(self, now, held):
        """Returns the messages that are due. A message that was due while the robot was absent is lost."""
        received, receptions, kept = [], [], []
        for broadcast, wait, due, twice in self.kept:
            if wait == "held" and broadcast["sender"] not in held:
                wait, due = "due", now
            if wait != "due" or due > now:
                kept.append((broadcast, wait, due, twice))
                continue
            delivery = "Cut" if due < now else "Damaged" if "is_damaged" in broadcast else "Delayed"
            receptions.append(self.reception(broadcast, broadcast["tick"], delivery, due, broadcast))
            if delivery != "Cut":
                received.append(broadcast)
                self.copy(broadcast, due, twice)
        self.kept = kept
        return received, receptions

    def delivery(self, link, broadcast, kind, index, now):
        """Returns the delivery of the `index`-th message of its kind in its tick, with its wait condition, due time and duplicate flag,
        and the message with its bit errors."""
        if link is None:
            return "Received", None, now, False, broadcast
        stream = 3 << 32 | broadcast["sender"] << 16 | self.rank
        number = [variant["name"] for variant in TYPES["BroadcastKind"]["enum"]].index(kind)
        block = broadcast["tick"] << 19 | number << 16 | index
        drop, jitter, duplicate, reorder, fade, *_ = chacha8(self.seed, stream, block)
        delay = link["delay"] + ((link["jitter"] + 1) * jitter >> 32)
        due = now + -(-delay // self.step_ms) * self.step_ms
        overtakes = any(other["sender"] == broadcast["sender"] and wait == "overtaken" for other, wait, _, _ in self.kept)
        lost = ["Cut"] * link["cut"] + ["Blocked"] * link["blocked"] + ["Faded"] * (fade < link["fade"]) + ["Dropped"] * (drop < link["drop"])
        if lost:
            return lost[0], None, now, False, broadcast
        passed = self.corrupted(link, broadcast, block)
        if passed is None:
            return "Corrupted", None, now, False, broadcast
        twice = duplicate < link["duplicate"]
        if link["hold"]:
            wait, due = "held", now
        elif reorder < link["reorder"] and not overtakes:
            wait = "overtaken"
        elif due > now:
            wait = "due"
        else:
            return "Damaged" if "is_damaged" in passed else "Received", None, now, twice, passed
        if len(self.kept) >= self.CAPACITY:
            return "Dropped", None, now, False, broadcast
        return "Pending", wait, due, twice, passed

    def corrupted(self, link, broadcast, block):
        """Returns the message with its bit errors, or `None` if the receiver drops it."""
        if not link["corrupt"]:
            return broadcast
        payload, flips, bit = bytearray(encode("BroadcastContent", broadcast["body"])), 0, 0
        for draw in range(8 * len(payload)):
            if draw % 16 == 0:
                words = chacha8(self.seed, 10 << 32 | broadcast["sender"] << 16 | self.rank, (block << 17) + draw // 16)
            bit += intact_bits(words[draw % 16], link["corrupt"])
            if bit >= 8 * len(payload):
                break
            payload[bit // 8] ^= 1 << bit % 8
            flips, bit = flips + 1, bit + 1
        if not flips:
            return broadcast
        try:
            body = decode("BroadcastContent", bytes(payload))
        except (ValueError, IndexError, UnicodeDecodeError):
            return None
        return None if link["checksum"] else broadcast | {"body": body, "is_damaged": True}

    def copy(self, broadcast, at, twice):
        if twice:
            self.copies.append(self.reception(broadcast, broadcast["tick"], "Duplicate", at + self.step_ms, broadcast))

    def reception(self, of, tick, delivery, at, broadcast=None):
        sent = {"sender": of["sender"], "incarnation": of["incarnation"], "sent": tick * self.step_ms}
        return sent | {"at": at, "delivery": (delivery, None), "content": broadcast and logged_part(broadcast)}


def intact_bits(word, flip):
    """Returns the number of intact bits before the next flip, for a word of the stream and the probability of a flip."""
    powers = [2**32 - flip << 32]
    while len(powers) < 22:
        powers.append(powers[-1] ** 2 >> 64)
    length, probability = 0, 1 << 64
    for level, power in reversed(list(enumerate(powers))):
        if word << 32 < probability * power >> 64:
            length, probability = length + 2**level, probability * power >> 64
    return length


def order(broadcast):
    return tuple(broadcast[field] for field in ("sender", "incarnation", "seq", "index"))


def kind_of(broadcast):
    kind, body = broadcast["body"]
    return f"{body['kind'][0]}Bulletin" if kind == "Bulletin" else kind


class Agent:
    """One incarnation of a robot: receives, steps, broadcasts and reports. It returns to the previous state if a step did not count."""

    def __init__(self, bus, name, controller, welcome):
        setup = json.loads(welcome["setup"])
        self.bus, self.rank, self.incarnation = bus, welcome["robot"], welcome["incarnation"]
        # The state that a step changes, before and after the latest step: controller, messages in flight, and next sequence number.
        self.before = self.state = (controller(name, setup), Links(self.rank, setup), 0)
        self.latest, self.published = None, []
        declare = lambda key: bus.session.declare_publisher(key, priority=zenoh.Priority.INTERACTIVE_HIGH)
        self.report = declare(f"{bus.prefix}/robot/{name}/report")
        self.heartbeats = declare(f"{bus.prefix}/team/{name}/heartbeat")

    def process_tick(self, tick, broadcasts):
        """Processes a tick of the world, with the broadcasts that its manifest lists. A repeated tick means that the tick or its report was lost."""
        if tick["incarnation"] > self.incarnation:
            sys.exit("a newer agent controls this robot")
        if tick["incarnation"] < self.incarnation or (self.latest is not None and tick["tick"] < self.latest):
            return
        if tick["tick"] == self.latest:
            self.publish()
            return
        last, self.latest = self.latest, tick["tick"]
        listed = iter([data and decoded("Broadcast", data) for data in broadcasts])
        self.step(tick, last, [(entry, list(itertools.islice(listed, entry["count"]))) for entry in tick["manifest"]])

    def step(self, tick, last, arrived):
        if last is not None and (tick["last_counted"] is None or tick["last_counted"] < last):
            # The previous step did not count.
            self.state = self.before
        self.before = self.state
        controller, links, seq = copy.deepcopy(self.state)
        received, receptions = links.receive(tick, arrived)
        actuation, messages = controller.step(tick["now"], tick["readings"], received)
        self.state = (controller, links, seq + len(messages))
        sender = {"sender": self.rank, "incarnation": self.incarnation, "tick": tick["tick"], "sent": tick["now"]}
        broadcasts = [sender | {"index": index, "seq": seq + index, "body": body} for index, body in enumerate(messages)]
        sealed = [self.bus.seal(str(self.heartbeats.key_expr), "Broadcast", broadcast) for broadcast in broadcasts]
        me = {"robot": self.rank, "incarnation": self.incarnation, "tick": tick["tick"]}
        did = {"actuation": actuation, "broadcasts": len(sealed), "broadcast_bytes": sum(map(len, sealed))}
        log = {"active": None, "motivations": [], "allocation": [], "changes": [], "notes": [], "receptions": receptions}
        # The broadcasts are sent before the report, so that the world has them when it counts the report.
        self.published = [(self.heartbeats, each) for each in sealed]
        self.published.append((self.report, self.bus.seal(str(self.report.key_expr), "Report", me | did | log)))
        self.publish()

    def publish(self):
        for publisher, sealed in self.published:
            publisher.put(sealed)


def logged_part(broadcast):
    """Returns the part of a broadcast that is logged."""
    kind, body = broadcast["body"]
    content = dict.fromkeys(("state", "since", "set", "task", "progress")) | {"seq": broadcast["seq"], "kind": (kind_of(broadcast), None)}
    if kind == "Heartbeat":
        content |= {field: body[field] for field in ("state", "since", "set", "task", "progress")}
    if kind == "Bulletin":
        content |= body["about"] or {}
    return content


def live(robot, run, controller):
    """Runs the agent from joining to the end of the run, and returns the exit status."""
    bus = Bus(find_run(run), robot)
    news = queue.Queue()

    def watch(sample):
        if sample.kind == zenoh.SampleKind.DELETE:
            news.put(None)

    # The subscriptions exist before the welcome, so that no message is missed.
    ticks = f"{bus.prefix}/robot/{robot}/tick"
    subscriptions = [
        bus.session.declare_subscriber(ticks, lambda sample: news.put(sample.payload.to_bytes())),
        bus.session.liveliness().declare_subscriber(f"{bus.prefix}/alive/world", watch, history=True),
    ]
    welcome = join(bus, robot)
    agent = Agent(bus, robot, controller, welcome)
    alive = f"{bus.prefix}/alive/{robot}/{agent.incarnation}"
    # The agent takes part while its token exists. The token disappears with the socket.
    token = bus.session.liveliness().declare_token(f"{alive}/{bus.mark(alive):016x}")
    while (sealed := news.get()) is not None:
        message = bus.open(ticks, "ToAgent", sealed)
        if message is None:
            continue
        name, contents = message
        if name == "End":
            return 0
        if name == "Dismissed" and contents == agent.incarnation:
            sys.exit("dismissed")
        if name == "Tick":
            agent.process_tick(contents["tick"], contents["broadcasts"])
    sys.exit("the connection to the world is lost")


def main(words):
    if words[:1] == ["--check"]:
        for file in words[2:]:
            data = pathlib.Path(file).read_bytes()
            assert encode(words[1], decode(words[1], data)) == data, file
        return 0
    options = dict(zip(words[::2], words[1::2]))
    robot = options.get("--robot") or os.environ["ALLIANCE_ROBOT"]
    run = options.get("--run") or (None if "--robot" in options else os.environ.get("ALLIANCE_RUN"))
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    return live(robot, run, CONTROLLERS[options.get("--controller", "still")])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
