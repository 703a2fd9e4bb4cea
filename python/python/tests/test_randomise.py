"""Starts and layouts that are drawn from the seed, and terms of the reward."""

import json

import numpy as np
import pytest
from alliance_sim import ScenarioError, run
from conftest import needed

needed("pettingzoo")
from alliance_sim.env import RobotEnv, VecEnv, parallel_env  # noqa: E402

#: Scenario, size, and whether its layout has places to draw. Targets of observe depend on the seed anyway.
MISSIONS = {
    "waste-cleanup": ({}, True),
    "service": ({"robots": 4, "size": 12}, True),
    "parker-box": ({}, True),
    "cmommt": ({}, False),
}
SEEDS = range(1, 21)


def starts(file):
    return [tuple(robot["start"].values()) for robot in file["scenario"]["robots"]]


def stated(value):
    """Returns the part of run.json without absent values, which a dict of a scenario cannot contain."""
    if isinstance(value, dict):
        return {key: stated(below) for key, below in value.items() if below is not None}
    return [stated(below) for below in value] if isinstance(value, list) else value


def free(at, scenario, others, gap):
    """Returns whether a disc is inside the room and clear of obstacles and of other discs."""
    room, radius = scenario["room"], scenario["body"]["radius_m"]
    inside = radius <= at[0] <= room["width_m"] - radius and radius <= at[1] <= room["height_m"] - radius
    solids = [each for each in scenario.get("obstacles", []) if each.get("penetrability", 0.0) <= 0.1]
    for each in solids:
        nearest = np.clip(at, [each["x_m"], each["y_m"]], [each["x_m"] + each["width_m"], each["y_m"] + each["height_m"]])
        inside &= bool(np.hypot(*(np.array(at) - nearest)) >= radius - 1e-3)
    return inside and all(np.hypot(*np.subtract(at, other)) >= gap - 1e-3 for other in others)


@pytest.mark.parametrize("mission", MISSIONS)
def test_each_seed_draws_valid_starts(mission):
    options, _ = MISSIONS[mission]
    files = [run(mission, seed=seed, limit=1.0, randomise={"start"}, **options).file for seed in SEEDS]
    assert len({str(starts(file)) for file in files}) == len(SEEDS)
    for file in files:
        scenario = file["scenario"]
        places = [start[:2] for start in starts(file)]
        for rank, place in enumerate(places):
            assert free(place, scenario, places[:rank], 2 * scenario["body"]["radius_m"])


@pytest.mark.parametrize("mission", [name for name, (_, draws) in MISSIONS.items() if draws])
def test_each_seed_draws_a_layout(mission):
    options, _ = MISSIONS[mission]
    sections = []
    for seed in SEEDS:
        scenario = run(mission, seed=seed, limit=1.0, randomise="layout", **options).file["scenario"]
        sections.append(scenario[{"waste-cleanup": "waste", "parker-box": "push"}.get(mission, mission)])
        if mission == "service":
            points = [(point["x_m"], point["y_m"]) for point in sections[-1]["points"]]
            assert len(points) == 12
            for place, point in enumerate(points):
                assert free(point, scenario, points[:place], 2 * scenario["body"]["radius_m"])
        if mission == "waste-cleanup":
            waste, room = sections[-1], scenario["room"]
            size = np.array([room["width_m"], room["height_m"]])
            discs = [(waste["deposit"], waste["deposit"]["radius_m"])] + [(spill, waste["spill_radius_m"]) for spill in waste["spills"]]
            centers = [size * [disc["x_fraction"], disc["y_fraction"]] for disc, _ in discs]
            for (center, (_, radius)), place in zip(zip(centers, discs, strict=True), range(3), strict=True):
                assert (center >= radius - 1e-3).all() and (center <= size - radius + 1e-3).all()
                for other in range(place):
                    assert np.hypot(*(center - centers[other])) >= radius + discs[other][1] - 1e-3
    assert len({json.dumps(section) for section in sections}) == len(SEEDS)


@pytest.mark.parametrize("mission", MISSIONS)
def test_a_drawn_scenario_repeats_the_run_without_draws(mission):
    options, _ = MISSIONS[mission]
    drawn = run(mission, seed=7, limit=20.0, randomise=["start", "layout"], **options)
    plain = run(mission, seed=7, limit=20.0, **options)
    assert drawn.hash != plain.hash
    assert drawn.hash == run(mission, seed=7, limit=20.0, randomise=["layout", "start"], **options).hash
    scenario = drawn.file["scenario"]
    again = run(stated(scenario), seed=7)
    assert again.hash == drawn.hash


