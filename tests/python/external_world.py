"""Is the other world of a run: IR-SIM moves the bodies by the commands of the run, and publishes their odometry.

    external_world.py MODE DOMAIN PROGRAM RUN ARGUMENT...

The script is the router of ROS and a node with the bodies of a scenario, and starts `PROGRAM run ARGUMENT... --out RUN`.
Messages are encoded and decoded by rosbags. Modes:

- `mission`: the process of gold is killed while gold moves, and the mission continues.
- `pause`: the clock of the run is paused and resumed.
- `silent`: the other world stops sending. `crash`: the bridge of the run is killed. `world`: its world is. The run ends.
- `one`: gold stops sending, and the run continues.
- `scan`: posts that only the other world has stand in the way, and the bodies publish the scans of a lidar. `blind`: the
  same posts without scans. In both, bodies move when they have new commands, so that a busy machine delays none.
  `dark`: the lidar of gold stops.
- `absent`, `nan`, `frame`, `outside`: no odometry of gold, or wrong ones. The run does not start.

Prints facts as JSON.
"""

import contextlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy
import xxhash
import zenoh
from ros_topics import PATIENCE, child, equal, free_port, open_session, run_script
from rosbags.typesys import Stores, get_typestore

with contextlib.redirect_stdout(sys.stderr):
    # Without a display, it prints the windows that it lacks.
    import irsim

STORE = get_typestore(Stores.ROS2_JAZZY)
STEP_S = 0.05
# The time after which a command has arrived, s.
QUIET = 1.0
# The value of --stall-after with `one`, s.
STALL_S = 2.0
ROBOTS = {"blue": (1.0, 1.0, 0.0), "gold": (1.0, 3.0, 0.0), "green": (1.0, 5.0, 0.0)}
WORLD = """
world: { width: 8, height: 6, step_time: 0.05, collision_mode: unobstructed, control_mode: auto }
robot:
"""
RADIUS = 0.2
ROBOT = f"""
  - kinematics: {{ name: diff }}
    shape: {{ name: circle, radius: {RADIUS} }}
    state: [STATE]
    vel_min: [-2, -4]
    vel_max: [2, 4]
"""
LIDAR = "    sensors: [{ name: lidar2d, range_min: 0.05, range_max: 4, angle_range: 6.283185307179586, number: 181 }]\n"
# Posts between the bodies and the points, and the range of collision avoidance, m.
POSTS, POST_RADIUS, AVOIDANCE = [(3.0, y) for y in (1.0, 3.0, 5.0)], 0.4, 0.4
POST = "  - { shape: { name: circle, radius: %s }, state: [%s, %s, 0] }\n"


def kind_of(name):
    package, _, kind = name.split("/")
    return f"{package}::msg::dds_::{kind}_/{STORE.hash_rihs01(name)}"


