"""Measures the time from a tick of the world to the arrival of its time at subscribers of `--ros` and `--foxglove`.

    observer_latency.py PROGRAM [SECONDS [SPEED]]

Runs the scenario waste-cleanup with both observers. A client of the run receives a view after each tick, in the moment at
which the world sends it. Prints the delay of `/clock` and of Foxglove's time after the view of the same simulated time, in
rows of BENCHMARKS.md, and the share of the times that arrived.
"""

import os
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from threading import Thread

from agent import find_run
from control import connect
from foxglove_client import Client
from ros_topics import free_port, open_session

DOMAIN = 7
STEP_MS = 50
NS_PER_MS = 1_000_000


def read_number(data):
    """Reads a number in the variable-length encoding of bincode. Returns it and the rest."""
    sizes = {251: "<H", 252: "<I", 253: "<Q"}
    if form := sizes.get(data[0]):
        return struct.unpack_from(form, data, 1)[0], data[1 + struct.calcsize(form) :]
    return data[0], data[1:]


def view_ms(payload):
    """Returns the simulated time of a view, ms. Its first fields are the tick and the time."""
    _, rest = read_number(payload)
    return read_number(rest)[0]


def clock_ms(payload):
    seconds, nanoseconds = struct.unpack_from("<iI", payload, 4)
    # Times of ROS begin at 1 ns.
    return (seconds * 1000 * NS_PER_MS + nanoseconds - 1) // NS_PER_MS


def store(times, time_ms):
    times.setdefault(time_ms, time.monotonic())


def read_foxglove(port, times):
    client = Client(port)
    while not client.is_over():
        client.read()
        while client.clocks:
            store(times, client.clocks.pop() // NS_PER_MS)


def main(program, seconds="30", speed="1"):
    ros_port, foxglove_port = free_port(), free_port()
    _router = open_session("router", ros_port)
    views, clocks, shown = {}, {}, {}
    session = open_session("client", ros_port)
    _clock = session.declare_subscriber(f"{DOMAIN}/clock/**", lambda sample: store(clocks, clock_ms(sample.payload.to_bytes())))
    with tempfile.TemporaryDirectory() as folder:
        peers = [f"--ros={DOMAIN}", f"--ros-router=tcp/127.0.0.1:{ros_port}", f"--foxglove=127.0.0.1:{foxglove_port}"]
        limit = str(float(seconds) * float(speed))
        words = ["--limit", limit, "--speed", f"{speed}x", "--no-page", "--paused", "--out", f"{folder}/run"]
        run = subprocess.Popen([program, "run", "waste-cleanup", *words, *peers], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        name = next(found[1] for line in run.stderr if (found := re.match(r"run (\S+)$", line)))
        bus = find_run(name)
        Thread(target=run.stderr.read, daemon=True).start()
        reader = Thread(target=read_foxglove, args=(foxglove_port, shown), daemon=True)
        reader.start()
        with connect(bus) as client:
            key = f"alliance/{name}/view"
            _views = client.declare_subscriber(key, lambda sample: store(views, view_ms(sample.payload.to_bytes())))
            # Both processes connect before the run continues.
            time.sleep(5)
            subprocess.run([program, "clock", "--run", name, "resume"], check=True, capture_output=True)
            run.wait()
        reader.join(5)
    print("| subscriber | median, ms | 99 %, ms | longest, ms | arrived |\n|---|---|---|---|---|")
    for title, found in (("`/clock` of `--ros`", clocks), ("time of `--foxglove`", shown)):
        # The first second contains the connection.
        both = [at for at in views if 1000 < at and at in found]
        delays = sorted((found[at] - views[at]) * 1000 for at in both)
        last = delays[min(len(delays) - 1, len(delays) * 99 // 100)]
        share = len(both) / sum(1000 < at for at in views)
        print(f"| {title} | {statistics.median(delays):.0f} | {last:.0f} | {delays[-1]:.0f} | {share:.1%} |")


if __name__ == "__main__":
    main(*sys.argv[1:])
    # The threads of the open session would keep the process.
    sys.stdout.flush()
    os._exit(0)
