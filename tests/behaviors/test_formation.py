"""Formations: both forms agree, and robots follow a frame that moves, turns and grows."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj import api
from escort_mj.behaviors import Formation, Goal
from escort_mj.components.setup import Frame
from escort_mj.errors import ScenarioError
from escort_mj.scenario.geometry.trajectory import Trajectory
from escort_mj.scenario.reader.load import scenario_of
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.scenario import Phase
from tests.control.twins import AVOID, SURFACE, compare, mission

ONE = Formation(offsets=((0.0, 0.0),), gain=0.7)
GOAL = Goal(goals=((0.0, 0.0),))


def frame(axes: int, along: bool, follows: bool, seed: int = 0) -> Frame:
    rng = np.random.default_rng(seed)
    place = [Expression(f"{rng.normal():.3f}*t + sin({rng.uniform(1, 3):.3f}*t)") for _ in range(axes)]
    turned = [Expression("1"), Expression("0")] if along else [Expression("cos(2*t)"), Expression("sin(2*t)")]
    offsets = rng.normal(size=(6, axes))
    return Frame(offsets, Trajectory((*place, *turned, Expression("1 + 0.5*sin(t)"))), along, follows)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize(("along", "follows"), [(False, False), (True, False), (False, True), (True, True)])
def test_kernel_and_numpy_agree(axes: int, along: bool, follows: bool) -> None:
    setup, q, v = mission(axes, seed=41)
    later = Phase(behaviors=(AVOID, Formation(offsets=((0.0, 0.0),), gain=2.0)), after=0.003)
    frames = (frame(axes, along, follows), frame(axes, not along, follows, seed=1))
    for stack in ((AVOID, ONE), (SURFACE, ONE)):
        compare(replace(setup, behaviors=stack, formations=frames, phases=(later,)), q, v)
    points = tuple(np.zeros((1, axes)) for _ in q)
    behind = Phase(behaviors=(GOAL,), after=0.003)
    compare(replace(setup, behaviors=(ONE,), formations=frames[:1], goals=(points,), phases=(behind,)), q, v)


@pytest.mark.parametrize("axes", [2, 3])
def test_frames_that_wait_agree(axes: int) -> None:
    setup, q, v = mission(axes, seed=43)
    slow = Formation(offsets=((0.0, 0.0),), gain=0.7, reach=0.3, waits=4.0)
    frames = (frame(axes, True, False), frame(axes, False, False, seed=1))
    later = Phase(behaviors=(AVOID, Formation(offsets=((0.0, 0.0),), gain=2.0)), after=0.003)
    compare(replace(setup, behaviors=(AVOID, slow), formations=frames, phases=(later,)), q, v)


@pytest.mark.parametrize("failing", [False, True])
def test_a_frame_waits_for_robots_that_are_too_slow_but_not_for_failed_ones(failing: bool) -> None:
    """At half of the frame's speed, the pace is a half, and so is the place between `reach` and `waits`."""
    keys = {
        "target": None,
        "duration": 20.0,
        "robots": {"positions": [[0.0, 0.0], [0.0, 2.0], [0.0, 4.0]]},
        "controller": {"law": "apd_smc", "gains": "auto"},
        "mission": {
            "max_speed": 0.5,
            "behaviors": [{
                "behavior": "formation", "offsets": [[0.0, 0.0], [0.0, 2.0], [0.0, 4.0]],
                "position": ["t", "0"], "reach": 0.1, "waits": 0.9,
            }]
        },
    }  # fmt: skip
    if failing:
        heavy, failure = {"robot": 3, "mass": 1000.0}, {"robot": 3, "at": 0.5}
        keys["robots"] = {**keys["robots"], "overrides": [heavy], "failures": [failure]}
    trace = api.run(keys).trace.sel(time=slice(8, 20))
    away = np.linalg.norm((trace["goal"] - trace["q"]).values, axis=2)
    lag = trace["formation_lag"].values[:, 0]
    np.testing.assert_allclose(away[:, :2], 0.5, atol=0.02)
    np.testing.assert_allclose(np.diff(lag), 0.5 * np.diff(trace["time"]), rtol=0.03)
    assert (away[-1, 2] > 5.0) == failing


def test_robots_follow_a_frame_that_turns_along_its_way_and_grows() -> None:
    """On a circle of 5 m at 1 m/s, heading along it: the places are known in closed form."""
    offsets = np.array([[0.0, 0.0], [-1.0, 1.0], [-1.0, -1.0]])
    keys = {
        "target": None,
        "duration": 20.0,
        "robots": {"positions": (np.array([[5.0, 0.0], [4.0, -1.0], [6.0, -1.0]]) + 0.3).tolist()},
        "mission": {
            "behaviors": [{
                "behavior": "formation", "offsets": offsets.tolist(), "heading": "along", "reach": 0.02,
                "position": ["5*cos(0.2*t)", "5*sin(0.2*t)"], "scale": "1 + 0.02*t",
            }]
        },
        "expect": [{"reached": 0.02, "by": 10}],
    }  # fmt: skip
    run = api.run(keys)
    time, trace = run.trace["time"].values, run.trace
    angle, scale = 0.2 * time + np.pi / 2, 1.0 + 0.02 * time
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    center = 5.0 * np.stack([np.cos(0.2 * time), np.sin(0.2 * time)], axis=1)
    wanted = center[:, None] + scale[:, None, None] * np.einsum("abt,ib->tia", turn, offsets)
    np.testing.assert_allclose(trace["goal"].values, wanted, atol=1e-9)
    late = time > 10.0
    assert np.linalg.norm(trace["q"].values - wanted, axis=2)[late].max() < 5e-3, "without feed-forward: 1 m"
    assert run.passed


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"offsets": [[0, 0]]}, "offsets: found 1 entries; expected 2"),
        ({"offsets": [[0, 0], [1, 0, 0]]}, r"offsets\[1\]: found 3 numbers; expected 2"),
        ({"position": ["t"]}, "position: found 1 numbers; expected 2"),
        ({"position": ["t", "1/t"]}, r"position\[1\]: has no finite value at t = 0 s"),
        ({"position": ["t", "x"]}, r"position\[1\]"),
        ({"heading": "aling"}, "heading"),
        ({"scale": "2 +"}, "scale"),
        ({"waits": 0.1}, "waits: found 0.1 m; expected more than reach, 0.1 m"),
        ({"waits": 1, "position": None}, "goes with the target, which does not wait"),
        ({"position": None}, "goes with the target; this mission has none: give position"),
        ({"waypoints": [{"time": 0, "position": [0, 0]}]}, "found both position and waypoints"),
        ({"position": None, "waypoints": [{"time": 1, "position": [0, 0]}, {"time": 1, "position": [0, 1]}]},
         r"waypoints\[1\].time: found 1 s after 1 s"),
    ],
)  # fmt: skip
def test_wrong_formations(changes: dict, message: str) -> None:
    given = {"behavior": "formation", "offsets": [[0, 0], [1, 0]], "position": [0, 0]} | changes
    robots = {"positions": [[0.0, 0.0], [2.0, 0.0]]}
    with pytest.raises(ScenarioError, match=message):
        scenario_of({"target": None, "robots": robots, "mission": {"behaviors": [given]}})


def test_one_place_at_a_time() -> None:
    behaviors = [
        {"behavior": "formation", "offsets": [[0, 0], [1, 0]]},
        {"behavior": "goal", "goals": [[9, 9], [7, 7]]},
    ]
    with pytest.raises(ScenarioError, match=r"behaviors\[1\]: found goal beside formation"):
        scenario_of({"robots": {"count": 2}, "mission": {"behaviors": behaviors}})
