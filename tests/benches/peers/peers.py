"""Robot-steps per second and core, in turns with other simulators: ARGoS 3, Enki, krABMaga and VMAS.

    peers.py PROGRAM FOLDER [--robots N,N,...] [--seconds S] [--rounds N] [--only NAME,NAME,...] [--argos3 PREFIX]

PROGRAM is `alliance`. FOLDER receives what is installed and built: Enki from Debian, krABMaga from crates.io and VMAS from PyPI. ARGoS 3 is in
no such registry, so an installed one is used. Prints a Markdown table, what a step contains, and what could not be had.

In every simulator, robots drive 2.5 body radii per second and avoid each other and the walls. A robot has about 900 square radii of the arena.
A step is 50 ms. Nothing is drawn or logged, and one process has one thread. Times are processor times, without the start.
"""

import argparse
import json
import math
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Callable

HERE = Path(__file__).parent
OURS = "alliance"
#: Simulated time of a run of `alliance`, s. A team of any size works until then. A run of a large team is shorter.
LIMIT_S, LARGE_LIMIT_S, LARGE = 140.0, 20.0, 3_000
TICK_S = 0.05
#: Radius of a foot-bot, m.
FOOTBOT_M = 0.085


class Unavailable(Exception):
    """A simulator that cannot be installed, built or run."""


def call(*command, **options):
    """Runs a command and returns its output. The reason of a failure is the first line with an error, else the last one."""
    try:
        return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True, stdin=subprocess.DEVNULL, **options).stdout
    except FileNotFoundError as error:
        raise Unavailable(f"{error.filename} is not installed") from None
    except subprocess.CalledProcessError as error:
        lines = [line for line in (error.stderr or error.stdout).splitlines() if line.strip()]
        reason = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else f"status {error.returncode}")
        raise Unavailable(f"{Path(command[0]).name}: {reason.strip()}") from None


def processor_s(*command):
    """Returns the output of a command and its processor time, s."""

    def spent():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    began = spent()
    # Status 1: the mission is not complete at the limit.
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{command[0]}: {done.stderr.strip()}")
    return done.stdout, spent() - began


def ours(program, robots, seconds):
    """Returns robot-steps and their processor time: runs with successive seeds, each less a run of one tick, which contains the start."""
    steps, spent, seed = 0, 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        while spent < seconds:
            seed += 1
            times = []
            for limit in (LARGE_LIMIT_S if robots > LARGE else LIMIT_S, TICK_S):
                words = ["--robots", robots, "--seed", seed, "--limit", f"{limit}s", "--out", Path(folder, f"{seed}-{limit}")]
                output, time = processor_s(program, "run", "--in-process", "--jobs", 1, "--log", "off", "--json", *words)
                times.append((json.loads(output)["result"]["ticks"], time))
            (ticks, whole), (least, start) = times
            steps += (ticks - least) * robots
            spent += whole - start
    return steps, spent


def enki(folder, _):
    """Unpacks Enki from Debian into the folder, without an installation, and builds the program of this benchmark."""
    folder.mkdir(exist_ok=True)
    call("apt-get", "download", "libenki-dev", "libenki2", cwd=folder)
    for package in folder.glob("*.deb"):
        call("dpkg-deb", "-x", package, folder)
    library = folder / "usr/lib"
    call("g++", "-O3", "-DNDEBUG", f"-I{folder}/usr/include", HERE / "enki.cpp", f"-L{library}", "-lenki", f"-Wl,-rpath,{library}", "-o", folder / "peer")
    return lambda robots, seconds: call(folder / "peer", robots, seconds)


def krabmaga(folder, _):
    call("nice", "-n", 19, "cargo", "build", "--release", "--locked", "--jobs", 1, "--target-dir", folder, cwd=HERE / "krabmaga")
    return lambda robots, seconds: call(folder / "release/peer", robots, seconds)


def vmas(folder, _):
    call(sys.executable, "-m", "venv", folder)
    call(folder / "bin/pip", "install", "--quiet", "--disable-pip-version-check", "vmas==1.5.2")
    return lambda robots, seconds: call(folder / "bin/python", HERE / "vmas_team.py", robots, seconds)


