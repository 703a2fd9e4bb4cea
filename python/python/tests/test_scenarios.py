"""Scenarios in dicts: values of NumPy, and values that no scenario can contain."""

import math
from collections import OrderedDict

import numpy as np
import pytest
from alliance_sim import ScenarioError, run

PLAIN = {
    "limit_s": 20.0,
    "step_ms": 50,
    "room": {"width_m": 10.0, "height_m": 8.0},
    "service": {
        "known": "sight",
        "uncovered": False,
        "kinds": [{"name": "t", "work_s": {"min": 1.5, "max": 2.5}}],
        "points": [{"kind": "t", "x_m": 2.0, "y_m": 3.0}, {"kind": "t", "x_m": 4.0, "y_m": 5.0}],
    },
    "robots": [{"name": "a"}, {"name": "b"}],
}


def as_numpy(value):
    """Returns the value with NumPy's numbers, texts and arrays in the place of Python's."""
    if isinstance(value, dict):
        return OrderedDict((np.str_(key), as_numpy(below)) for key, below in value.items())
    if isinstance(value, list):
        return np.array([as_numpy(below) for below in value], dtype=object)
    return {bool: np.bool_, int: np.int64, float: np.float64, str: np.str_}[type(value)](value)


def test_values_of_numpy_give_the_same_run():
    faults = [{"fault": {"mute": "a"}, "at_s": 5.0, "for_s": 5}]
    plain = run(PLAIN, {"*": "nearest"}, faults=faults)
    mixed = run(as_numpy(PLAIN), {"*": "nearest"}, np.int64(1), faults=[as_numpy(fault) for fault in faults], limit=np.float64(20.0))
    assert mixed.hash == plain.hash
    # A float of single precision has its own value.
    run(PLAIN | {"body": {"radius_m": np.float32(0.2), "reach_m": np.float16(0.25)}}, {"*": "nearest"})


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        (None, "None is not a value; omit the key"),
        (math.nan, "nan is not a finite number; write one, or omit the key"),
        (np.float32(math.inf), "inf is not a finite number; write one, or omit the key"),
        (2**63, f"{2**63} is out of range; write a number from -2^63 to 2^63 - 1"),
        ({1, 2}, "a value of type set does not fit; write a number, a text, a list or a dict"),
        ({1: 2}, "the key 1 is not a text; write the keys as texts"),
        (1j, "a value of type complex does not fit; write a number, a text, a list or a dict"),
    ],
)
def test_a_value_that_no_scenario_contains_is_named_by_its_key(value, problem):
    robots = [{"name": "a"}, {"name": "b", "speed_m_s": value}]
    with pytest.raises(ScenarioError) as error:
        run(PLAIN | {"robots": robots})
    assert str(error.value) == f"scenario.robots[1].speed_m_s: {problem}"
    with pytest.raises(ScenarioError) as error:
        run(PLAIN, faults=[{"fault": {"kill": "a"}, "at_s": value}])
    assert str(error.value) == f"faults.timeline[0].at_s: {problem}"
