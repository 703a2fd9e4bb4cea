"""Learning environments."""

import copy
import json
import os
import pickle
import warnings

import numpy as np
import pytest
from alliance_sim import AllianceError, Allocator, ScenarioError, load, run
from alliance_sim.env import VecEnv, parallel_env
from conftest import needed

needed("pettingzoo")
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test
from pettingzoo.utils.conversions import parallel_to_aec

KILLED = [{"at_s": 2.0, "fault": {"kill": "gold"}}, {"at_s": 4.0, "fault": {"restart": "gold"}}]
SCENARIOS = {"waste": "waste-cleanup", "service": "janitorial", "push": "parker-box", "observe": "cmommt"}
DECIDE = [(mission, "decide") for mission in SCENARIOS]
DRIVE = [(mission, "drive") for mission in ("waste", "push", "observe")]


@pytest.mark.parametrize(("mission", "level"), DECIDE + DRIVE)
@pytest.mark.parametrize("has_faults", [False, True])
@pytest.mark.parametrize("revive", [True, False])
def test_the_tests_of_pettingzoo_pass(mission, level, has_faults, revive):
    killed = "red" if mission == "push" else "gold"
    faults = [{"at_s": 2.0, "fault": {"kill": killed}}, {"at_s": 4.0, "fault": {"restart": killed}}]

    def make():
        chosen = faults if has_faults else None
        return parallel_env(SCENARIOS[mission], level=level, faults=chosen, revive=revive, limit=6.0)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        parallel_api_test(make(), num_cycles=200)
        parallel_seed_test(make, num_cycles=60)


def test_a_copy_is_created_from_the_same_arguments():
    env = parallel_env("janitorial", limit=20.0, faults=KILLED, revive=False, info_events=True)
    env.reset(seed=3)
    copies = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
    hashes = set()
    for one in [env, *copies]:
        one.reset(seed=3)
        while one.agents:
            infos = one.step({})[4]
        hashes |= {info["hash"] for info in infos.values()}
        assert one.possible_agents == env.possible_agents
    assert len(hashes) == 1


def test_the_checker_of_gymnasium_passes_for_one_robot():
    import gymnasium

    class Single(gymnasium.Env):
        """An environment of the first robot only."""

        def __init__(self):
            self.team = parallel_env("observe", level="drive", robots=1, limit=5.0)
            self.name = self.team.possible_agents[0]
            self.observation_space = self.team.observation_space(self.name)
            self.action_space = self.team.action_space(self.name)

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            seen, infos = self.team.reset(seed, options)
            return seen[self.name], infos[self.name]

        def step(self, action):
            return tuple(values[self.name] for values in self.team.step({self.name: action}))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        check_env(Single(), skip_render_check=True)


def test_the_environment_can_be_wrapped_for_sequential_agents():
    env = parallel_to_aec(parallel_env("janitorial", limit=3.0))
    env.reset(seed=1)
    turns = []
    for agent in env.agent_iter():
        turns.append(agent)
        _, _, terminated, truncated, _ = env.last()
        env.step(None if terminated or truncated else 0)
    assert turns[:4] == ["gold", "blue", "green", "gold"] and len(turns) == 4 * 3, "three steps of a second, and the final one"


@pytest.mark.parametrize("mission", ["waste", "service", "push", "observe"])
def test_an_episode_with_rust_controllers_is_identical_to_the_run(mission):
    env = parallel_env(mission, controllers={"*": "alliance"}, robots=3, limit=20.0, period_s=0.7)
    env.reset(seed=5)
    assert env.agents == []
    steps = 0
    while env.hash is None and steps < 100:
        env.step({})
        steps += 1
    assert env.hash == run(mission, seed=5, robots=3, limit=20.0).hash


