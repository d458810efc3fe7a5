"""Radii that change: both forms agree, the radius follows room and time without lag, all get through."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj.api import load_scenario, run
from escort_mj.behaviors import Surface
from escort_mj.behaviors.surface import fitted
from tests.control.twins import AVOID, VERTICES, Kernel, Wave, compare, mission


@pytest.mark.parametrize(("feedforward", "axes"), [(True, 2), (False, 3)])
def test_kernel_and_numpy_agree(feedforward: bool, axes: int) -> None:
    """One radius of time and room, one of room alone, one of time alone."""
    setup, q, v = mission(axes, seed=3)
    waves = tuple(Wave(np.random.default_rng(each), 1) for each in range(3))
    for wave in waves:
        wave.a = np.array([6.0])
    setup = replace(setup, target_feedforward=feedforward, radii=waves[:1])
    shrinking = Surface(radius="t", fit=True, least=0.1), Surface(fit=True)
    for surface in (*shrinking, Surface(radius="t", gain=2.0)):
        stack = (VERTICES, surface)
        kernel = Kernel(replace(setup, behaviors=stack))
        kernel.evaluate(0.0, q, v, np.eye(axes)[None].repeat(len(q), 0), 0.0 * q)
        assert (kernel.state.radius_now[0, 0] < waves[0].position(0.0)[0]) == surface.fit
        compare(replace(setup, behaviors=stack), q, v)
    both = (AVOID, Surface(radius="t"), VERTICES)
    compare(replace(setup, behaviors=both), q, v)


def test_shrinking_begins_and_ends_gently() -> None:
    room = np.linspace(4.0, -1.0, 5001)
    found = np.array([fitted(2.5, 0.3, float(each), -1.0, 0.6, 0.8) for each in room])
    radius, rate = found.T
    assert radius.max() == 2.5 and radius.min() == 0.8 and (np.diff(radius) <= 0.0).all()
    assert (radius <= np.maximum(room, 0.8) + 1e-12).all(), "it is free"
    free, full = room > 2.8, (room < 2.2) & (room > 0.8)
    assert (rate[free] == 0.3).all() and np.allclose(rate[full], -1.0) and (rate[room < 0.8] == 0.0).all()
    assert np.abs(np.diff(rate[room > 0.8])).max() < 0.01


def test_the_team_passes_a_door_narrower_than_its_circle(compiled) -> None:
    flown = run("worlds/squeeze")
    assert all(verdict.passed for verdict in flown.verdicts), flown
    q, target = (flown.trace[name].values for name in ("q", "target_position"))
    radius = np.linalg.norm(q - target[:, None], axis=2)[500:]  # settled
    assert radius.min() < 1.1 and np.ptp(radius, axis=1).max() < 0.1, "all shrink together"


def test_a_radius_of_time_is_followed_without_lag(compiled) -> None:
    keys = {"duration": 20, "expect": [], "obstacles": [], "sensing": {}, "uncertainty": {}}
    keys["mission.behaviors"] = ["vertices", {"behavior": "surface", "radius": "3 + sin(0.5*t)"}]
    trace = run(load_scenario("main", keys)).trace
    late = trace.sel(time=slice(15.0, None))
    radius = np.linalg.norm(late["q"].values - late["target_position"].values[:, None], axis=2)
    assert np.abs(radius - (3.0 + np.sin(0.5 * late["time"].values))[:, None]).max() < 0.01
