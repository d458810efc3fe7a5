"""Robots that circle the target: the figure turns at the given rate and stays even."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj import api
from escort_mj.behaviors import AvoidObstacles, Surface
from escort_mj.behaviors.orbit import Orbit
from tests.control.twins import compare, mission

MISSION = [
    "mission.behaviors=[{behavior: orbit, rate: 0.3}, surface]",
    "target.position=[0.2*t, 0.1*t]",
    "obstacles=[]",
    "duration=40",
    "sensing={}",
    "expect=[]",
]


@pytest.mark.parametrize("axes", [2, 3, 5])
def test_kernel_and_numpy_agree(axes: int) -> None:
    setup, q, v = mission(axes, seed=21)
    for stack in ((Orbit(rate=-0.7), Surface()), (AvoidObstacles(safe_distance=2.5), Orbit(), Surface())):
        compare(replace(setup, behaviors=stack), q, v)


def test_the_figure_turns_at_the_rate_and_stays_even() -> None:
    run = api.run(api.load_scenario("main", MISSION))
    late = run.trace.sel(time=slice(25.0, 40.0))
    x = late["q"].values - late["target_position"].values[:, None]
    angle = np.unwrap(np.arctan2(x[..., 1], x[..., 0]), axis=0)
    turned = (angle[-1] - angle[0]) / float(late["time"][-1] - late["time"][0])
    np.testing.assert_allclose(turned, 0.3, rtol=0.02)
    assert run.values["spacing_error_max"] < 0.05
    assert run.values["radius_error_max"] < 0.05
