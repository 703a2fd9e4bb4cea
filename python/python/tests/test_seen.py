"""Readings and observations match the world, and actions have their effect there."""

import numpy as np
import pytest
from alliance_sim import Action, Agent, run
from alliance_sim.env import VecEnv, parallel_env

#: One robot in the middle of the room, another one ahead and to its left.
PAIR = [
    {"name": "one", "start": {"x_m": 5.0, "y_m": 4.0, "heading_deg": 30.0}},
    {"name": "two", "start": {"x_m": 7.0, "y_m": 6.0, "heading_deg": -90.0}},
]


def waste(robots, **more):
    return {"name": "seen", "limit_s": 60.0, "robots": robots} | more


def named(env, agent=0):
    """Returns an agent's observation by feature name."""
    return dict(zip(env.feature_names, env.observation[0, agent].tolist(), strict=True))


def test_an_observation_has_the_positions_of_the_robot_and_its_teammates():
    third = {"name": "three", "start": {"x_m": 2.0, "y_m": 7.0, "heading_deg": 100.0}}
    env = VecEnv(waste([*PAIR, third], limit_s=10.0), level="drive")
    env.reset(2)
    for _ in range(45):
        env.step(np.zeros((1, 3, 4)))
    room = env.setup["scenario"]["room"]
    size = np.array([room["width_m"], room["height_m"]])
    poses = env.poses()
    for agent, (x, y, heading) in enumerate(poses):
        seen = named(env, agent)
        assert [seen["position.x"], seen["position.y"]] == pytest.approx(2 * np.array([x, y]) / size - 1, abs=1e-5)
        assert [seen["heading.cos"], seen["heading.sin"]] == pytest.approx([np.cos(heading), np.sin(heading)], abs=1e-5)
        offsets = sorted((other[:2] - [x, y] for place, other in enumerate(poses) if place != agent), key=np.linalg.norm)
        for place, offset in enumerate(offsets):
            assert seen[f"mate{place}.received"] == seen[f"mate{place}.there"] == 1
            observed = np.array([seen[f"mate{place}.x"], seen[f"mate{place}.y"]]) * size.max()
            assert observed == pytest.approx(offset, abs=1e-3)
        # A team of three has two teammates.
        assert "mate2.received" not in seen
        assert seen["time"] == pytest.approx(45 * 0.05 / 10, abs=1e-6)


def test_a_wall_on_the_left_is_observed_on_the_left():
    wall = {"x_m": 4.0, "y_m": 4.25, "width_m": 2.0, "height_m": 0.3}
    mud = {"x_m": 5.1, "y_m": 3.0, "width_m": 1.0, "height_m": 1.2, "penetrability": 0.5}
    robot = {"name": "one", "start": {"x_m": 5.0, "y_m": 4.0, "heading_deg": 0.0}}
    scenario = waste([robot], obstacles=[wall, mud])
    env = VecEnv(scenario, level="drive")
    env.reset()
    seen = named(env)
    assert all(0 < seen[f"left{beam}.near"] < 1 and seen[f"right{beam}.near"] == 0 for beam in range(3))
    assert (seen["ground.works"], seen["ground.here"], seen["ground.ahead"]) == (1, 0, -0.5)

    class Looker(Agent):
        def step(self, now, readings, messages):
            assert all(readings.left) and not any(readings.right)
            assert readings.ground == (1.0, 0.5)
            return Action()

    run(scenario, {"one": Looker}, limit=0.5)


