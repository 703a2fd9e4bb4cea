"""The conventions of Gymnasium: vector environments, single environments, spaces, pictures."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from alliance_sim import ScenarioError, run
from conftest import needed

gymnasium = needed("gymnasium")
from alliance_sim.env import RobotEnv, VecEnv, parallel_env  # noqa: E402
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

RECIPES = Path(__file__).resolve().parents[3] / "docs/examples/python/recipes.py"
KILLED = [{"at_s": 1.0, "fault": {"kill": "gold"}}]


@pytest.mark.parametrize("level", ["decide", "drive"])
def test_a_batch_is_a_vector_environment(level):
    env = VecEnv("cmommt", 3, level=level, limit=2.0)
    assert isinstance(env, VectorEnv) and env.num_envs == 3
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    seen, infos = env.reset(seed=1)
    assert env.observation_space.contains(seen) and env.single_observation_space.contains(seen[0])
    assert infos["alive"].shape == (3, 5)
    env.action_space.seed(1)
    for _ in range(50):
        seen, reward, terminated, truncated, infos = env.step(env.action_space.sample())
        assert env.observation_space.contains(seen)
        assert reward.shape == (3,) and terminated.dtype == truncated.dtype == bool
        assert "final_obs" in infos if truncated.any() else "final_obs" not in infos
    wrapped = RecordEpisodeStatistics(VecEnv("cmommt", 2, level=level, limit=2.0))
    wrapped.reset(seed=1)
    while True:
        *_, infos = wrapped.step(wrapped.action_space.sample())
        if "episode" in infos:
            break
    assert (infos["episode"]["l"][infos["_episode"]] >= (2 if level == "decide" else 39)).all()


def test_the_last_observation_of_an_episode_is_kept():
    """The final observation and hash equal those of the same episode without autoreset."""
    same = VecEnv("cmommt", 2, level="drive", limit=2.0, faults=KILLED, hashes=True)
    apart = VecEnv("cmommt", 2, level="drive", limit=2.0, faults=KILLED, auto_reset=False, hashes=True)
    assert apart.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    same.reset(seed=[7, 3]), apart.reset(seed=[7, 3])
    actions = np.random.default_rng(1).uniform(-1, 1, (50, 2, 5, 4)).astype(np.float32)
    for action in actions:
        *_, truncated, infos = same.step(action)
        apart.step(action)
        if truncated.any():
            break
    assert truncated.all() and infos["_final_obs"].all()
    assert None not in infos["final_info"]["hash"]
    for place in range(2):
        assert np.array_equal(infos["final_obs"][place], apart.observation[place])
        assert (infos["final_info"]["hash"][place], infos["final_info"]["outcome"][place]) == apart.ended(place)
    assert infos["final_info"]["seed"].tolist() == [7, 3]
    assert not np.array_equal(same.observation, apart.observation), "the next episode has begun"
    again = VecEnv("cmommt", 2, level="drive", limit=2.0, faults=KILLED)
    again.reset(seed=[9, 5])
    assert np.array_equal(again.observation, same.observation), "the next seeds are the last ones plus the number of environments"


def test_some_environments_are_reset_by_mask_and_seed():
    env = VecEnv("cmommt", 3, level="drive", limit=5.0, auto_reset=False)
    with pytest.raises(RuntimeError, match="the first reset"):
        env.reset(options={"reset_mask": np.array([True, False, False])})
    with pytest.raises(RuntimeError, match=r"call reset\(\) first"):
        env.step(np.zeros((3, 5, 4)))
    first = env.reset(seed=[4, None, 6])[0]
    fresh = VecEnv("cmommt", 1, level="drive", limit=5.0)
    assert np.array_equal(fresh.reset(seed=4)[0][0], first[0]) and np.array_equal(fresh.reset(seed=6)[0][0], first[2])
    for _ in range(5):
        env.step(np.ones((3, 5, 4), np.float32))
    before = env.observation.copy()
    after, _ = env.reset(seed=[9, 9, 9], options={"reset_mask": np.array([False, True, False])})
    assert np.array_equal(after[[0, 2]], before[[0, 2]])
    assert np.array_equal(after[1], fresh.reset(seed=9)[0][0])
    for mask in (np.array([1, 0, 0]), np.zeros(3, bool), np.ones(2, bool)):
        with pytest.raises(ValueError, match="reset_mask: it must be 3 booleans"):
            env.reset(options={"reset_mask": mask})
    with pytest.raises(ValueError, match="there are 2 seeds for 3 environments"):
        env.reset(seed=[1, 2])


def test_unseeded_resets_differ_and_seeded_ones_repeat():
    def firsts(env, **options):
        return [env.reset(**options)[0].tobytes(), env.reset()[0].tobytes()]

    make = lambda: VecEnv("cmommt", 2, level="drive", limit=5.0)
    assert len({*firsts(make()), *firsts(make())}) == 4
    assert firsts(make(), seed=5) == firsts(make(), seed=5)
    hashes = set()
    for _ in range(2):
        env = parallel_env("cmommt", limit=1.0)
        for _ in range(2):
            env.reset()
            while env.agents:
                env.step({})
            hashes.add(env.hash)
    assert len(hashes) == 4


def test_an_environment_that_was_not_created_or_is_closed():
    with pytest.raises(ScenarioError, match="'none' is neither a built-in scenario nor a file"):
        VecEnv("none")
    # Gymnasium closes an object when it is deleted.
    VecEnv.__new__(VecEnv).close()
    env = VecEnv("janitorial", limit=5.0)
    env.reset(seed=1)
    env.close()
    with pytest.raises(RuntimeError, match="call reset"):
        env.step(np.zeros((1, 3), int))
    env.reset(seed=1)
    env.step(np.zeros((1, 3), int))


def test_a_wrong_action_steps_no_environment():
    env = VecEnv("janitorial", 2, limit=5.0)
    env.reset(seed=1)
    poses = [env.poses(number) for number in range(2)]
    for wrong in (-1, 99):
        with pytest.raises(ScenarioError, match=f"action of 'green': {wrong} is out of range"):
            env.step(np.array([[1, 1, 1], [1, 1, wrong]]))
    assert all(np.array_equal(env.poses(number), poses[number]) for number in range(2))


def test_a_step_of_several_ticks_repeats_its_action():
    once, ten = (VecEnv("cmommt", 2, level="drive", limit=5.0, ticks=ticks) for ticks in (None, 10))
    once.reset(seed=3), ten.reset(seed=3)
    actions = np.random.default_rng(1).uniform(-1, 1, (9, 2, 5, 4)).astype(np.float32)
    for action in actions:
        reward = np.zeros(2, np.float32)
        for _ in range(10):
            reward += once.step(action)[1]
        assert np.allclose(ten.step(action)[1], reward)
        assert np.array_equal(once.observation, ten.observation)
    by_period = VecEnv("cmommt", 2, level="drive", limit=5.0, period_s=0.5)
    by_period.reset(seed=3)
    for action in actions:
        by_period.step(action)
    assert np.array_equal(by_period.observation, ten.observation)


@pytest.mark.parametrize("name", ["Waste", "Service", "Push", "Observe", "Waste-Drive", "Push-Drive", "Observe-Drive"])
def test_registered_environments_pass_the_checker(name):
    environment = f"alliance_sim.env:alliance/{name}-v0"
    env = gymnasium.make(environment, limit=5.0, render_mode="rgb_array")
    assert isinstance(env.unwrapped, RobotEnv)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*render modes.*|.*not within the observation space.*")
        check_env(env.unwrapped)
    env.reset(seed=1)
    frame = env.render()
    assert frame.dtype == np.uint8 and frame.ndim == 3 and frame.shape[2] == 3 and frame.std() > 0
    env.close()


def test_a_robot_with_idle_actions_has_the_hash_of_an_idle_robot():
    env = RobotEnv("janitorial", "blue", teammates={"gold": "nearest", "green": "nearest"}, limit=5.0)
    seen, info = env.reset(seed=2)
    assert env.observation_space.contains(seen) and info["action_mask"][0] == 1
    done = False
    while not done:
        seen, reward, over, cut, info = env.step(0)
        done = over or cut
    other = parallel_env("janitorial", controllers={"gold": "nearest", "green": "nearest"}, limit=5.0)
    other.reset(seed=2)
    while other.agents:
        other.step({})
    assert cut and info["hash"] == other.hash and info["outcome"] == "time-limit"
    with pytest.raises(TypeError):
        env.step(0.5)


def test_the_repr_of_an_environment_states_its_agents():
    assert repr(RobotEnv("janitorial")) == "<RobotEnv of robot 'gold', level decide>"
    assert repr(VecEnv("janitorial", 2)) == "<VecEnv of 2 environments with 3 agents, level decide>"


def test_an_unknown_robot_is_refused():
    with pytest.raises(ScenarioError, match=r"^robot: the scenario has no robot 'glod'; it has gold, blue, green$"):
        RobotEnv("janitorial", "glod")


def test_masked_and_sloppy_actions_are_reported():
    env = parallel_env("waste-cleanup", limit=60.0)
    seen, infos = env.reset(seed=1)
    assert not infos["blue"]["masked_action"]
    closed = {agent: int(values["action_mask"].argmin()) for agent, values in seen.items() if not values["action_mask"].all()}
    assert closed, "every set is applicable"
    infos = env.step(closed)[4]
    assert {agent for agent, info in infos.items() if info["masked_action"]} == set(closed)
    agent = env.agents[0]
    for action, error in ((1.7, TypeError), ("1", TypeError), (99, Exception)):
        with pytest.raises(error, match=f"action of '{agent}'"):
            env.step({agent: action})
    with pytest.raises(ValueError, match="there is no agent 'nobody'"):
        env.step({"nobody": 0})
    driven = parallel_env("cmommt", level="drive", limit=5.0)
    driven.reset(seed=1)
    for action in (0.5, np.zeros(3), np.zeros(4, complex)):
        with pytest.raises(ValueError, match="is not an array of four numbers"):
            driven.step({driven.agents[0]: action})
    robot = RobotEnv("waste-cleanup", limit=60.0)
    robot.reset(seed=1)
    for action, error in ((1.7, TypeError), ("1", TypeError), (None, TypeError), (np.zeros(1, int), TypeError), (99, ScenarioError)):
        with pytest.raises(error, match=f"action of '{robot.robot}'"):
            robot.step(action)
    robot = RobotEnv("cmommt", level="drive", limit=5.0)
    robot.reset(seed=1)
    for action, shape in ((0.5, r"\(\)"), (np.zeros(3), r"\(3,\)"), (np.zeros((1, 4)), r"\(1, 4\)")):
        with pytest.raises(ValueError, match=rf"action of '{robot.robot}': the shape is {shape}; it must be \(4,\)"):
            robot.step(action)
    with pytest.raises(ValueError, match=r"\[1, \[2\]\] is not an array of four numbers"):
        robot.step([1, [2]])
    with pytest.raises(TypeError, match=f"action of '{robot.robot}': .* is not an array of four numbers"):
        robot.step(np.zeros(4, complex))
    batch = VecEnv("waste-cleanup", 2, limit=60.0)
    batch.reset(seed=1)
    closed = batch.action_mask.argmin(-1)
    closed = np.where(closed <= [len(sets) for sets in batch.sets], closed, 0)
    infos = batch.step(closed)[4]
    assert np.array_equal(infos["masked_action"], closed != 0)
    with pytest.raises(ValueError, match="not whole"):
        batch.step(np.full(closed.shape, 0.9))
    with pytest.raises(TypeError, match="write numbers"):
        batch.step(np.full(closed.shape, "1"))


def test_infos_are_numbers_by_default():
    env = parallel_env("janitorial", limit=2.0, faults=KILLED)
    _, infos = env.reset(seed=1)
    while env.agents:
        assert all(type(value) is bool for info in infos.values() for value in info.values())
        infos = env.step({})[4]
    assert env.outcome == "time-limit" and len(env.hash) == 16 and isinstance(env.events(), list) and env.faults() == ["kill gold"]


def test_a_reward_that_is_no_number_is_named():
    env = parallel_env("janitorial", limit=2.0, reward=lambda before, after, events: "x")
    env.reset(seed=1)
    with pytest.raises(TypeError, match="reward: the function returned 'x'"):
        env.step({})
    env = parallel_env("janitorial", limit=2.0, reward=lambda before, after, events: float("nan"))
    env.reset(seed=1)
    with pytest.raises(ValueError, match="reward: the function returned nan, which is not a finite number"):
        env.step({})


def test_pictures_show_the_run_and_its_end():
    env = parallel_env("observe", level="drive", robots=2, limit=1.0, render_mode="rgb_array")
    env.reset(seed=1)
    frames = [env.render()]
    while env.agents:
        env.step({agent: np.array([1, 0, 0, 0], np.float32) for agent in env.agents})
        frames.append(env.render())
    assert len({frame.shape for frame in frames}) == 1 and not np.array_equal(frames[0], frames[-1])
    height, width, _ = frames[0].shape
    assert width == 640 and height % 2 == 0
    batch = VecEnv("observe", 2, level="drive", robots=2, limit=1.0, render_mode="rgb_array")
    batch.reset(seed=1)
    assert np.array_equal(batch.render()[0], frames[0]) and len(batch.render()) == 2
    assert parallel_env("observe").render() is None
    with pytest.raises(RuntimeError, match=r"call reset\(\) before a picture"):
        VecEnv("observe").picture()


def test_too_many_environments_raise_a_memory_error():
    for envs in (2**40, 2**62):
        with pytest.raises(MemoryError, match=r"environments of about \d+ kB each need"):
            VecEnv("service", envs)
    limited = "import resource; resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)); from alliance_sim.env import VecEnv; VecEnv('service', 10**6)"
    done = subprocess.run([sys.executable, "-c", limited], capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    assert done.returncode == 1 and "MemoryError: envs: 1000000 environments" in done.stderr, done.stderr


def test_a_batch_and_the_recipes_work_without_gymnasium(tmp_path):
    (tmp_path / "gymnasium.py").write_text("raise ModuleNotFoundError('none', name='gymnasium')")
    lines = """
from alliance_sim.env import VecEnv
import alliance_sim.env, recipes
env = VecEnv("janitorial")
env.reset(1)
print(env.step([[0, 0, 0]])[1])
for env in env, VecEnv("janitorial", controllers={"*": "alliance"}):
    try: env.action_space
    except AttributeError as error: print(error)
recipes.TESTS = 2
print(*recipes.baselines("observe"), sep=", ")
alliance_sim.env.RobotEnv
"""
    path = os.pathsep.join([str(tmp_path), str(RECIPES.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})
    assert done.stdout.splitlines() == [
        "[0.]",
        "'VecEnv' has no attribute 'action_space'; it needs Gymnasium: pip install 'alliance-sim[env]'",
        "'VecEnv' has no attribute 'action_space'",
        "idle, random actions, allocator random, allocator alliance",
    ], done.stderr
    assert "gymnasium is missing; install it with" in done.stderr, done.stderr


def test_the_version_is_that_of_the_program(alliance):
    import alliance_sim

    assert alliance("--version").stdout.split()[1] == alliance_sim.__version__
    assert run("janitorial", limit=1).seconds == 1