def test_actions_are_equivalent_to_the_decisions_of_an_allocator(tmp_path):
    """With steps of one tick, an episode with an allocator's decisions as actions is identical to the allocator's run."""

    class Environment(Allocator):
        """Keeps its set while that is applicable, else takes the applicable set with the lowest id."""

        def step(self, now, messages, sets):
            if now == 0:
                return None
            mine = next((option for option in sets if option.active), None)
            free = [option for option in sets if option.applicable]
            return mine if mine in free else min(free, key=lambda option: option.id, default=None)

    done = run("janitorial", {"*": type("Chooser", (Environment,), {})}, 3, limit=20.0, log=tmp_path / "controller")
    chosen = load(tmp_path / "controller", "numpy")["allocation"]
    env = parallel_env("janitorial", period_s=0.05, limit=20.0)
    env.reset(seed=3)
    env.record(tmp_path / "recorded")
    env.reset(seed=3)
    numbers = {agent: {name: place for place, name in enumerate(sets, 1)} for agent, sets in env.sets.items()}
    wanted = {}
    for time, robot, set_, state in zip(chosen["t_ms"], chosen["robot"], chosen["behavior_set"], chosen["state"], strict=True):
        if state == "active":
            wanted[int(time), str(robot)] = numbers[str(robot)][str(set_)]
    tick = 1
    while env.hash is None:
        env.step({agent: wanted.get((50 * tick, agent), 0) for agent in env.possible_agents})
        tick += 1
    recorded = load(tmp_path / "recorded", "numpy")["allocation"]
    for key in chosen:
        assert np.array_equal(recorded[key], chosen[key]), key
    assert done.result["ticks"] == tick == 400


def test_masks_crashes_and_faults_in_force():
    env = parallel_env("janitorial", faults=KILLED, limit=6.0, info_events=True)
    seen, infos = env.reset(seed=1)
    assert env.observation_space("gold") is env.observation_space("gold")
    assert len(env.feature_names) == len(seen["gold"]["observation"])
    at_first, alive, faults = env.state(), [], set()
    while env.agents:
        actions = {agent: env.action_space(agent).sample(seen[agent]["action_mask"]) for agent in env.agents}
        seen, rewards, terminations, truncations, infos = env.step(actions)
        alive.append(infos["gold"]["alive"])
        faults.update(infos["gold"]["faults"])
        assert len(set(rewards.values())) == 1
        if not infos["gold"]["alive"]:
            assert not seen["gold"]["observation"].any()
            assert seen["gold"]["action_mask"].tolist() == [1] + [0] * (len(seen["gold"]["action_mask"]) - 1)
    assert alive[0] and not all(alive) and alive[-1], "gold was killed and restarted"
    assert all(truncations.values()) and not any(terminations.values())
    assert env.state().shape == at_first.shape and not np.array_equal(env.state(), at_first)
    assert "kill gold" in faults
    assert infos["gold"]["outcome"] == "time-limit" and len(infos["gold"]["hash"]) == 16


def test_without_revival_a_killed_agent_is_terminated():
    env = parallel_env("janitorial", faults=KILLED, limit=6.0, revive=False)
    env.reset(seed=1)
    gone = []
    while env.agents:
        _, _, terminations, _, _ = env.step({})
        gone += [agent for agent, over in terminations.items() if over]
    assert gone == ["gold"]


def test_an_action_drives_its_robot_only():
    env = parallel_env("observe", level="drive", limit=10.0)
    env.reset(seed=1)
    first, *others = env.possible_agents
    before = env.poses()
    for _ in range(20):
        env.step({first: np.array([1.0, 0.0, 0.0, 0.0], np.float32)})
    moved = np.hypot(*(env.poses() - before)[:, :2].T)
    assert moved[0] > 0.1 and not moved[1:].any(), moved
    assert others
    before = env.poses()[0]
    env.step({first: np.array([-1.0, 1.0, 0.0, 0.0], np.float32)})
    x, y, turned = env.poses()[0] - before
    assert (x, y) == (0, 0) and 0 < np.mod(turned, 2 * np.pi) < 0.2, "robots do not reverse; left is counter-clockwise"


