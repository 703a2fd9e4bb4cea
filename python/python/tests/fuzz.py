"""Random calls of the package with random arguments, for `test_hostile.py`: `python -X faulthandler fuzz.py SEED CALLS`.

A call may succeed, or raise an exception with one clear line. A crash of the interpreter, a panic of the engine and an exception without a
line end the program with a status other than 0.
"""

import os
import random
import resource
import sys
import tempfile
import threading
from pathlib import Path

import gymnasium
import numpy as np

import alliance_sim
from alliance_sim import math
from alliance_sim.env import RobotEnv, VecEnv, parallel_env

#: Limit of the address space, bytes: a large batch must be refused, and must not take the memory of the machine.
ADDRESS_SPACE = 8 << 30
#: Largest number of threads that call the same environment.
THREADS = 4
#: Largest number of environments that exist at once.
ALIVE = 6

REFUSALS = (
    alliance_sim.AllianceError,
    ArithmeticError,
    AttributeError,
    BufferError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
    gymnasium.error.Error,
)


class Hostile:
    """Value whose conversions fail."""

    def __index__(self):
        raise ValueError("no index")

    def __float__(self):
        raise ValueError("no float")

    def __len__(self):
        return 2**40

    def __getitem__(self, _):
        raise ValueError("no item")


class Idle(alliance_sim.Allocator):
    def step(self, now, messages, sets):
        return None


class Broken(alliance_sim.Allocator):
    def step(self, now, messages, sets):
        return random.Random(int(now)).choice([sets[0], None, "set", sets, now, Hostile()])


