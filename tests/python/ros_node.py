"""A node of ROS that controls a robot of the mission waste: it carries the items of a spill to the deposit.

    ros_node.py drive|hostile|silent|latest|clock DOMAIN PROGRAM RUN ARGUMENT...

The script is the router and the node, and starts `PROGRAM run ARGUMENT... --out RUN` with the controller `nav` for the
robot `blue-1`. Modes:

- drive: answers each tick with a stamped command.
- hostile: does the same while another session publishes garbage on the topics of commands.
- silent: ends after 5 s of simulated time.
- latest: sends commands without stamps.
- clock: several robots have nodes, whose agents come and go. Only the time is checked.

Encodes and decodes with `rosbags`, and prints facts as JSON.
"""

import json
import math
import random
import threading
import traceback

import xxhash
import zenoh
from rosbags.typesys import Stores, get_typestore

from ros_texts import check_texts
from ros_topics import PATIENCE, child, equal, finish, free_port, open_session, run_script

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
NAME, FRAME = "blue_1", "blue_1/base_link"
TWIST, STAMPED, STRING = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped", "std_msgs/msg/String"
# The scenario of the test, m and s.
DEPOSIT, DEPOSIT_RADIUS, SPILL = (3.0, 2.0), 0.6, (0.9, 2.0)
SPEED, TURN, STEP, REACH = 0.25, 1.5, 0.05, 0.25
SILENT_AFTER_NS = 5_000_000_000


def twist(speed, turn):
    vector = TYPES["geometry_msgs/msg/Vector3"]
    return TYPES[TWIST](linear=vector(speed, 0.0, 0.0), angular=vector(0.0, 0.0, turn))


def stamped(stamp, speed, turn, frame=FRAME):
    time = TYPES["builtin_interfaces/msg/Time"](**stamp)
    return TYPES[STAMPED](header=TYPES["std_msgs/msg/Header"](time, frame), twist=twist(speed, turn))


def encode(message, kind):
    return bytes(STORE.serialize_cdr(message, kind))


class Publisher:
    """A publisher with a key and attachments as in the design of rmw_zenoh."""

    def __init__(self, session, domain, topic, kind):
        package, _, name = kind.split("/")
        self.kind, self.count = kind, 0
        dds, digest = f"{package}::msg::dds_::{name}_", STORE.hash_rihs01(kind)
        self.key = f"{domain}{topic}/{dds}/{digest}"
        token = f"@ros2_lv/{domain}/{session.zid()}/0/9/MP/%/%/driver/{topic.replace('/', '%')}/{dds}/{digest}/::,10:,:,:,,"
        self.gid = xxhash.xxh3_128(token.encode()).intdigest().to_bytes(16, "little")
        self.session, self.token = session, session.liveliness().declare_token(token)

    def attachment(self):
        self.count += 1
        return self.count.to_bytes(8, "little") + bytes(8) + bytes([16]) + self.gid

    def put(self, message):
        self.put_bytes(encode(message, self.kind))

    def put_bytes(self, payload):
        self.session.put(self.key, payload, attachment=self.attachment())


class Node:
    """Answers each tick of the robot from its readings alone."""

    def __init__(self, port, domain, mode):
        self.session, self.mode = open_session("client", port), mode
        self.motion = Publisher(self.session, domain, f"/{NAME}/cmd_vel", TWIST if mode == "latest" else STAMPED)
        self.action = Publisher(self.session, domain, f"/{NAME}/action", STRING)
        self.odom, self.ticks, self.picked, self.is_over, self.problem = None, 0, 0, False, None
        self.clock, self.gap, self.topics, self.endpoints = -1, 0, {}, set()
        self.texts = {"devices": [], "action": []}
        # One subscriber, so that messages stay in order.
        self.subscriber = self.session.declare_subscriber(f"{domain}/**", self.take)
        token = f"@ros2_lv/{domain}/**"
        self.graph = self.session.liveliness().declare_subscriber(token, self.take_token, history=True)

    def take_token(self, sample):
        parts = str(sample.key_expr).split("/")
        if sample.kind == zenoh.SampleKind.PUT and parts[5] in ("MP", "MS") and parts[8] == f"alliance_{NAME}":
            self.endpoints.add(f"{parts[5]} {parts[9].replace('%', '/')} {parts[10]}")

    def take(self, sample):
        try:
            self.process(str(sample.key_expr).split("/"), sample.payload.to_bytes())
        except Exception as problem:
            traceback.print_exc()
            self.problem = repr(problem)

    def process(self, key, payload):
        topic, (package, _, _, name) = "/".join(key[1:-2]), key[-2].rstrip("_").split("::")
        if topic.endswith(("cmd_vel", "action")):
            return
        kind = f"{package}/msg/{name}"
        equal(key[-1], STORE.hash_rihs01(kind), f"hash of {topic}")
        message = STORE.deserialize_cdr(payload, kind)
        equal(encode(message, kind) == payload, True, f"re-encoded message of {topic}")
        self.topics[topic] = self.topics.get(topic, 0) + 1
        if topic == "clock":
            now = message.clock.sec * 1_000_000_000 + message.clock.nanosec
            # Two agents may publish the same tick until they have received each other.
            equal(now >= self.clock if self.mode == "clock" else now > self.clock, True, "/clock")
            self.gap = max(self.gap, now - max(self.clock, 1))
            self.clock = now
        elif self.mode == "clock":
            pass
        elif topic == f"{NAME}/odom":
            self.odom = message
        elif topic == f"{NAME}/devices":
            self.texts["devices"].append(message.data)
            self.step(json.loads(message.data))

    def step(self, devices):
        stamp = devices["stamp"]
        now = stamp["sec"] * 1_000_000_000 + stamp["nanosec"]
        equal(now, self.clock, "time of the devices")
        if self.is_over or (self.mode == "silent" and now > SILENT_AFTER_NS):
            self.is_over = True
            return
        equal((self.odom.header.stamp.sec, self.odom.header.stamp.nanosec), (stamp["sec"], stamp["nanosec"]), "stamp of /odom")
        self.ticks += 1
        speed, turn, activity = self.decide(devices["mission"])
        self.texts["action"].append(json.dumps(activity))
        self.action.put(TYPES[STRING](self.texts["action"][-1]))
        self.motion.put(twist(speed, turn) if self.mode == "latest" else stamped(stamp, speed, turn))

    def decide(self, mission):
        """Returns speed, turn rate and activity."""
        pose = self.odom.pose.pose
        place = (pose.position.x, pose.position.y)
        heading = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        carry = {"doing": "move-spill(left)"}
        if mission["holding"]:
            if mission["zone"] == "Target":
                self.picked += 1
                return 0.0, 0.0, carry | {"action": {"gripper": "drop"}, "progress": True}
            return *toward(place, heading, DEPOSIT), carry
        cos, sin = math.cos(heading), math.sin(heading)
        items = [(place[0] + cos * x - sin * y, place[1] + sin * x + cos * y) for x, y in mission["items"] or []]
        items = [item for item in items if math.dist(item, DEPOSIT) > DEPOSIT_RADIUS]
        if not items and math.dist(place, SPILL) < 0.1:
            return 0.0, 0.0, {}
        goal = min(items, key=lambda item: math.dist(item, place)) if items else SPILL
        if items and math.dist(goal, place) < REACH:
            return 0.0, 0.0, carry | {"action": {"gripper": "pick"}}
        return *toward(place, heading, goal), carry