def test_a_robot_without_an_action_does_not_move():
    env = parallel_env("cmommt", level="drive", limit=10.0)
    env.reset(seed=1)
    env.step({env.agents[0]: np.ones(4, np.float32)})
    before = env.poses()
    env.step({})
    assert np.array_equal(env.poses(), before)


def test_a_complete_episode_is_terminated_and_not_truncated():
    env = parallel_env("service", controllers={"r2": "nearest", "r3": "nearest"}, robots=3, size=2, info_events=True)
    env.reset(seed=1)
    while env.agents:
        _, _, terminations, truncations, infos = env.step({})
    assert terminations == {"r1": True} and truncations == {"r1": False}
    assert infos["r1"]["outcome"] == "complete"
    with pytest.raises(RuntimeError, match=r"call reset\(\) first"):
        env.step({})


def test_a_recorded_episode_with_rust_controllers_is_the_log_of_a_run(alliance, tmp_path):
    env = parallel_env("waste-cleanup", controllers={"*": "nearest"}, limit=5.0)
    env.record(tmp_path / "episode")
    env.reset(seed=2)
    while env.hash is None:
        env.step({})
    assert load(tmp_path / "episode").run["hash"] == env.hash
    assert not (tmp_path / "episode/foreign.bin").exists()
    assert alliance("replay", "episode").stderr == f"identical: 100 ticks, hash {env.hash}\n"
    alliance("report", "episode")


@pytest.mark.parametrize(("mission", "level"), DECIDE + DRIVE)
def test_recorded_actions_are_replayed_without_python(alliance, tmp_path, mission, level):
    *_, killed = names = {"push": ["genghis", "red"]}.get(mission, ["blue", "gold"])
    faults = [
        {"at_s": 2.0, "for_s": 2.0, "fault": {"kill": killed}},
        {"at_s": 1.0, "fault": {"drop": {"p": 0.3}}},
        {"at_s": 5.0, "for_s": 1.0, "fault": {"pause": killed}},
    ]
    env = parallel_env(SCENARIOS[mission], level=level, faults=faults, limit=8.0, controllers={names[0]: "alliance"}, info_events=True)
    hashes = []
    for record in (True, False):
        if record:
            env.record(tmp_path / "episode")
        env.reset(seed=4)
        for agent in env.agents:
            env.action_space(agent).seed(4)
        while env.agents:
            infos = env.step({agent: env.action_space(agent).sample() for agent in env.agents})[4]
        hashes.append(infos[killed]["hash"])
    assert hashes[0] == hashes[1], "recording changed the episode"
    robots = load(tmp_path / "episode").run["scenario"]["robots"]
    assert [robot["name"] for robot in robots if robot.get("controller") == "environment"] == env.possible_agents
    assert alliance("replay", "episode").stderr == f"identical: 160 ticks, hash {hashes[0]}\n"
    alliance("report", "episode")


def test_rewards_are_progress_minus_time_cost():
    env = VecEnv("janitorial", controllers={"blue": "nearest", "green": "nearest"}, limit=300.0, auto_reset=False)
    env.reset(1)
    gained, steps = 0.0, 0
    while not env.done[0]:
        env.step(np.zeros((1, 1)))
        gained, steps = gained + env.reward[0], steps + 1
    assert gained == env.row()["done"] > 0
    costly = parallel_env("janitorial", controllers={"blue": "nearest", "green": "nearest"}, limit=300.0, time_cost=0.5)
    costly.reset(seed=1)
    sum_of = 0.0
    while costly.agents:
        _, rewards, *_ = costly.step({})
        sum_of += rewards["gold"]
    assert sum_of == gained - 0.5 * steps
    own = parallel_env("janitorial", limit=1.0, info_events=True, reward=lambda before, after, events: after["open"] - before["open"] + 7 + len(events))
    own.reset(seed=1)
    _, rewards, _, _, infos = own.step({})
    assert rewards["gold"] == 7 + len(infos["gold"]["events"])