class Fuzzer:
    def __init__(self, seed, folder):
        self.rng, self.folder = random.Random(seed), folder
        self.envs = []
        self.refused = 0

    def number(self):
        limits = [0, 1, -1, 2, 7, 255, 2**15, 2**31, 2**32, 2**40, 2**63 - 1, 2**63, 2**64 - 1, 2**64, -(2**63), 10**30]
        return self.rng.choice([*limits, self.rng.randrange(20), 0.5, -0.5, 1e-300, 1e9, 1e308, float("nan"), float("inf"), -0.0])

    def dtype(self):
        return np.dtype(self.rng.choice(["f4", "f8", "f2", ">f4", "i8", "i4", "u8", "i1", "?", "c8", "U3", "S2", "O", "M8[s]", "V5"]))

    def array(self, shape=()):
        shape = shape if self.rng.random() < 0.6 else tuple(self.rng.choice([0, 1, 2, 3, 4, 9]) for _ in range(self.rng.randrange(4)))
        kind = self.rng.choice([np.dtype(np.int64), np.dtype(np.float32), self.dtype()])
        made = np.zeros(shape, kind)
        if kind.kind in "fiu" and made.size:
            made[...] = self.rng.choice([0, 1, 2, 100, -1])
            if self.rng.random() < 0.2 and kind.kind == "f":
                made.flat[-1] = self.rng.choice([np.nan, np.inf, 1e4])
        change = self.rng.randrange(6)
        if change == 0 and made.ndim:
            made = made[::-1]
        elif change == 1:
            made = made.T
        elif change == 2:
            made.flags.writeable = False
        return made

    def anything(self, depth=0):
        pick = self.rng.randrange(13)
        if pick < 3:
            return self.number()
        if pick == 3:
            return self.rng.choice(["", "service", "observe", "drive", "decide", "a\0b", "\ud800", "no\nsuch", "x" * 10_000, "--help", "../..", "*"])
        if pick == 4:
            return self.rng.choice([None, True, False, b"", b"\xff\0", Hostile(), Idle, Broken, object(), len, Path("nowhere")])
        if pick == 5 or depth > 2:
            return self.array()
        if pick < 8:
            return [self.anything(depth + 1) for _ in range(self.rng.randrange(4))]
        if pick == 8:
            keys = ["service", "robots", "name", "seed", "kill", "at_s", "fault", "limit_s", "*", "r1", "", 7]
            return {self.rng.choice(keys): self.anything(depth + 1) for _ in range(self.rng.randrange(4))}
        if pick == 9:
            return tuple(self.anything(depth + 1) for _ in range(self.rng.randrange(3)))
        return self.rng.choice([0, 1, 2, 1.0, "service", "observe", "push"])

    def some(self, *good):
        """Returns one of the good values, or anything."""
        return self.rng.choice(good) if self.rng.random() < 0.8 else self.anything()

    def keywords(self, **good):
        chosen = [key for key in good if self.rng.random() < 0.4]
        given = {key: self.some(*good[key]) for key in chosen}
        if self.rng.random() < 0.05:
            given[self.rng.choice(["envz", "", "self"])] = self.anything()
        return given

    def create(self):
        maker = self.rng.choice([VecEnv, VecEnv, VecEnv, parallel_env, RobotEnv])
        common = {
            "level": ("decide", "drive"),
            "period_s": (None, 1.0, 0.05, 30),
            "ticks": (None, 1, 3),
            "faults": (None, [], [{"fault": {"kill": "r1"}, "at_s": 1}]),
            "robots": (2, 3),
            "size": (2, 5),
            "limit": (3, 20.0),
            "render_mode": (None, "rgb_array"),
        }
        if maker is VecEnv:
            common |= {
                "envs": (1, 2, 5, 2**20, 2**40),
                "threads": (1, 2, 3, 2**33),
                "auto_reset": (True, False),
                "copy": (True, False),
                "controllers": ({}, {"*": "alliance"}, {"r1": Idle}, {"*": Broken}),
            }
        env = maker(self.some("service", "observe", "push", "janitorial", None), **self.keywords(**common))
        self.envs.append(env)
        del self.envs[:-ALIVE]

    def actions(self, env):
        shape = getattr(env, "_shape", (2,))
        if self.rng.random() < 0.6:
            drive = len(shape) == 3
            return np.zeros(shape, np.float32 if drive else np.int64)
        return self.some(self.array(shape), self.array(), {}, {agent: self.anything() for agent in getattr(env, "agents", [])[:2]})

    def use(self):
        """Calls a method of an environment."""
        env = self.rng.choice(self.envs)
        place = self.some(0, 1, 10)
        calls = [
            lambda: env.reset(seed=self.some(1, None, [1, None], 2**64 - 1)),
            lambda: env.reset(options=self.some({"reset_mask": self.array((1,)).astype(bool)}, {})),
            lambda: env.step(self.actions(env)),
            lambda: env.step(self.actions(env)),
            lambda: env.step(self.actions(env)),
            lambda: env.advance(self.actions(env)),
            lambda: env.events(place),
            lambda: env.poses(place),
            lambda: env.faults(place),
            lambda: env.ended(place),
            lambda: env.row(place),
            lambda: env.picture(place, self.some(64, 100)),
            lambda: env.feature_names_of(self.some(0, "r1")),
            lambda: env.render(),
            lambda: env.record(self.folder / str(self.rng.randrange(10**9)), place),
            lambda: env.close(),
            lambda: env.setup,
            lambda: repr(env),
        ]
        self.rng.choice(calls)()

    def damage(self):
        """Changes the arrays of an environment as no user should."""
        env = self.rng.choice(self.envs)
        name = self.rng.choice(["observation", "action_mask", "alive", "reward", "done", "_parts", "_shape", "_type", "num_envs", "_first_action"])
        pick = self.rng.randrange(4)
        if pick == 0:
            setattr(env, name, self.anything())
        elif pick == 1:
            array = getattr(env, name)
            array.resize(self.rng.choice([(0,), (1,), (1000,), array.shape]), refcheck=self.rng.random() < 0.5)
        elif pick == 2:
            getattr(env, name).flags.writeable = False
        else:
            env._parts = [tuple(self.array((1, 2)) for _ in range(self.rng.choice([4, 5, 5, 5, 6])))]

    def engine(self):
        """Calls the engine below an environment."""
        env = self.rng.choice(self.envs)
        batch = getattr(env, "_worlds", None) or getattr(env, "_vec", env)._worlds
        calls = [
            lambda: batch.reset(self.rng.choice([[1], [1, 2], [None], [], [2**64], [-1]])),
            lambda: batch.step(self.actions(env), self.some(True, False)),
            lambda: batch.see(self.some(0, 1), *(self.array((1, 2)) for _ in range(5))),
            lambda: batch.row(self.anything()),
            lambda: batch.sets(self.anything()),
            lambda: batch.feature_names(self.anything()),
            lambda: batch.picture(self.some(0), self.some(64, 0, 1, 2**32 - 1)),
        ]
        self.rng.choice(calls)()

    def values(self):
        """Constructs values and calls functions."""
        function = getattr(math, self.rng.choice(math.__all__))
        calls = [
            lambda: alliance_sim.Set(
                self.some(0, 1),
                self.some("set"),
                self.some(0),
                **self.keywords(cost=(1.0,), since=(0.0,), max_robots=(1,), values=({"a": 1},), priority=(1,)),
            ),
            lambda: alliance_sim.Message(self.some(0), self.some("idle", "message"), **self.keywords(content=(b"x", Hostile()), position=((1.0, 2.0),), task=(1,))),
            lambda: function(*(self.number() for _ in range(self.rng.choice([1, 1, 2])))),
            lambda: alliance_sim.load(self.anything()),
            lambda: alliance_sim.Action(self.anything(), self.anything(), work=self.anything()),
            lambda: alliance_sim.run(
                self.some("service", "observe"),
                self.some({"*": "alliance"}, {"*": Idle}, {"*": Broken}),
                seed=self.some(1, 2),
                limit=self.some(0.5, 1.0, 2),
                **self.keywords(log=(None,), faults=(None, []), robots=(2,), size=(2,), level=("off", "full"), twice=(True,)),
            ),
        ]
        self.rng.choice(calls)()

    def together(self):
        """Makes calls of the same environments in several threads."""
        failures = []

        def calls():
            for _ in range(3):
                try:
                    self.one()
                except BaseException as error:
                    failures.append(error)
                    return

        threads = [threading.Thread(target=calls) for _ in range(self.rng.randint(2, THREADS))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for error in failures:
            raise error

    def one(self):
        """Makes one call. A refusal must have one line."""
        kinds = [self.create, self.values] if not self.envs else [self.create, self.values, self.damage, self.engine, *[self.use] * 8]
        try:
            self.rng.choice(kinds)()
        except REFUSALS as error:
            self.refused += 1
            text = str(error)
            if isinstance(error, alliance_sim.AllianceError) and (not text or "\n" in text):
                raise AssertionError(f"{type(error).__name__} without one line: {text!r}") from error


def main(seed, calls):
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    with tempfile.TemporaryDirectory() as folder:
        # Some logs have relative paths.
        os.chdir(folder)
        fuzzer = Fuzzer(seed, Path(folder))
        for _ in range(calls):
            fuzzer.together() if fuzzer.rng.random() < 0.02 else fuzzer.one()
    print(f"{calls} calls, {fuzzer.refused} refused")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
