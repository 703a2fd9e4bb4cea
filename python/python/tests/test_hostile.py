"""Nothing that a user calls ends the interpreter, and Ctrl-C ends every call."""

import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import needed

needed("pettingzoo")
from alliance_sim.env import VecEnv  # noqa: E402

#: Calls per seed. A release was tried with 10,000.
CALLS = 400


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_calls_end_with_a_result_or_one_line(seed):
    fuzz = Path(__file__).with_name("fuzz.py")
    words = [sys.executable, "-X", "faulthandler", "-W", "ignore", str(fuzz), str(seed), str(CALLS)]
    process = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert process.returncode == 0, process.stderr[-4000:]
    calls, refused = (int(word) for word in process.stdout.split() if word.isdigit())
    assert calls == CALLS and 0 < refused < CALLS, process.stdout


def test_the_arrays_of_an_environment_cannot_be_resized():
    env = VecEnv("janitorial", 2, copy=False)
    observation, _ = env.reset(seed=1)
    for array in (observation, env.observation, env.action_mask, env.alive, env.reward, env.done):
        with pytest.raises(ValueError, match="resize"):
            array.resize(10**6, refcheck=False)


@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_ends_a_long_step(threads):
    # Idle robots do not complete the mission, so that the step has 2·10^8 ticks.
    env = VecEnv(None, 2, threads=threads, period_s=1e9, limit=1e7)
    env.reset(seed=1)
    idle = np.zeros(env._shape, np.int64)
    # A shell starts background jobs with the signal ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        env.step(idle)
    timer.join()
    # Some environments have made more of the step than others.
    with pytest.raises(RuntimeError, match="reset"):
        env.step(idle)
    assert (env.reset(seed=1)[1]["alive"] == 1).all()
