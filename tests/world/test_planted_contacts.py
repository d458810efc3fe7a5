"""Planted touches with known answers: MuJoCo's soft contact is a spring with a damper, and momentum is kept.

With a constant impedance, MuJoCo's contact of two balls is r'' = -(2 w r' + w^2 r) while that pushes, with
w = 1 / solref's time constant and r the gap: critically damped. For balls that meet at v with reduced mass
m: penetration v t exp(-w t), force m v w (2 - w t) exp(-w t). So the force is largest at once and ends at
2 / w, the deepest point is v / (e w) at 1 / w, and they part at v / e^2, after 4 / w in all.
"""

import math
from typing import Any

import numpy as np
import pytest

from escort_mj.monitor.signals import (
    CLOSING_SPEED,
    DEPTH,
    END,
    FIRST,
    IMPULSE,
    PEAK_FORCE,
    PEAK_TIME,
    SECOND,
    START,
    TOUCH_TIME,
)
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant
from tests.world.episodes import both, told

OMEGA = 1.0 / 0.02  # solref's default time constant
IMPEDANCE = 0.95
APART, RADIUS, GRAVITY = 1.0, 0.2, 9.81


@pytest.fixture(scope="module")
def shaped(drifting):
    """A world of robots without motors, whose contacts have a constant impedance, recorded at each step."""

    def make(robots: dict[str, Any], timestep: float, axes: int = 2) -> World:
        keys = {"physics": {"timestep": timestep}, "recording": {"rate": 1.0 / timestep}}
        world = drifting(robots, axes=axes, target={"position": [0.0, 50.0, 0.0][:axes]}, **keys)
        world.model.geom_solimp[:] = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]
        return world

    return make


def balls(axes: int, speed: float = 2.0) -> dict[str, Any]:
    """Two that are shot at each other; the closing speed is `speed`."""
    rest = [0.0] * (axes - 1)
    return {
        "positions": [[-APART, *rest], [APART, *rest]],
        "velocities": [[0.75 * speed, *rest], [-0.25 * speed, *rest]],
        "radius": RADIUS,
        "overrides": [{"robot": 2, "mass": 3.0}],
    }


@pytest.mark.parametrize("axes", [2, 3])
def test_two_balls_meet_as_a_spring_with_a_damper(axes: int, shaped) -> None:
    speed, reduced = 2.0, 0.75
    exact = {
        CLOSING_SPEED: speed,
        PEAK_FORCE: 2.0 * reduced * speed * OMEGA,
        IMPULSE: reduced * speed * (1.0 + math.exp(-2.0)),
        DEPTH: speed / (math.e * OMEGA),
        TOUCH_TIME: 4.0 / OMEGA,
        START: (2.0 * APART - 2.0 * RADIUS) / speed,
    }
    errors = []
    for timestep in (4e-4, 2e-4, 1e-4):
        world = shaped(balls(axes, speed), timestep, axes)
        with native_loop(world):
            plant = Plant(world)
            before = plant.data.qvel.copy()
            plant.step(round(1.0 / timestep))
            (row,) = told(plant)
            gained = 3.0 * (plant.data.qvel[axes] - before[axes])
        assert (row[FIRST], row[SECOND]) == (0.0, 1.0)
        assert row[IMPULSE] == pytest.approx(gained, rel=1e-9), "the impulse is the change of momentum"
        assert row[END] == pytest.approx(row[START] + row[TOUCH_TIME], abs=1e-12)
        assert row[PEAK_TIME] == row[START], "a damper pushes most at once"
        errors.append([abs(row[column] / value - 1.0) for column, value in exact.items()])
    errors = np.array(errors)
    print(errors)
    assert (errors[-1] < 0.012).all()
    late = errors[:, [1, 2, 3]]  # peak force, impulse, depth: of first order in the timestep
    assert (late[-1] < 0.3 * late[0]).all()


def test_a_dropped_ball(shaped) -> None:
    """It falls from 0.1 m, and the floor gives it its momentum back and carries its weight ever after."""
    timestep, height, mass = 2e-4, 0.1, 2.0
    world = shaped({"kind": "rolling_sphere", "positions": [[0.0, 0.0]], "mass": mass}, timestep)

    def lift(plant: Plant) -> None:
        plant.data.qpos[2] = RADIUS + height

    found, expected, plant = both(world, 6000, lift)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)
    speed, fall = math.sqrt(2.0 * GRAVITY * height), math.sqrt(2.0 * height / GRAVITY)
    first, last = found[0], found[-1]
    assert first[START] == pytest.approx(fall, abs=2 * timestep)
    assert first[CLOSING_SPEED] == pytest.approx(speed, rel=2e-3)
    peak = mass * (2.0 * speed * OMEGA + IMPEDANCE * GRAVITY)
    assert first[PEAK_FORCE] == pytest.approx(peak, rel=5e-3)
    lasted = 6000 * timestep
    momentum = mass * plant.data.qvel[2]
    assert found[:, IMPULSE].sum() == pytest.approx(mass * GRAVITY * lasted + momentum, rel=1e-9)
    assert last[END] == pytest.approx(lasted)
    sinks = GRAVITY * (1.0 - IMPEDANCE) / IMPEDANCE * (IMPEDANCE / OMEGA**2)
    assert world.model.opt.gravity[2] == -GRAVITY
    assert RADIUS - plant.data.qpos[2] == pytest.approx(sinks, rel=1e-3)


def test_one_touch_in_a_coarse_record_is_the_same_touch(shaped) -> None:
    """The log does not depend on how often samples are taken."""
    world = shaped(balls(2), 1e-3)
    with native_loop(world):
        plant = Plant(world)
        plant.step(1000)
        whole = told(plant)
    assert len(whole) == 1
    with native_loop(world):
        plant = Plant(world)
        parts = []
        for _ in range(100):
            plant.step(10)
            parts.append(plant.ended())
    np.testing.assert_array_equal(np.vstack(parts), whole)