@cache
def argos_library(folder, prefix):
    """Builds the controller for an installed ARGoS 3, and returns the file."""
    folder.mkdir(exist_ok=True)
    library, installed = folder / "libpeer.so", prefix / "lib/argos3"
    plugins = ["-largos3core_simulator", "-largos3plugin_simulator_genericrobot", "-largos3plugin_simulator_footbot"]
    words = ["-std=c++17", "-O3", "-DNDEBUG", "-shared", "-fPIC", f"-I{prefix}/include", f"-L{installed}", f"-Wl,-rpath,{installed}"]
    call("g++", *words, HERE / "argos.cpp", *plugins, "-o", library)
    return library


def argos(radio):
    """Returns the function that prepares ARGoS 3. With `radio`, robots also send and receive at each step."""

    def prepare(folder, prefix):
        if not prefix:
            raise Unavailable("in no package of Debian, PyPI or crates.io; install it as its project describes, and give --argos3 PREFIX")
        library, installed = argos_library(folder.with_name("argos"), prefix), prefix / "lib/argos3"

        def turn(robots, seconds):
            file = library.with_name(f"{robots}.argos")
            file.write_text(experiment(library, robots, seconds, radio))
            environment = os.environ | {"LD_LIBRARY_PATH": str(installed), "ARGOS_PLUGIN_PATH": str(installed)}
            return call(prefix / "bin/argos3", "-n", "-c", file, env=environment).splitlines()[-1]

        return turn

    return prepare


def experiment(library, robots, seconds, radio):
    """Returns an experiment of ARGoS: foot-bots on a grid, between four walls."""
    columns, share = math.ceil(math.sqrt(robots)), 30 * FOOTBOT_M
    side = columns * share
    walls = [
        f'<box id="wall{number}" size="{x},{y},0.5" movable="false"><body position="{at_x},{at_y},0" orientation="0,0,0"/></box>'
        for number, (x, y, at_x, at_y) in enumerate([
            (side, 0.1, 0, side / 2), (side, 0.1, 0, -side / 2), (0.1, side, side / 2, 0), (0.1, side, -side / 2, 0)
        ])
    ]
    sensors = '<footbot_proximity implementation="default" show_rays="false"/>'
    actuators = '<differential_steering implementation="default"/>'
    if radio:
        sensors += '<range_and_bearing implementation="medium" medium="radio" show_rays="false"/>'
        actuators += '<range_and_bearing implementation="default"/>'
    return f"""<?xml version="1.0"?>
<argos-configuration>
  <framework>
    <system threads="0"/>
    <experiment length="0" ticks_per_second="20" random_seed="1"/>
  </framework>
  <controllers>
    <wanderer id="c" library="{library}">
      <actuators>{actuators}</actuators>
      <sensors>{sensors}</sensors>
      <params radio="{str(radio).lower()}"/>
    </wanderer>
  </controllers>
  <loop_functions library="{library}" label="measurement" robots="{robots}" seconds="{seconds}"/>
  <arena size="{side + 1},{side + 1},1" center="0,0,0.5">
    {"".join(walls)}
    <distribute>
      <position method="grid" center="0,0,0" distances="{share},{share},1" layout="{columns},{columns},1"/>
      <orientation method="uniform" min="0,0,0" max="360,0,0"/>
      <entity quantity="{robots}" max_trials="1">
        <foot-bot id="r" rab_range="{80 * FOOTBOT_M}" rab_data_size="55"><controller config="c"/></foot-bot>
      </entity>
    </distribute>
  </arena>
  <physics_engines><dynamics2d id="bodies"/></physics_engines>
  <media><range_and_bearing id="radio"/></media>
</argos-configuration>
"""


@dataclass
class Peer:
    """A simulator. `prepare` installs and builds it in a folder, and returns the function that measures a team for some seconds."""

    prepare: Callable
    content: str
    #: The largest team of a measurement.
    robots: int = 1_000_000


PEERS = {
    "argos": Peer(argos(False), "two-dimensional rigid bodies in 10 substeps, 24 proximity rays of 1.2 radii, no communication", 1_000),
    # The start of 1,000 robots takes a minute of processor time.
    "argos-radio": Peer(argos(True), "the same, and 55 bytes per step to all robots within 80 radii in line of sight (range and bearing)", 100),
    "enki": Peer(enki, "two-dimensional rigid bodies, 8 infrared sensors with 3 rays each, no communication; all pairs of robots are tested", 1_000),
    "krabmaga": Peer(krabmaga, "positions: the neighbors at each step, and once per second all robots within 80 radii; no bodies, sensors and messages"),
    "vmas": Peer(vmas, "bodies with contact forces in teams of ten, all teams in one batch; relative positions of the team, no sensors and messages"),
}
CONTENT = "the mission waste-cleanup: bodies with contacts, sensors, task allocation by ALLIANCE, a radio of 80 radii once per second, a hash"