class World(threading.Thread):
    """The bodies, and their topics in a domain of ROS."""

    def __init__(self, port, domain, mode):
        super().__init__(daemon=True)
        path = Path("world.yaml").absolute()
        self.has_scans = mode in ("scan", "dark")
        robot = ROBOT + LIDAR * self.has_scans
        text = WORLD + "".join(robot.replace("STATE", ", ".join(map(str, at))) for at in ROBOTS.values())
        self.has_posts = mode in ("scan", "blind")
        if self.has_posts:
            text += "obstacle:\n" + "".join(POST % (POST_RADIUS, *post) for post in POSTS)
        path.write_text(text)
        self.env = irsim.make(str(path), headless=True, log_level="ERROR")
        self.mode, self.domain = mode, domain
        self.session = open_session("client", port)
        self.twists = {name: (0.0, 0.0) for name in ROBOTS}
        # The robots with a command that is new since the last step of the bodies.
        self.commanded = set()
        # By robot: the time and the velocity of each command.
        self.commands = {name: [] for name in ROBOTS}
        # The poses by robot and time stamp.
        self.sent = {}
        # The ranges by robot and time stamp, and the robots that send none.
        self.scans, self.dark = {}, set()
        # The least distance of a body to a post, m.
        self.least = math.inf
        # The robots that send no odometry.
        self.silent = {"gold"} if mode == "absent" else set()
        self.failed = None
        self.tokens = set()
        self.liveliness = self.session.liveliness().declare_subscriber(f"@ros2_lv/{domain}/**", self.take_token, history=True)
        twist = kind_of("geometry_msgs/msg/Twist")
        self.subscriber = self.session.declare_subscriber(f"{domain}/*/cmd_vel/{twist}", self.take)
        odometry = kind_of("nav_msgs/msg/Odometry")
        self.publishers = {name: self.session.declare_publisher(f"{domain}/{name}/odom/{odometry}") for name in ROBOTS}
        scan = kind_of("sensor_msgs/msg/LaserScan")
        self.scanners = {name: self.session.declare_publisher(f"{domain}/{name}/scan/{scan}") for name in ROBOTS}

    def take_token(self, sample):
        if sample.kind == zenoh.SampleKind.PUT:
            self.tokens.add(str(sample.key_expr))

    def take(self, sample):
        name = str(sample.key_expr).split("/")[1]
        twist = STORE.deserialize_cdr(sample.payload.to_bytes(), "geometry_msgs/msg/Twist")
        rest = (twist.linear.y, twist.linear.z, twist.angular.x, twist.angular.y)
        if rest != (0, 0, 0, 0) or len(sample.attachment.to_bytes()) != 33:
            self.failed = f"command of {name}: {twist} with {sample.attachment}"
        self.twists[name] = (twist.linear.x, twist.angular.z)
        self.commands[name].append((time.monotonic(), self.twists[name]))
        self.commanded.add(name)

    def run(self):
        sequence, due = 0, time.monotonic()
        while True:
            if not self.has_posts or len(self.commanded) == len(ROBOTS):
                self.commanded.clear()
                twists = dict(self.twists)
                self.env.step([list(twists[name]) for name in ROBOTS], list(range(len(ROBOTS))))
            sequence += 1
            for name, robot in zip(ROBOTS, self.env.robot_list):
                x, y, heading = (float(value) for value in robot.state[:3, 0])
                self.least = min(self.least, *(math.dist((x, y), post) - POST_RADIUS - RADIUS for post in POSTS))
                if name not in self.silent:
                    self.publish(name, sequence, x, y, heading)
                if self.has_scans and name not in self.dark:
                    self.publish_scan(name, sequence, robot.get_lidar_scan())
            due += STEP_S
            time.sleep(max(0.0, due - time.monotonic()))

    def publish(self, name, sequence, x, y, heading):
        frame = "map"
        if name == "gold":
            x = {"nan": math.nan, "outside": -3.0}.get(self.mode, x)
            frame = {"frame": "odom"}.get(self.mode, frame)
        stamp_ns = time.time_ns()
        self.sent[name, stamp_ns] = (x, y, heading)
        message = odometry(stamp_ns, frame, name, x, y, heading)
        self.publishers[name].put(bytes(message), attachment=attachment(name, sequence, stamp_ns))

    def publish_scan(self, name, sequence, scan):
        stamp_ns = time.time_ns()
        ranges = numpy.asarray(scan["ranges"], dtype=numpy.float32)
        self.scans[name, stamp_ns] = (scan["angle_min"], scan["angle_increment"], scan["range_max"], ranges)
        message = STORE.types["sensor_msgs/msg/LaserScan"](
            header=STORE.types["std_msgs/msg/Header"](stamp=stamp(stamp_ns), frame_id=f"{name}/lidar"),
            angle_min=scan["angle_min"],
            angle_max=scan["angle_max"],
            angle_increment=scan["angle_increment"],
            time_increment=0.0,
            scan_time=STEP_S,
            range_min=scan["range_min"],
            range_max=scan["range_max"],
            ranges=ranges,
            intensities=numpy.zeros(0, dtype=numpy.float32),
        )
        message = STORE.serialize_cdr(message, "sensor_msgs/msg/LaserScan")
        self.scanners[name].put(bytes(message), attachment=attachment(name + "scan", sequence, stamp_ns))

    def moves(self, name):
        return any(abs(value) > 0 for value in self.twists[name])