def test_infos_contain_the_events_of_the_log(tmp_path):
    env = parallel_env("janitorial", faults=KILLED, limit=8.0, controllers={"blue": "nearest"}, info_events=True)
    env.record(tmp_path / "run")
    events = env.reset(seed=3)[1]["gold"]["events"]
    steps = [len(events)]
    while env.agents:
        _, _, _, _, infos = env.step({})
        assert infos["gold"]["events"] is infos["green"]["events"]
        events = events + infos["gold"]["events"]
        steps.append(len(infos["gold"]["events"]))
    logged = load(tmp_path / "run", "numpy").events
    assert [round(1000 * event["time"]) for event in events] == logged["t_ms"].tolist()
    for column in ("kind", "robot", "subject", "reason", "detail"):
        assert [event[column] for event in events] == logged[column].tolist()
    assert {"joined", "gone", "applied"} <= {event["kind"] for event in events}
    assert steps[0] and 0 in steps, "each event appears once, in its step"


def test_a_batch_works_after_a_fork():
    env = VecEnv("cmommt", 4, level="drive", threads=2)
    env.reset(1)
    actions = np.ones((4, 5, 4), np.float32)
    env.step(actions)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        env.step(actions)
        os._exit(7 if env.observation.any() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    env.step(actions)


def test_a_batch_is_identical_on_any_number_of_threads():
    def episode(threads, envs=6):
        env = VecEnv("cmommt", envs, level="drive", limit=4.0, faults=KILLED, threads=threads)
        rng = np.random.default_rng(1)
        env.reset(10)
        results = []
        for _ in range(100):
            env.step(rng.uniform(-1, 1, (envs, 5, 4)))
            results.append([array.copy() for array in (env.observation, env.reward, env.done, env.alive)])
        return results

    one, three = episode(1), episode(3)
    for a, b in zip(one, three, strict=True):
        assert all(np.array_equal(left, right) for left, right in zip(a, b, strict=True))
    done = np.array([arrays[2] for arrays in one])
    assert done.any(0).all() and (done[done != 0] == 2).all(), "not every environment started again"
    assert not all(arrays[3].all() for arrays in one), "no robot was killed"
    assert len({array.tobytes() for array in one[0][0]}) > 3, "environments share a seed"


@pytest.mark.parametrize("level", ["decide", "drive"])
def test_episodes_without_hashes_differ_in_nothing_else(level, tmp_path):
    def episodes(hashes, recorded=None):
        env = VecEnv("waste-cleanup", 3, level=level, limit=4.0, faults=KILLED, threads=2, hashes=hashes)
        env.action_space.seed(1)
        if recorded:
            env.record(recorded)
        results, endings = [env.reset(10)[0].tobytes()], []
        for _ in range(85):
            actions = env.action_space.sample()
            *step, infos = env.step(actions)
            results += [array.tobytes() for array in (*step, infos["alive"])]
            results += [(env.row(place), env.events(place)) for place in range(3)]
            if "final_info" in infos:
                results.append(infos["final_info"]["outcome"].tolist())
                endings.append(infos["final_info"]["hash"].tolist())
        return results, endings

    hashed, hashes = episodes(True)
    plain, none = episodes(False)
    assert plain == hashed
    assert hashes and all(len(set(of_step)) == 3 and None not in of_step for of_step in hashes)
    assert none == [[None] * 3] * len(hashes), "no hash is reported that nothing has computed"
    # A recorded episode has its hash in any case.
    _, recorded = episodes(False, tmp_path / "log")
    logged = json.loads((tmp_path / "log" / "run.json").read_text())
    assert recorded == [[logged["hash"], None, None], *none[1:]]


@pytest.mark.parametrize("mission", ["cmommt", "waste-cleanup", "parker-box"])
def test_a_batch_that_requests_memory_in_advance_is_identical_to_small_ones(mission):
    def episode(sizes):
        """Steps batches of these sizes, which together have the seeds from 10 on."""
        rows = []
        first = 0
        for envs in sizes:
            env = VecEnv(mission, envs, level="drive")
            env.reset(10 + first)
            first += envs
            for step in range(50):
                env.step(np.full((envs, len(env.agents), 4), (step % 7) / 7, np.float32))
            rows.append(env.observation.copy())
        return np.concatenate(rows)

    assert np.array_equal(episode([60]), episode([20, 20, 20]))


def test_arrays_are_written_in_place_only_on_request():
    env = VecEnv("janitorial", 2, copy=False)
    seen = env.observation
    assert env.reset()[0] is seen and env.step(np.zeros((2, 3)))[0] is seen and seen.any()
    env = VecEnv("janitorial", 2)
    first = env.reset(1)[0]
    kept = first.copy()
    env.step(np.zeros((2, 3)))
    assert np.array_equal(first, kept) and not np.array_equal(env.observation, kept)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: parallel_env("servise"), "neither a built-in scenario nor a file"),
        (lambda: parallel_env({"name": "own", "mission": "football"}), "mission: unknown key; there are "),
        (lambda: VecEnv({"name": "own", "football": {"goals": 2}}), "football: unknown key; there are "),
        (lambda: VecEnv("janitorial", controllers=[1]), "controllers: [1] is not a dict; write {'*': …} for all robots"),
        (lambda: VecEnv("janitorial", hashes="no"), "hashes: 'no' is neither True nor False"),
        (lambda: parallel_env("janitorial", level="fly"), "level: there is no 'fly'; use 'decide' or 'drive'"),
        (lambda: parallel_env("service", level="drive"), "a robot of the mission 'service' cannot be driven"),
        (lambda: parallel_env("janitorial", period_s=0.01), "period_s: 0.01 is shorter than a step"),
        (lambda: VecEnv("janitorial", 0), "envs: 0 is out of range; it must be at least 1"),
        (lambda: VecEnv("janitorial", -1), "envs: -1 is out of range"),
        (lambda: VecEnv("janitorial", ticks=0), "ticks: 0 is out of range"),
        (lambda: VecEnv("janitorial", ticks=2, period_s=1.0), "ticks and period_s: both state the length of a step"),
        (lambda: VecEnv("janitorial", render_mode="human"), "render_mode: there is no 'human'"),
        (lambda: VecEnv("janitorial").reset(-1), "seed: -1 is out of range"),
    ],
)
def test_wrong_arguments_are_reported(make, expected):
    with pytest.raises(ScenarioError) as error:
        make()
    assert expected in str(error.value)


