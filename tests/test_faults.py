"""Missions that must fail: each fails for its own reason, and the log has its touches and nothing else."""

import math
from pathlib import Path

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.mission import Flight, fly

FAULTS = sorted((Path(__file__).parents[1] / "scenarios" / "faults").glob("*.yaml"))
ROBOTS, TARGET, ROCK = ("robot_1", "robot_2"), ("robot_1", "target"), ("robot_1", "rock")
TOUCHES = {  # pair and time of first touch [s]: distance over speed, where that is known
    "collision": [(ROBOTS, 0.8)],
    "one_step_touch": [(ROBOTS, 0.12)],
    "no_avoidance": [(ROBOTS, None)],
    "into_obstacle": [(ROCK, None)],
    "run_over": [(TARGET, 5.5 / 3.0)],
    "too_hard": [(ROCK, 1.3 / 3.0)],
    "at_the_end": [(ROBOTS, 5.011)],
    "through_a_rock": [(("target", "rock"), 3.1), (("target", "block"), 5.2)],
    "in_a_block": [(("robot_1", "block"), 0.79 / 130.0)],
}


@pytest.fixture(scope="module", params=FAULTS, ids=lambda path: path.stem)
def run(request: pytest.FixtureRequest) -> Flight:
    return fly(load_scenario(request.param))


def test_it_fails_for_its_own_reason_and_for_no_other(run: Flight) -> None:
    assert run.passed, [verdict.message for verdict in run.verdicts if not verdict.passed]
    known = [verdict for verdict in run.verdicts if verdict.xfail]
    assert known and not any(verdict.held for verdict in known)


def test_its_touches_are_found_and_nothing_else(run: Flight) -> None:
    trace, names = run.trace, run.trace["body"].values
    found = [
        (str(names[i]), str(names[j])) for i, j in zip(trace.episode_first, trace.episode_second, strict=True)
    ]
    expected = TOUCHES.get(run.scenario.name, [])
    assert found == [pair for pair, _ in expected]
    for start, (_, time) in zip(trace["episode_start"].values, expected, strict=True):
        assert time is None or 0.0 <= start - time <= 1.01 * trace.attrs["timestep"]
    assert run.metrics["contacts_untold"]["value"] == 0.0
    assert trace.attrs["mujoco_warnings"] == 0


def test_the_end_of_a_run_and_of_a_window_count_to_the_physics_step() -> None:
    """The robots touch after the last whole sample; by 4.95 s they come as near as the straight way says."""
    path = next(path for path in FAULTS if path.stem == "at_the_end")
    run = fly(load_scenario(path))
    assert run.metrics["run"]["simulated_time"] == pytest.approx(5.018)
    assert (run.message, run.metrics["run"]["steps"]) == ("completed 5.018 s", 2510)
    near = [verdict.value for verdict in run.verdicts if verdict.demanded.endswith("after 4 s before 4.95 s")]
    assert near == pytest.approx([5.411 - 0.4 - 4.95] * 3, abs=1e-9)


def soft_contact(speed: float, reduced: float, width: float = 1e-3) -> dict[str, float]:
    """MuJoCo's default contact of two balls as a differential equation, solved in small steps.

    r'' = -d(r) (b r' + k d(r) r) while that pushes, d from 0.9 to 0.95 over the first millimeter.

    Args:
        speed: At which they meet [m/s].
        reduced: Their reduced mass [kg].
        width: Depth from which on the impedance is constant [m].
    """
    least, most, time_constant, dt = 0.9, 0.95, 0.02, 1e-6
    b, k = 2.0 / (most * time_constant), 1.0 / (most * time_constant) ** 2
    depth, rate, time, peak, deepest, impulse = 0.0, speed, 0.0, 0.0, 0.0, 0.0

    def push(depth: float, rate: float) -> float:
        x = min(depth / width, 1.0)
        share = 2.0 * x * x if x < 0.5 else 1.0 - 2.0 * (1.0 - x) ** 2
        d = least + share * (most - least)
        return max(d * (b * rate + k * d * depth), 0.0)

    while depth >= 0.0:
        middle = depth + 0.5 * dt * rate, rate - 0.5 * dt * push(depth, rate)
        acceleration = push(*middle)
        depth, rate, time = depth + dt * middle[1], rate - dt * acceleration, time + dt
        peak, deepest = max(peak, reduced * acceleration), max(deepest, depth)
        impulse += reduced * acceleration * dt
    return {"peak_force": peak, "depth": deepest, "impulse": impulse, "touch_time": time}


@pytest.mark.parametrize(("name", "speed", "reduced"), [("collision", 2.0, 0.5), ("too_hard", 3.0, 50.0)])
def test_force_and_depth_are_those_of_the_contact_refined(name: str, speed: float, reduced: float) -> None:
    """At a twentieth of the timestep: peak force, depth, impulse and length of the planted touch."""
    path = next(path for path in FAULTS if path.stem == name)
    run = fly(load_scenario(path, {"physics.timestep": 1e-4, "expect": []}))
    exact = soft_contact(speed, reduced)
    found = {key: float(run.trace[f"episode_{key}"][0]) for key in exact}
    print(found, exact)
    assert found == {key: pytest.approx(value, rel=0.01) for key, value in exact.items()}
    assert float(run.trace["episode_closing_speed"][0]) == pytest.approx(speed, rel=1e-9)
    assert not math.isinf(float(run.trace["clearance"].min()))
    assert float(run.trace["clearance"].min()) == pytest.approx(-found["depth"], rel=1e-9)
    assert np.isfinite(run.trace["kinetic_energy"].values).all()