class Parser(argparse.ArgumentParser):
    def error(self, message):
        print(f"peers.py: {message}", file=sys.stderr)
        sys.exit(2)


def positive(convert):
    """Returns a function that converts a text to a positive number."""

    def parse(text):
        value = convert(text)
        if not 0 < value < 1e6:
            raise ValueError
        return value

    parse.__name__ = f"positive {convert.__name__}"
    return parse


def teams(text):
    """Returns the sizes of teams in a list such as 10,100."""
    return [positive(int)(size) for size in text.split(",")]


def names(text):
    """Returns the names of other simulators in a list such as enki,vmas."""
    chosen = text.split(",")
    if unknown := set(chosen) - set(PEERS):
        raise argparse.ArgumentTypeError(f"there is no {min(unknown)!r}; there are {', '.join(PEERS)}")
    return chosen


def arguments():
    parser = Parser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--robots", type=teams, default=[10, 100, 1_000, 10_000])
    parser.add_argument("--seconds", type=positive(float), default=2.0, help="processor time of a measurement")
    parser.add_argument("--rounds", type=positive(int), default=5)
    parser.add_argument("--only", type=names, default=list(PEERS))
    installed = shutil.which("argos3")
    parser.add_argument("--argos3", type=lambda text: Path(text).resolve(), default=installed and Path(installed).parents[1], help="folder of an installed ARGoS 3")
    given = parser.parse_args()
    if not shutil.which(given.program):
        parser.error(f"{given.program}: no such program; give the path of alliance")
    try:
        given.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"{given.folder}: {error.strerror}; give a folder that can be written")
    return given


def extent(values, digits):
    return f"{statistics.median(values):,.{digits}f} [{min(values):,.{digits}f} .. {max(values):,.{digits}f}]"


def main():
    given = arguments()
    folder, program = given.folder.resolve(), shutil.which(given.program)
    turns, missing = {OURS: lambda robots, seconds: ours(program, robots, seconds)}, {}
    for name in given.only:
        print(f"{name}: install and build", file=sys.stderr, flush=True)
        try:
            measure = PEERS[name].prepare(folder / name, given.argos3)
            turns[name] = lambda robots, seconds, measure=measure: map(float, measure(robots, seconds).split())
        except Unavailable as reason:
            missing[name] = reason
    rates = {name: {robots: [] for robots in given.robots} for name in turns}
    for number in range(given.rounds):
        for robots in given.robots:
            for name, turn in turns.items():
                if name in missing or (name in PEERS and robots > PEERS[name].robots):
                    continue
                try:
                    steps, spent = turn(robots, given.seconds)
                except Unavailable as reason:
                    missing[name] = reason
                    continue
                rates[name][robots].append(steps / spent / 1e3)
                print(f"round {number + 1}: {robots} robots, {name}: {steps / spent / 1e3:,.1f}", file=sys.stderr, flush=True)
    print("Thousand robot-steps per second and core, median and range; then the ratio of alliance to it in the same round.\n")
    print("| | " + " | ".join(f"{robots:,} robots" for robots in given.robots) + " |")
    print("|---" * (1 + len(given.robots)) + "|")
    for name, found in rates.items():
        if name in missing:
            continue
        cells = []
        for robots, values in found.items():
            ratios = [one / other for one, other in zip(rates[OURS][robots], values)]
            compared = f"; {extent(ratios, 2)}" if values and name != OURS else ""
            cells.append(extent(values, 1) + compared if values else "–")
        print(f"| {name} | " + " | ".join(cells) + " |")
    print("\nA step contains:\n")
    for name in rates:
        print(f"- {name}: {PEERS[name].content if name in PEERS else CONTENT}.")
    if missing:
        print("\nCould not be had:\n")
        for name, reason in missing.items():
            print(f"- {name}: {reason}")


if __name__ == "__main__":
    main()
