"""A whole mind for the mission observe: it follows the targets that it sees and tells its teammates of them; it goes where somebody sees
more than one, and else it wanders. alliance run SCENARIO --mind watcher='python3 watcher.py'
"""

import math
import struct

from alliance_agent import Agent, Deed, main

NEWS_S = 3.0  # how long it counts on what a teammate said


class Watcher(Agent):
    def reset(self):
        body = self.setup["scenario"]["body"]
        self.speed, self.turn = body["speed_m_s"], math.radians(body["turn_deg_s"])
        self.news = {}  # teammate -> when it told, and the targets that it sees
        self.course, self.until = 0.0, 0.0  # where it wanders, and how long

    def step(self, now, readings, heard):
        for word in heard:
            if word.said:
                self.news[word.sender] = (now, list(struct.iter_unpack("<ff", word.said)))
        seen = readings.mission["targets"]
        if readings.position is None:
            return Deed()  # without its position sensor it knows no way
        if seen:
            own = [self.in_room(readings, target["offset"]) for target in seen]
            goal = [sum(axis) / len(own) for axis in zip(*own)]
            # Once a second, as heartbeats are.
            say = [b"".join(struct.pack("<ff", *at) for at in own[:8])] if round(now * 20) % 20 == self.rank % 20 else []
            return self.toward(readings, goal, 0.5, "observe", say)
        crowded = [at for told, them in self.news.values() if now - told < NEWS_S and len(them) > 1 for at in them]
        if crowded:
            return self.toward(readings, min(crowded, key=lambda at: math.dist(at, readings.position)), 1.0, "search")
        if now >= self.until or self.is_blocked(readings):
            self.course, self.until = self.rng.uniform(-math.pi, math.pi), now + 8.0
        x, y = readings.position
        return self.toward(readings, (x + math.cos(self.course), y + math.sin(self.course)), 0.0, "search")

    def in_room(self, readings, offset):
        """A place in the robot's frame as one in the room's."""
        (x, y), (ahead, left) = readings.position, offset
        cos, sin = math.cos(readings.heading), math.sin(readings.heading)
        return x + cos * ahead - sin * left, y + sin * ahead + cos * left

    def is_blocked(self, readings):
        beams = readings.ahead or ()
        return any(beam and beam[0] < 0.2 for beam in beams) or (readings.front_border or math.inf) < 0.3

    def toward(self, readings, goal, near, doing, say=()):
        dx, dy = goal[0] - readings.position[0], goal[1] - readings.position[1]
        off = math.remainder(math.atan2(dy, dx) - readings.heading, math.tau)
        turn = max(-self.turn, min(self.turn, off / 0.05))
        goes = abs(off) < 0.5 and math.hypot(dx, dy) > near and not self.is_blocked(readings)
        return Deed(speed=self.speed if goes else 0.0, turn=turn, doing=doing, say=say)


if __name__ == "__main__":
    main(Watcher)