def test_an_exported_run_has_the_same_hash_in_processes(tmp_path, alliance):
    drawn = run("service", seed=7, limit=20.0, randomise={"start", "layout"}, robots=4, size=12, log=tmp_path / "log")
    alliance("export", "log", "--scenario=drawn.toml")
    alliance("run", "drawn.toml", "--seed", "7", "--speed", "max", "--out", "again", "--no-page", status=(0, 1))
    assert json.loads((tmp_path / "again/run.json").read_text())["hash"] == drawn.hash


@pytest.mark.parametrize("mission", MISSIONS)
def test_an_episode_has_the_draws_of_a_run(mission):
    options, _ = MISSIONS[mission]
    drawn = run(mission, {"*": "alliance"}, seed=7, limit=10.0, randomise=["start", "layout"], **options)
    env = VecEnv(mission, 1, controllers={"*": "alliance"}, limit=10.0, randomise=["start", "layout"], auto_reset=False, hashes=True, **options)
    poses = set()
    for seed in [*SEEDS, 7]:
        env.reset(seed)
        poses.add(env.poses().tobytes())
    assert len(poses) == len(SEEDS)
    while not env.done[0]:
        env.step(np.zeros((1, 0), np.int64))
    assert env.ended()[0] == drawn.hash


def test_mistakes_have_one_line():
    with pytest.raises(ScenarioError, match="randomise: there is no 'places'; use 'start' or 'layout'"):
        run("service", randomise={"places"})
    with pytest.raises(ScenarioError, match="shaping: there is no term 'closeness'; there are progress, approach"):
        VecEnv("service", shaping={"closeness": 1.0})
    with pytest.raises(ScenarioError, match="the weight inf of 'travel' is not finite"):
        VecEnv("service", shaping={"travel": float("inf")})
    with pytest.raises(ScenarioError, match="reward and shaping: both state the reward"):
        parallel_env("service", shaping={"travel": 1.0}, reward=lambda before, after, events: 0.0)
    # Two robots of 0.2 m and the places of the mission have no room in a closet.
    closet = {"room": {"width_m": 1.0, "height_m": 1.0}, "waste": {}, "robots": [{"name": "one"}, {"name": "two"}]}
    with pytest.raises(ScenarioError, match="randomise: the last of 200 draws of a scenario fails"):
        run(closet, randomise={"layout"})


def test_terms_of_the_reward_have_their_formulas():
    options = {"robots": 3, "size": 8, "limit": 60.0, "auto_reset": False}
    rng = np.random.default_rng(1)

    def episode(env):
        env.reset(3)
        rewards, poses = [], [env.poses()]
        while not env.done[0]:
            env.step(acts[len(rewards)])
            rewards.append(float(env.reward[0]))
            poses.append(env.poses())
        return np.array(rewards), np.array(poses)

    acts = [rng.integers(0, 9, (1, 3)) for _ in range(200)]
    plain, poses = episode(VecEnv("service", **options))
    ways = np.hypot(*np.moveaxis(np.diff(poses[..., :2], axis=0), -1, 0)).sum(1)
    travel = episode(VecEnv("service", shaping={"travel": -0.5}, **options))[0]
    assert np.allclose(travel, plain - 0.5 * ways, atol=1e-5)
    double = episode(VecEnv("service", shaping={"progress": 2.0}, **options))[0]
    assert np.allclose(double, 2.0 * plain)
    # A robot that drives along a line to the only open point approaches it by its way.
    scenario = {
        "room": {"width_m": 12.0, "height_m": 9.0},
        "service": {
            "reach_m": 0.3,
            "kinds": [{"name": "visit", "work_s": {"min": 1.0, "max": 1.0}}],
            "points": [{"kind": "visit", "x_m": 8.0, "y_m": 4.5}],
        },
        "robots": [{"name": "one", "start": {"x_m": 2.0, "y_m": 4.5, "heading_deg": 0.0}, "skills": {"visit": 1.0}}],
    }
    env = RobotEnv(scenario, shaping={"approach": 1.0, "progress": 0.0}, ticks=20)
    env.reset(seed=1)
    total, ended = 0.0, False
    while not ended:
        _, reward, ended, _, _ = env.step(1)
        total += reward
    assert 5.6 < total < 6.01


def test_contact_counts_the_time_near_something():
    env = VecEnv("cmommt", level="drive", ticks=10, limit=30.0, shaping={"progress": 0.0, "contact": -1.0}, auto_reset=False)
    env.reset(1)
    total = 0.0
    # All robots drive ahead into the wall.
    while not env.done[0]:
        env.step(np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (1, len(env.agents), 1)))
        assert -0.5 * len(env.agents) <= env.reward[0] <= 0.0
        total += env.reward[0]
    assert total < -5.0