def test_a_driven_robot_picks_up_carries_and_drops():
    spill = {"name": "here", "items": 12, "x_fraction": 0.5, "y_fraction": 0.5}
    robot = {"name": "one", "start": {"x_m": 5.0, "y_m": 4.0, "heading_deg": 30.0}}
    env = VecEnv(waste([robot], waste={"spills": [spill]}), level="drive", auto_reset=False)
    env.reset()
    kinds = []

    def step(*action):
        env.step([[action]])
        kinds.extend(event["kind"] for event in env.events())

    for _ in range(600):
        seen = named(env)
        assert seen["gripper.works"] == 1
        if seen["holding"]:
            break
        # The direction of the item from the robot.
        turn = np.arctan2(seen["item0.y"], seen["item0.x"]) if seen["item0.there"] else 0.0
        step(1.0 if abs(turn) < 0.3 else 0.0, np.clip(2 * turn, -1, 1), 1.0, 0.0)
    assert "picked" in kinds and named(env)["holding"] == 1
    step(0.0, 0.0, 0.0, 0.0)
    step(0.0, 0.0, 0.0, 0.0)
    assert "dropped" not in kinds and named(env)["holding"] == 1, "the item was dropped"
    step(0.0, 0.0, -1.0, 0.0)
    step(0.0, 0.0, 0.0, 0.0)
    assert "dropped" in kinds and named(env)["holding"] == 0


def test_the_observation_of_a_set_matches_its_mask():
    env = VecEnv("waste-cleanup", limit=100.0)
    env.reset(1)
    names, sets = env.feature_names, env.sets[0]
    masks = set()
    for step in range(20):
        before = named(env)
        mask = env.action_mask[0, 0]
        masks.add(mask.tobytes())
        assert mask[0] == 1
        for place, name in enumerate(sets, 1):
            assert before[f"{name}.applicable"] == mask[place]
            assert 0 < before[f"{name}.cost"] <= 1
        chosen = int(mask[1:].argmax()) + 1 if step >= 10 else 0
        env.step(np.array([[chosen, 0, 0]]))
        active = [name for name in sets if named(env)[f"{name}.active"]]
        assert active == [] if step < 10 else active in ([], sets[chosen - 1 : chosen]) and (step > 10 or active)
        for name in active:
            # The age rises by 1/31 of the way to 1 in a second.
            age = named(env)[f"{name}.age"]
            again = before[f"{name}.active"]
            assert age > before[f"{name}.age"] if again else 0 < age <= 1 / 31 + 1e-6
    assert len(masks) > 1 or any(0 in set(mask) for mask in masks), "every set was always applicable"
    assert len(names) == env.observation.shape[-1]


def test_an_observation_has_places_and_claims_of_sets():
    env = VecEnv("service", robots=3, size=6, limit=60.0)
    env.reset(1)
    room = env.setup["scenario"]["room"]
    points = env.setup["scenario"]["service"]["points"]
    for _ in range(3):
        env.step(np.array([[1, 1, 4]]))
    poses = env.poses()
    for agent in range(3):
        seen = named(env, agent)
        for name, point in zip(env.sets[agent], points, strict=True):
            if seen[f"{name}.there"]:
                observed = np.array([seen[f"{name}.x"], seen[f"{name}.y"]]) * max(room["width_m"], room["height_m"])
                assert observed == pytest.approx(np.array([point["x_m"], point["y_m"]]) - poses[agent, :2], abs=0.05)
    assert sum(named(env, 0)[f"{name}.there"] for name in env.sets[0]) >= 4
    claims = [[named(env, agent)[f"{env.sets[agent][place]}.claims"] for place in range(6)] for agent in range(3)]
    assert claims[0] == [1, 0, 0, 1, 0, 0] and claims[2] == [2, 0, 0, 0, 0, 0]


def test_agents_with_other_sets_have_other_feature_names():
    env = parallel_env("janitorial", limit=60.0)
    names = {agent: env.feature_names_of(agent) for agent in env.possible_agents}
    assert names["gold"] == env.feature_names != names["blue"]
    for agent, own in names.items():
        size = env.observation_space(agent)["observation"].shape[0]
        kinds = {name.split("(")[1].split(")")[0] for name in own if name.startswith("serve(")}
        skills = {"gold": {"garbage", "dust"}, "blue": {"dust", "floor"}, "green": {"garbage", "floor"}}
        assert len(own) == size and kinds == skills[agent]


