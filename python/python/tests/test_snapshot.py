"""Snapshots, copies and pickles of environments in mid-episode."""

import copy
import pickle

import numpy as np
import pytest
from alliance_sim import AllianceError, Allocator
from conftest import needed

needed("pettingzoo")
from alliance_sim.env import RobotEnv, VecEnv, parallel_env  # noqa: E402

KILLED = [
    {"at_s": 4.0, "fault": {"kill": "gold"}},
    {"at_s": 9.0, "fault": {"restart": "gold"}},
    {"at_s": 0.0, "fault": {"drop": {"p": 0.3}}},
    {"at_s": 0.0, "fault": {"delay": {"delay_s": 0.2, "jitter_s": 0.3}}},
]
CASES = [
    ("waste-cleanup", "decide"),
    ("janitorial", "decide"),
    ("parker-box", "decide"),
    ("cmommt", "decide"),
    ("waste-cleanup", "drive"),
    ("parker-box", "drive"),
    ("cmommt", "drive"),
]


class Patient(Allocator):
    """An allocator with a state, which waits for a different time after each task."""

    def reset(self):
        self.past = []

    def step(self, now, messages, sets):
        self.past.append(now)
        free = [option for option in sets if option.applicable]
        return free[len(self.past) // 40 % len(free)] if free else None


def team(scenario, level, **options):
    faults = KILLED if scenario != "parker-box" else KILLED[2:]
    return parallel_env(scenario, level=level, limit=20.0, faults=faults, ticks=10, **options)


def actions(env, seen, rng):
    """Draws an action for each agent. Half of the actions drive ahead, so that the robots get somewhere."""
    drawn = {}
    for agent in env.agents:
        if isinstance(seen[agent], dict):
            drawn[agent] = int(rng.choice(np.flatnonzero(seen[agent]["action_mask"])))
        else:
            drawn[agent] = np.array([1.0, *rng.uniform(-1, 1, 3)], np.float32)
    return drawn


def play(env, seen, seed, steps=None):
    """Plays to the end or for some steps. Returns all results as bytes, and the last observations."""
    rng, all_bytes = np.random.default_rng(seed), []
    while env.agents and steps != 0:
        seen, rewards, terminated, truncated, infos = env.step(actions(env, seen, rng))
        all_bytes.append(pickle.dumps((seen, rewards, terminated, truncated, infos)))
        steps = None if steps is None else steps - 1
    return all_bytes, seen


@pytest.mark.parametrize(("scenario", "level"), CASES)
def test_an_environment_continues_from_its_snapshot(scenario, level):
    env = team(scenario, level)
    seen, _ = env.reset(seed=3)
    # After the kill of gold, before its restart.
    _, seen = play(env, seen, 1, 12)
    snapshot = env.snapshot()
    first, first_hash = play(env, seen, 2)[0], (env.hash, env.outcome)
    assert len(first) > 10
    for other in (7, 2):
        again, infos = env.restore(snapshot)
        assert pickle.dumps(again) == pickle.dumps(seen)
        assert set(infos) == set(env.agents)
        branch = play(env, again, other)[0]
        # Other actions make another branch, the same actions the same bytes.
        assert (branch == first) == (other == 2)
        assert ((env.hash, env.outcome) == first_hash) == (other == 2)
    # A new episode does not depend on the snapshot.
    env.reset(seed=3)
    fresh = team(scenario, level)
    assert play(env, env.reset(seed=3)[0], 1)[0] == play(fresh, fresh.reset(seed=3)[0], 1)[0]


@pytest.mark.parametrize(("scenario", "level"), CASES)
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_in_mid_episode_continues_like_its_original(scenario, level, copied):
    env = team(scenario, level)
    _, seen = play(env, env.reset(seed=3)[0], 1, 12)
    twin = copied(env)
    assert twin.agents == env.agents
    assert twin.row() == env.row()
    original = play(env, seen, 2)[0]
    assert play(twin, seen, 2)[0] == original
    assert (twin.hash, twin.outcome) == (env.hash, env.outcome)
    # A copy after the end has the end.
    assert copied(env).hash == env.hash
    assert play(twin, twin.reset(seed=4)[0], 2)[0] == play(env, env.reset(seed=4)[0], 2)[0]


def test_controllers_in_python_are_part_of_a_snapshot():
    env = team("janitorial", "decide", controllers={"blue": Patient})
    _, seen = play(env, env.reset(seed=3)[0], 1, 12)
    snapshot, twin, loaded = env.snapshot(), copy.deepcopy(env), pickle.loads(pickle.dumps(env))
    first = play(env, seen, 2)[0]
    env.restore(snapshot)
    assert play(env, seen, 2)[0] == first
    assert play(twin, seen, 2)[0] == first
    assert play(loaded, seen, 2)[0] == first


def test_a_killed_agent_that_left_stays_out():
    env = team("janitorial", "decide", revive=False)
    _, seen = play(env, env.reset(seed=3)[0], 1, 12)
    assert "gold" not in env.agents
    snapshot = env.snapshot()
    play(env, seen, 2)
    assert env.agents == []
    env.restore(snapshot)
    assert env.agents == [agent for agent in env.possible_agents if agent != "gold"]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_restores_the_environments_of_a_mask(threads):
    env = VecEnv("service", 5, threads=threads, robots=4, size=12, limit=60.0, auto_reset=False)
    rng = np.random.default_rng(1)
    acts = [np.where(rng.random((5, 4)) < 0.5, 0, rng.integers(0, 7, (5, 4))) for _ in range(40)]

    def steps(first, last):
        return [[np.array(part) for part in env.step(one)[:4]] for one in acts[first:last]]

    env.reset(seed=1)
    steps(0, 10)
    mask = np.array([False, True, False, True, True])
    some, everything, one = env.snapshot(mask), env.snapshot(), env.snapshot(np.arange(5) == 3)
    first = steps(10, 40)
    seen, infos = env.restore(some, mask)
    assert infos["action_mask"].shape == (5, 4, 13)
    # The others stay where they were.
    assert (seen[~mask] == first[-1][0][~mask]).all()
    again = steps(10, 40)
    for before, now in zip(first, again, strict=True):
        assert (before[0][mask] == now[0][mask]).all()
    assert not all((before[0] == now[0]).all() for before, now in zip(first, again, strict=True))
    env.restore(everything)
    again = steps(10, 40)
    assert all((a == b).all() for before, now in zip(first, again, strict=True) for a, b in zip(before, now, strict=True))
    # One state for all: the same actions lead to the same observations.
    env.restore(one)
    same = [np.broadcast_to(act[3], (5, 4)) for act in acts[10:20]]
    for act, before in zip(same, first, strict=False):
        seen = env.step(act)[0]
        assert (seen == before[0][3]).all()
    # The snapshot of a deep copy fits the original.
    twin = copy.deepcopy(env)
    twin.restore(everything)
    env.restore(twin.snapshot())
    assert (env.step(acts[10])[0] == first[0][0]).all()
    with pytest.raises(ValueError, match="the snapshot has 3 environments, and the mask 5"):
        env.restore(some)
    with pytest.raises(ValueError, match="mask: it must be 5 booleans"):
        env.snapshot(np.ones(4, bool))
    with pytest.raises(ValueError, match="from another environment"):
        other = VecEnv("service", 5, robots=4, size=12)
        other.reset(seed=1)
        other.restore(everything)
    with pytest.raises(TypeError, match="a batch in mid-episode cannot be pickled"):
        pickle.dumps(env)
    with pytest.raises(RuntimeError, match="call reset"):
        VecEnv("service", 5, robots=4, size=12).snapshot()


def test_one_robot_continues_from_its_snapshot():
    env = RobotEnv("service", robots=4, size=12, limit=60.0)
    rng = np.random.default_rng(1)
    acts = rng.integers(0, 7, 59)
    env.reset(seed=3)
    for act in acts[:20]:
        env.step(act)
    snapshot, twin = env.snapshot(), copy.deepcopy(env)
    loaded = pickle.loads(pickle.dumps(env))

    def rest(one):
        results = [pickle.dumps(one.step(act)) for act in acts[20:]]
        return results, one.np_random.integers(2**32)

    first = rest(env)
    env.restore(snapshot)
    assert rest(env)[0] == first[0]
    assert rest(twin) == first
    assert rest(loaded) == first


def test_a_recorded_episode_has_no_snapshot(tmp_path):
    env = team("janitorial", "decide")
    env.record(tmp_path / "log")
    _, seen = play(env, env.reset(seed=3)[0], 1, 12)
    with pytest.raises(AllianceError, match="a recorded episode cannot be copied"):
        env.snapshot()
    # The episode continues.
    play(env, seen, 2)
    assert env.hash is not None