def toward(place, heading, goal):
    off = math.remainder(math.atan2(goal[1] - place[1], goal[0] - place[0]) - heading, math.tau)
    return (SPEED if abs(off) < 0.3 else 0.0), max(-TURN, min(TURN, off / STEP))


def disturb(port, domain, ended):
    """Publishes messages without a valid command."""
    session, draw = open_session("client", port), random.Random(1)
    motion = Publisher(session, domain, f"/{NAME}/cmd_vel", STAMPED)
    action = Publisher(session, domain, f"/{NAME}/action", STRING)
    others = [
        Publisher(session, domain, f"/{NAME}/cmd_vel", TWIST),
        Publisher(session, domain, "/gold/cmd_vel", STAMPED),
        Publisher(session, domain, f"/{NAME}/action", TWIST),
    ]
    late, early = {"sec": 0, "nanosec": 0}, {"sec": 2_000_000_000, "nanosec": 0}
    while not ended.is_set():
        for publisher in (motion, action):
            publisher.put_bytes(draw.randbytes(draw.randrange(200)))
            publisher.put_bytes(bytes([0, 1, 0, 0]) + draw.randbytes(draw.randrange(200)))
            publisher.put_bytes(bytes(100_000))
            session.put(publisher.key, draw.randbytes(60), attachment=draw.randbytes(draw.randrange(40)))
            session.put(publisher.key, b"")
            session.delete(publisher.key)
        for value in (math.nan, math.inf, -math.inf, 1e300):
            motion.put(stamped(late, value, 0.0))
        motion.put(stamped(late, 1.0, 1.0, "gold/base_link"))
        motion.put(stamped(late, 1.0, 1.0))
        motion.put(stamped(early, 1.0, 1.0))
        for text in ("", "[]", '{"doing": "dig"}', '{"action": {"gripper": "open"}}', '{"progress": true}', "[" * 50_000):
            action.put(TYPES[STRING](text))
        others[0].put(twist(1.0, 1.0))
        others[1].put(stamped(late, 1.0, 1.0))
        others[2].put(twist(1.0, 1.0))
        ended.wait(0.02)


def main(mode, domain, program, run, *arguments):
    port = free_port()
    _router = open_session("router", port)
    node = Node(port, domain, mode)
    lockstep = [] if mode in ("latest", "clock") else ["--ros-lockstep=20" if mode != "silent" else "--ros-lockstep=1"]
    agent = " ".join([program, "cluster", "agent", f"--ros={domain}", f"--ros-router=tcp/127.0.0.1:{port}", *lockstep])
    command = [program, "run", *arguments, "--out", run, f"--controller=nav={agent}", f"--stall-after={PATIENCE}"]
    ended = threading.Event()
    hostile = threading.Thread(target=disturb, args=(port, domain, ended))
    if mode == "hostile":
        hostile.start()
    process = child(command, stdin=-3, stdout=-1, stderr=-1, text=True)
    finish(process)
    ended.set()
    if mode == "hostile":
        hostile.join()
    equal(node.problem, None, "problem of the node")
    for kind, texts in node.texts.items():
        check_texts(kind, texts)
    facts = {"clock_ms": node.clock // 1_000_000, "gap_ms": node.gap // 1_000_000}
    facts |= {"ticks": node.ticks, "delivered": node.picked, "topics": node.topics, "endpoints": sorted(node.endpoints)}
    print(json.dumps(facts))


if __name__ == "__main__":
    run_script(main)
