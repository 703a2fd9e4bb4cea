"""Controller for the mission observe. It follows the targets in sight and broadcasts them. Without targets it drives to a teammate's targets,
if that has more than one, or else wanders. alliance run SCENARIO --controller watcher='python3 watcher.py'
"""

import math
import struct

from alliance_sim import Action, Agent, main

NEWS_S = 3.0  # maximum age of a teammate's message, s


class Watcher(Agent):
    def reset(self):
        body = self.setup["scenario"]["body"]
        self.speed, self.turn = body["speed_m_s"], math.radians(body["turn_deg_s"])
        self.news = {}  # teammate -> (time of its message, its targets)
        self.course, self.until = 0.0, 0.0  # wandering direction, rad, and its end time, s

    def step(self, now, readings, messages):
        for message in messages:
            if message.content:
                self.news[message.sender] = (now, list(struct.iter_unpack("<ff", message.content)))
        seen = readings.mission["targets"]
        if readings.position is None:
            return Action()  # navigation needs the position sensor
        if seen:
            targets = [self.in_room(readings, target["offset"]) for target in seen]
            goal = [sum(axis) / len(targets) for axis in zip(*targets)]
            # One message per second.
            send = [b"".join(struct.pack("<ff", *at) for at in targets[:8])] if round(now * 20) % 20 == self.rank % 20 else []
            return self.toward(readings, goal, 0.5, "observe", send)
        crowded = [at for sent, targets in self.news.values() if now - sent < NEWS_S and len(targets) > 1 for at in targets]
        if crowded:
            return self.toward(readings, min(crowded, key=lambda at: math.dist(at, readings.position)), 1.0, "search")
        if now >= self.until or self.is_blocked(readings):
            self.course, self.until = self.rng.uniform(-math.pi, math.pi), now + 8.0
        x, y = readings.position
        return self.toward(readings, (x + math.cos(self.course), y + math.sin(self.course)), 0.0, "search")

    def in_room(self, readings, offset):
        """Converts a position from the robot's frame to the room's frame."""
        (x, y), (ahead, left) = readings.position, offset
        cos, sin = math.cos(readings.heading), math.sin(readings.heading)
        return x + cos * ahead - sin * left, y + sin * ahead + cos * left

    def is_blocked(self, readings):
        beams = readings.ahead or ()
        return any(beam and beam[0] < 0.2 for beam in beams) or (readings.front_border or math.inf) < 0.3

    def toward(self, readings, goal, near, doing, send=()):
        dx, dy = goal[0] - readings.position[0], goal[1] - readings.position[1]
        off = math.remainder(math.atan2(dy, dx) - readings.heading, math.tau)
        turn = max(-self.turn, min(self.turn, off / 0.05))
        goes = abs(off) < 0.5 and math.hypot(dx, dy) > near and not self.is_blocked(readings)
        return Action(speed=self.speed if goes else 0.0, turn=turn, doing=doing, send=send)


if __name__ == "__main__":
    main(Watcher)