def attachment(publisher, sequence, stamp_ns):
    gid = xxhash.xxh3_128(publisher.encode()).intdigest().to_bytes(16, "little")
    return sequence.to_bytes(8, "little") + stamp_ns.to_bytes(8, "little") + bytes([16]) + gid


def stamp(stamp_ns):
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    return STORE.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)


def odometry(stamp_ns, frame, name, x, y, heading):
    """Returns a message, encoded by rosbags."""
    types = STORE.types
    zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    unknown = numpy.zeros(36)
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(heading / 2), w=math.cos(heading / 2)),
    )
    message = types["nav_msgs/msg/Odometry"](
        header=types["std_msgs/msg/Header"](stamp=stamp(stamp_ns), frame_id=frame),
        child_frame_id=f"{name}/base_link",
        pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=unknown),
        twist=types["geometry_msgs/msg/TwistWithCovariance"](
            twist=types["geometry_msgs/msg/Twist"](linear=zero, angular=zero), covariance=unknown
        ),
    )
    return STORE.serialize_cdr(message, "nav_msgs/msg/Odometry")


class Run:
    """A run, and its lines on stderr."""

    def __init__(self, program, run, port, domain, arguments):
        peer = [f"--external=ros:{domain}", f"--ros-router=tcp/127.0.0.1:{port}"]
        command = [program, "run", *arguments, "--out", run, *peer]
        self.process = child(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.shown = ""
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.shown += line

    def wait_for(self, what, find):
        """Waits until `find` returns something, which it returns."""
        until = time.monotonic() + PATIENCE
        while not (found := find()):
            if self.process.poll() is not None:
                sys.exit(f"the run ended with {self.process.returncode} before {what}: {self.shown}")
            if time.monotonic() > until:
                sys.exit(f"there was no {what} within {PATIENCE} s: {self.shown}")
            time.sleep(0.01)
        return found

    def pid(self, pattern):
        """Returns the process id that the run shows."""
        return int(self.wait_for(pattern, lambda: re.search(pattern, self.shown))[1])

    def finish(self):
        """Waits for the end. Returns the exit status."""
        status = self.process.wait(2 * PATIENCE)
        self.reader.join()
        return status


def check_inputs(world, run):
    """Checks that each pose in the log is one that was sent. Returns the numbers of poses and of late ones."""
    counts, late = dict.fromkeys(ROBOTS, 0), 0
    for line in Path(run, "inputs.jsonl").read_text().splitlines():
        body = json.loads(line)["input"].get("body")
        if body:
            sent = world.sent[body["robot"], body["stamp_ns"]]
            found = (body["x_m"], body["y_m"], body["heading_rad"])
            for here, there in zip(found[:2], sent):
                if abs(here - there) > 1e-5:
                    sys.exit(f"{body} is not {sent}")
            turn = math.remainder(found[2] - sent[2], math.tau)
            if abs(turn) > 1e-5:
                sys.exit(f"{body} is not {sent}")
            counts[body["robot"]] += 1
            late += body.get("late", False)
    return counts, late


def free_way(x, y, radius):
    """Returns how far a disc moves ahead until it touches one of the points, m."""
    ahead = (x > 0) & (numpy.abs(y) < radius)
    return numpy.min(x[ahead] - numpy.sqrt(radius**2 - y[ahead] ** 2), initial=math.inf)


def check_scans(world, run):
    """Compares the center beam of each scan in the log with the ranges that were sent. Returns the numbers of scans and hits."""
    count, hits = 0, 0
    for line in Path(run, "inputs.jsonl").read_text().splitlines():
        body = json.loads(line)["input"].get("body") or {}
        if not (found := body.get("scan")):
            continue
        first, step, limit, ranges = world.scans[body["robot"], found["stamp_ns"]]
        angles = first + step * numpy.arange(len(ranges))
        seen = ranges < limit
        x, y = (ranges * numpy.cos(angles))[seen], (ranges * numpy.sin(angles))[seen]
        free = free_way(x, y, RADIUS)
        hit = found["beams"]["ahead"][1]
        if hit:
            # Beams are up to 2 cm apart. A surface between two points can be in the way, although only a wider disc
            # touches the points.
            least = free_way(x, y, RADIUS + 0.02) - 0.05
            agrees = least < hit["distance_m"] < min(free, AVOIDANCE) + 0.001
        else:
            agrees = free >= AVOIDANCE - 0.001
        if not agrees:
            sys.exit(f"{hit} instead of {free}")
        count, hits = count + 1, hits + bool(hit)
    return count, hits


def standing(world):
    """Checks that all bodies stand, by the last command of each, and for longer than a tick."""
    time.sleep(QUIET)
    return all(commands and commands[-1][1] == (0, 0) for commands in world.commands.values())


def main(mode, domain, program, run, *arguments):
    port = free_port()
    _router = open_session("router", port)
    world = World(port, domain, mode)
    world.start()
    process = Run(program, run, port, domain, arguments)
    facts = {}
    if mode not in ("absent", "nan", "frame", "outside"):
        gold = process.pid(r"gold (\d+)")
        bridge = process.pid(r"bodies in another world.* \(process (\d+)\)")
        process.wait_for("command", lambda: world.moves("gold"))
        for name in ROBOTS:
            for kind in (f"MP/%/%/alliance/%{name}%cmd_vel/", f"MS/%/%/alliance/%{name}%odom/", f"MS/%/%/alliance/%{name}%scan/"):
                equal(any(kind in token for token in world.tokens), True, kind)
    if mode == "mission":
        time.sleep(1)
        os.kill(gold, signal.SIGKILL)
        process.wait_for("loss of gold", lambda: re.search(r"gold.* dies", process.shown))
        time.sleep(QUIET)
        killed = len(world.commands["gold"])
    elif mode == "pause":
        # Runs of other tests can be live, too.
        name = process.wait_for("name of the run", lambda: re.search(r"^run (\S+)$", process.shown, re.MULTILINE))[1]
        clock = [program, "clock", "--run", name]
        subprocess.run([*clock, "pause"], check=True, capture_output=True)
        paused = time.monotonic() + QUIET
        facts["stands"] = standing(world)
        later = [at for commands in world.commands.values() for at, _ in commands if at > paused]
        facts["commands_while_paused"] = len(later)
        refused = subprocess.run([*clock, "speed", "2x"], capture_output=True, text=True)
        facts["speed"] = refused.stderr.strip()
        moved = subprocess.run([program, "fault", "--run", name, "move-robot", "gold", "4", "4"], capture_output=True, text=True)
        facts["move_robot"] = moved.stderr.strip()
        subprocess.run([*clock, "resume"], check=True, capture_output=True)
        process.wait_for("command after the pause", lambda: world.moves("blue") or world.moves("green"))
    elif mode == "silent":
        world.silent = set(ROBOTS)
    elif mode in ("one", "dark"):
        (world.silent if mode == "one" else world.dark).add("gold")
        time.sleep(STALL_S + QUIET)
        lost = time.monotonic()
    elif mode == "crash":
        os.kill(bridge, signal.SIGKILL)
    elif mode == "world":
        # The log needs a tick.
        time.sleep(QUIET)
        os.kill(process.pid(r"world (\d+)"), signal.SIGKILL)
    facts["status"] = process.finish()
    facts["stderr"] = process.shown
    if Path(run, "run.json").exists():
        facts["stands_at_end"] = standing(world)
        facts["poses"], facts["late"] = check_inputs(world, run)
        facts["scans"], facts["hits"] = check_scans(world, run)
        facts["least_m"] = world.least
    if mode in ("one", "dark"):
        facts["moved_when_lost"] = [name for name in ROBOTS if any(at > lost and twist != (0, 0) for at, twist in world.commands[name])]
    if mode == "mission":
        facts["gold_moved_after_kill"] = any(twist != (0, 0) for _, twist in world.commands["gold"][killed:])
        facts["moved"] = {
            name: math.dist((x, y), robot.state[:2, 0])
            for (name, (x, y, _)), robot in zip(ROBOTS.items(), world.env.robot_list)
        }
    if world.failed:
        sys.exit(world.failed)
    print(json.dumps(facts))


if __name__ == "__main__":
    run_script(main)