def test_a_step_ends_with_its_behavior_set():
    env = VecEnv("janitorial", level="decide", period_s=300.0, limit=300.0, auto_reset=False)
    env.reset(1)
    env.step(np.array([[int(env.action_mask[0, 0, 1:].argmax()) + 1, 0, 0]]))
    times = [event["time"] for event in env.events()]
    assert not env.done[0] and 0 < times[-1] < 200
    ended = [event for event in env.events() if event["kind"] == "hibernated"]
    assert [event["robot"] for event in ended] == env.agents[:1]


def test_the_reward_of_observe_is_targets_in_sight_times_seconds():
    env = VecEnv("cmommt", level="drive", limit=10.0, auto_reset=False)
    env.reset(1)
    seen = total = 0.0
    for _ in range(100):
        env.step(np.ones((1, 5, 4)) * [1.0, 0.3, 0.0, 0.0])
        total += env.reward[0]
        seen += next(iter(env.row().values())) * 0.05
    assert seen > 0 and total == pytest.approx(seen, abs=1e-3)


def test_a_finished_episode_restarts_once():
    env = VecEnv("cmommt", 2, level="drive", limit=2.0)
    first = env.reset(5)[0].copy()
    ends = []
    for step in range(1, 100):
        *_, done, _ = env.step(np.ones((2, 5, 4)))
        if done.any():
            ends.append(step)
            assert done.all()
    # `reset` makes the first of 40 ticks.
    assert ends == [39, 39 + 39 + (ends[1] - 78)] and 78 <= ends[1] <= 79
    assert not np.array_equal(first, env.observation)


class Lone(Agent):
    """Repeats one action."""

    action = Action()

    def step(self, now, readings, messages):
        return self.action


def lone(action):
    return type("Lone", (Lone,), {"action": action})


def test_work_at_a_point_completes_it():
    point = {"kind": "dust", "x_m": 5.0, "y_m": 4.0}
    scenario = {
        "name": "one",
        "limit_s": 20.0,
        "robots": [{"name": "one", "start": {"x_m": 5.0, "y_m": 4.0, "heading_deg": 0.0}}],
        "service": {"points": [point], "kinds": [{"name": "dust", "work_s": {"min": 5.0, "max": 5.0}}]},
    }
    assert run(scenario, {"one": lone(Action())}).outcome == "time-limit"
    done = run(scenario, {"one": lone(Action(work=0))})
    assert done.complete and 5.0 <= done.seconds <= 5.2


def test_a_report_at_the_site_is_logged(tmp_path):
    def kinds(action, folder):
        done = run(waste([{"name": "one"}]), {"one": lone(action)}, limit=1.0, log=tmp_path / folder)
        return set(done.load()["events"]["kind"])

    assert "reported" in kinds(Action(report=True), "reporting")
    assert "reported" not in kinds(Action(), "silent")


def test_progress_is_received_and_logged(tmp_path):
    received_of = []

    class Worker(Agent):
        def step(self, now, readings, messages):
            return Action(doing=self.sets[0], progress=now in (1.0, 2.0))

    class Listener(Agent):
        collected = {"received_of"}

        def step(self, now, readings, messages):
            received_of.extend((message.progress, message.task, message.carrying, message.position) for message in messages if message.state == "executing")
            return Action()

    done = run(waste(PAIR), {"one": Worker, "two": Listener}, limit=4.0, log=tmp_path / "run")
    progress = [count for count, *_ in received_of]
    assert progress == sorted(progress) and set(progress) == {0, 1, 2}
    assert {(task, carrying) for _, task, carrying, _ in received_of} == {(0, False)}
    assert {tuple(np.round(position, 4)) for *_, position in received_of} == {(5.0, 4.0)}
    assert list(done.load()["events"]["kind"]).count("progress") == 2
