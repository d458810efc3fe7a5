"""Planted touches with known answers: MuJoCo's soft contact is a spring with a damper, and momentum is kept.

With a constant impedance, MuJoCo's contact of two balls is r'' = -(2 w r' + w^2 r) while that pushes, with
w = 1 / solref's time constant and r the gap: critically damped. For balls that meet at v with reduced mass
m: penetration v t exp(-w t), force m v w (2 - w t) exp(-w t). So the force is largest at once and ends at
2 / w, the deepest point is v / (e w) at 1 / w, and they part at v / e^2, after 4 / w in all.
"""

import math

import mujoco
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
from escort_mj.scenario.reader.load import parse_scenario
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant
from tests.world.episodes import both, told

OMEGA = 1.0 / 0.02  # solref's default time constant
IMPEDANCE = 0.95
APART, RADIUS, GRAVITY = 1.0, 0.2, 9.81


def shot(axes: int, timestep: float, speed: float = 2.0, mass: tuple[float, float] = (1.0, 3.0)):
    """Two balls shot at each other, without motors; the closing speed is `speed`."""
    start, rest = [0.0] * (axes - 1), [0.0] * (axes - 1)
    scenario = Scenario.model_validate(
        {
            "axes": axes,
            "physics": {"timestep": timestep},
            "recording": {"rate": 1.0 / timestep},
            "target": {"position": [0.0, 50.0, *[0.0] * (axes - 2)]},
            "robots": {
                "positions": [[-APART, *start], [APART, *start]],
                "velocities": [[0.75 * speed, *rest], [-0.25 * speed, *rest]],
                "radius": RADIUS,
                "force_limit": 1e-12,
                "overrides": [{"robot": i + 1, "mass": each} for i, each in enumerate(mass)],
            },
            "mission": {"radius": 5.0, "behaviors": ["surface"]},
        }
    )
    world = build(scenario)
    world.model.geom_solimp[:] = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]
    return world


@pytest.mark.parametrize("axes", [2, 3])
def test_two_balls_meet_as_a_spring_with_a_damper(axes: int, compiled: None) -> None:
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
        world = shot(axes, timestep, speed)
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


def test_a_dropped_ball(compiled: None) -> None:
    """It falls from 0.1 m, and the floor gives it its momentum back and carries its weight ever after."""
    timestep, height, mass = 2e-4, 0.1, 2.0
    world = build(
        Scenario.model_validate(
            {
                "physics": {"timestep": timestep},
                "recording": {"rate": 1.0 / timestep},
                "target": {"position": [50.0, 0.0]},
                "robots": {
                    "kind": "rolling_sphere",
                    "positions": [[0.0, 0.0]],
                    "mass": mass,
                    "force_limit": 1e-12,
                },
                "mission": {"radius": 5.0, "behaviors": ["surface"]},
            }
        )
    )
    world.model.geom_solimp[:] = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]

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


def test_one_touch_in_a_coarse_record_is_the_same_touch(compiled: None) -> None:
    """The log does not depend on how often samples are taken."""
    world = shot(2, 1e-3)
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


def test_what_is_too_fast_passes_through_and_is_flagged(compiled: None) -> None:
    """600 m/s: 1.2 m in a step of 2 ms, three balls. No step sees a touch; the metric says so."""
    from escort_mj.mission import fly

    keys = {
        "duration": 0.02,
        "target": {"position": [0.0, 50.0]},
        "robots": {
            "positions": [[-2.2, 0.0], [2.0, 0.0]],
            "velocities": [[600.0, 0.0], [0.0, 0.0]],
            "force_limit": 1e-12,
        },
        "mission": {"radius": 5.0, "behaviors": ["surface"]},
        "recording": {"rate": 50},
    }
    run = fly(Scenario.model_validate(keys))
    assert run.trace.sizes["episode"] == 0
    assert run.trace["q"].values[-1, 0, 0] > 5.0, "it went through"
    assert run.metrics["tunneling"]["value"] == pytest.approx(3.0, rel=1e-6)
    assert run.metrics["tunneling"]["who"] == "robot 1"
    assert run.metrics["kinetic_energy_max"]["value"] == pytest.approx(0.5 * 600.0**2, rel=1e-6)
    slow = Scenario.model_validate(
        keys | {"robots": keys["robots"] | {"velocities": [[4.0, 0.0], [0.0, 0.0]]}}
    )
    assert fly(slow).metrics["tunneling"]["value"] == pytest.approx(0.02, rel=1e-6)


def test_a_ball_that_starts_rolling_does_not_slip(make_world, record_steps) -> None:
    world = make_world(
        robots={
            "kind": "rolling_sphere",
            "positions": [[0.0, 0.0]],
            "velocities": [[0.6, -0.8]],
            "force_limit": 1e-12,
        },
        target={"position": [50.0, 0.0]},
        mission={"radius": 5.0, "behaviors": ["surface"]},
    )
    assert mujoco.MjModel.from_xml_string(world.xml).key_qvel.tobytes() == world.model.key_qvel.tobytes()
    record = record_steps(world, 500)
    np.testing.assert_allclose(record["v"][:, 0], np.broadcast_to([0.6, -0.8], (500, 2)), rtol=0, atol=6e-3)
    assert parse_scenario("robots: {positions: [[3, 4]], velocities: [[1, 2]]}").robots.velocities