def test_invalid_actions_are_refused():
    env = VecEnv("janitorial")
    env.reset()
    with pytest.raises(ValueError, match=r"actions have the shape \(1, 2\); it must be \(1, 3\)"):
        env.step([[0, 0]])
    with pytest.raises(ScenarioError, match="action of 'gold': 99 is out of range; it must be from 0 to"):
        env.step([[99, 0, 0]])
    driven = VecEnv("observe", level="drive", robots=1)
    driven.reset()
    with pytest.raises(ValueError, match="action of 'r1': NaN is not a finite number"):
        driven.step([[[np.nan, 0, 0, 0]]])
    pair = VecEnv("observe", 2, level="drive", robots=2)
    pair.reset()
    actions = np.zeros((2, 2, 4))
    actions[1, 1, 3] = np.inf
    with pytest.raises(ValueError, match="action of 'r2': inf is not a finite number"):
        pair.step(actions)


def test_a_folder_with_a_run_is_refused_at_once(tmp_path):
    env = VecEnv("janitorial", 2, limit=1.0)
    env.record(tmp_path / "log")
    env.reset(seed=1)
    env.close()
    with pytest.raises(AllianceError, match="log already holds a run"):
        env.record(tmp_path / "log", 1)
    # The refused folder has no effect.
    env.reset(seed=1)
