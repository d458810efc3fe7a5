"""Missions of more than three axes: a robot is several bodies, and one of p axes to the law."""

import itertools

import mujoco
import numpy as np
import pytest

from escort_mj.components.mission import axis_names
from escort_mj.monitor.signals import DEPTH, IMPULSE, PEAK_FORCE, TOUCH_TIME
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant

BODIES = {4: 2, 5: 2, 7: 3, 9: 3}  # of each robot


def mission(axes: int, count: int = 3, **keys) -> dict:
    """A mission of a few robots in general position, with something of everything."""
    rng = np.random.default_rng(axes)
    return {
        "axes": axes,
        "robots": {
            "positions": (4.0 * rng.normal(size=(count, axes))).round(3).tolist(),
            "overrides": [{"robot": 2, "mass": 2.5, "radius": 0.3, "force_limit": 7.0}],
        },
        "obstacles": [{"position": (9.0 + np.arange(axes)).tolist(), "radius": 0.7}],
        "target": {"position": [f"{k + 1}*t + {k}" for k in range(axes)]},
        **keys,
    }


@pytest.fixture(params=BODIES, ids=lambda axes: f"p{axes}")
def world(request, make_world) -> World:
    return make_world(**mission(request.param))


def test_names_and_order(world: World) -> None:
    """The coordinates of a robot lie side by side, and its motors in the same order."""
    m, p = world.model, world.sizes["axis"]
    bodies = [m.body(i).name for i in range(1, m.nbody)]
    parts = ["", *(f"_shadow_{s}" for s in range(1, BODIES[p]))]
    things = ["robot_1", "robot_2", "robot_3", "obstacle_1", "target"]
    assert bodies == [thing + part for thing in things for part in parts]
    assert (m.nq, m.nv, m.nu) == (3 * p, 3 * p, 3 * p)
    wanted = [f"robot_{i}_{axis}" for i in (1, 2, 3) for axis in axis_names(p)]
    assert [m.joint(i).name for i in range(m.njnt)] == wanted
    assert [m.actuator(i).name for i in range(m.nu)] == wanted
    assert m.actuator_trnid[:, 0].tolist() == list(range(3 * p))
    assert m.qpos0.reshape(3, p).tolist() == world.team.position.tolist()
    limits = np.repeat([10.0, 7.0, 10.0], p)
    assert np.array_equal(m.actuator_forcerange, np.stack([-limits, limits], axis=1))
    assert (m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE).all()
    assert not m.geom_contype.any() and not m.geom_conaffinity.any(), "MuJoCo finds no contacts"


def test_kinetic_energy_is_that_of_one_mass_in_all_axes(world: World) -> None:
    m, p = world.model, world.sizes["axis"]
    data = mujoco.MjData(m)
    velocity = np.random.default_rng(0).normal(size=(3, p))
    data.qvel = velocity.ravel()
    mujoco.mj_forward(m, data)
    mujoco.mj_energyVel(m, data)
    expected = 0.5 * (np.array([1.0, 2.5, 1.0]) * (velocity**2).sum(axis=1)).sum()
    assert data.energy[1] == pytest.approx(expected, rel=1e-14)


def test_bodies_are_drawn_where_the_coordinates_say(world: World) -> None:
    """Each direction of a body is one coordinate, up to an offset that never changes."""
    m, p = world.model, world.sizes["axis"]
    data = mujoco.MjData(m)
    rng = np.random.default_rng(1)
    directions = {1: "z", 2: "xz", 3: "xyz"}
    offsets = []
    for _ in range(3):
        q = rng.normal(scale=5.0, size=(3, p))
        data.qpos = q.ravel()
        mujoco.mj_kinematics(m, data)
        found = []
        for i, first in itertools.product(range(3), range(0, p, 3)):
            name = f"robot_{i + 1}" + (f"_shadow_{first // 3}" if first else "")
            axes = range(first, min(first + 3, p))
            for direction, axis in zip(directions[len(axes)], axes, strict=True):
                found.append(data.body(name).xpos["xyz".index(direction)] - q[i, axis])
        offsets.append(np.reshape(found, (3, p)))
    np.testing.assert_allclose(offsets[1:], [offsets[0]] * 2, rtol=0.0, atol=1e-13)
    np.testing.assert_array_equal(np.round(offsets[0], 13), np.round(offsets[0][:1], 13).repeat(3, axis=0))
    np.testing.assert_allclose(offsets[0][:, :3], 0.0, atol=1e-14)


def test_stages_stand_apart(world: World) -> None:
    """Nothing of one stage is among another's, at the start."""
    m = world.model
    data = mujoco.MjData(m)
    mujoco.mj_forward(m, data)
    spans = []
    for part in ["", *(f"_shadow_{s}" for s in range(1, BODIES[world.sizes["axis"]]))]:
        places = [
            data.body(f"{thing}{part}").xpos[0] for thing in ("robot_1", "robot_2", "robot_3", "target")
        ]
        spans.append((min(places), max(places)))
    for (_, right), (left, _) in itertools.pairwise(spans):
        assert right + 5.0 < left  # at least the mission's radius


def test_touch_is_judged_in_all_axes(drifting, record_steps) -> None:
    """Bodies on each other in x, y, z and apart in x4 do not touch; MuJoCo itself finds no contact at all."""
    apart = [[0, 0, 0, 3], [0, 0, 0, 3.5], [5, 0, 0, -3], [1000, 1000, 1000, 1001]]
    world = drifting(
        {"positions": apart, "radius": 0.2},
        axes=4,
        obstacles=[{"position": [5, 0, 0, -1], "radius": 1.0}],
        target={"position": [1e3] * 4, "radius": 0.3},
    )

    def close(index: int, coordinate: int, value: float):
        def prepare(plant: Plant) -> None:
            plant.data.qpos[4 * index + coordinate] = value

        return prepare

    for prepare, expected in (
        (id, 0),
        (close(0, 3, 3.11), 1),  # robots 1 and 2: 0.39 apart, 0.4 is needed
        (close(0, 3, 3.09), 0),
        (close(2, 3, -2.19), 1),  # robot 3 and the obstacle: 1.19 of 1.2
        (close(2, 3, -2.21), 0),
        (close(3, 3, 1000.49), 1),  # robot 4 and the target: 0.49 of 0.5
        (close(3, 3, 1000.51), 0),
    ):
        with native_loop(world):
            plant = Plant(world)
            prepare(plant)
            plant.step(3)
        rows = plant.under_way()
        assert len(rows) == expected
        np.testing.assert_allclose(rows[:, TOUCH_TIME], 0.006)
        np.testing.assert_allclose(rows[:, DEPTH], 0.01, atol=1e-12)
        assert not rows[:, [PEAK_FORCE, IMPULSE]].any() and not len(plant.ended())


def test_the_targets_bodies_go_where_the_law_has_it(world: World) -> None:
    p = world.sizes["axis"]
    with native_loop(world):
        plant = Plant(world)
        start = plant.data.mocap_pos.copy()
        plant.step(500)
        moved = plant.data.mocap_pos - start
    directions = {1: [2], 2: [0, 2], 3: [0, 1, 2]}
    for stage, first in enumerate(range(0, p, 3)):
        axes = range(first, min(first + 3, p))
        expected = np.zeros(3)
        expected[directions[len(axes)]] = [1.0 + axis for axis in axes]
        np.testing.assert_allclose(moved[stage], expected * plant.data.time, rtol=1e-12)
