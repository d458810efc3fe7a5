"""Lidars: what returns from each shape, what is hidden, errors and rates, and what avoidance makes of it."""

from typing import Any

import mujoco
import numpy as np
import pytest

import escort_mj
from escort_mj.control.setup import Setup
from escort_mj.numerics.gaussian import LIDAR
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario import Scenario
from escort_mj.scenario.mission import Mission
from escort_mj.sensing.lidar import FAR, widest_gap
from escort_mj.sensors.lidar import even_rays
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant
from tests.control.twins import Kernel, compare
from tests.knowledge.test_sight import among_shapes
from tests.oracle.noise import normal
from tests.oracle.rays import stretches_inside
from tests.world.loop.test_nearest import MISSIONS

SEED = 5
MESH = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
AROUND = [  # each in the way of a ray at a multiple of 45 degrees, and how far away along it
    ({"position": [3, 0], "radius": 0.5}, 2.5),
    ({"shape": "box", "position": [2, 2], "size": [0.4, 0.3], "orientation": np.pi / 4}, np.sqrt(8) - 0.4),
    ({"shape": "cylinder", "position": [0, 4], "size": [0.7]}, 3.3),
    ({"shape": "capsule", "position": [-2, 2], "size": [0.3, 0.5]}, np.sqrt(8) - 0.3),
    ({"shape": "ellipsoid", "position": [-5, 0], "size": [1.2, 0.4]}, 3.8),
    ({"shape": "mesh", "position": [-3, -3], "vertices": MESH, "orientation": np.pi / 4}, np.sqrt(18) - 0.5),
    ({"position": [0, -9], "radius": 0.5}, np.inf),  # out of range
    ({"position": [0, 6], "radius": 0.6}, np.inf),  # behind the cylinder
]


def scanning(*obstacles: dict[str, Any], count: int = 1, **lidar: Any) -> Kernel:
    keys = {
        "seed": SEED,
        "robots": {"count": count},
        "mission": {"behaviors": ["avoid_obstacles", "surface"]},
        "sensing": {"lidar": {"rays": 8, "range": 7.0, **lidar}},
        "obstacles": list(obstacles),
    }
    return Kernel(Mission(Scenario.model_validate(keys)).setup)


def test_rays_return_from_the_surface_of_each_shape() -> None:
    bodies, lengths = zip(*AROUND, strict=True)
    kernel = scanning(*bodies)
    state = kernel.evaluate(0.0, np.zeros((1, 2)), np.zeros((1, 2)))
    np.testing.assert_allclose(state.lidar_nearest, lengths, rtol=0.0, atol=1e-12)
    for number, length in enumerate(lengths):
        expected = length * even_rays(8, 2)[number] if np.isfinite(length) else [FAR, FAR]
        np.testing.assert_allclose(state.lidar_point[number], expected, atol=1e-12)


def test_a_scan_stays_until_the_next_one_and_has_an_error_of_its_own() -> None:
    kernel = scanning({"position": [3, 0], "radius": 0.5}, count=2, noise=0.1, rate=100.0)
    q = np.zeros((2, 2))
    found = []
    for step in range(12):
        q[:, 0] = 0.01 * step, -0.01 * step
        found.append(kernel.evaluate(0.002 * step, q, np.zeros((2, 2))).lidar_nearest.copy())
    lengths = np.array(found)
    assert (lengths[:5] == lengths[0]).all() and (lengths[5:10] == lengths[5]).all()
    for robot, sign in enumerate((1.0, -1.0)):
        errors = [normal(8, SEED, LIDAR, robot, step)[0] for step in (0, 5, 10)]
        expected = [2.5 - sign * 0.01 * step + 0.1 * e for step, e in zip((0, 5, 10), errors, strict=True)]
        np.testing.assert_allclose(lengths[[0, 5, 10], robot], expected, atol=1e-12)


def test_rays_are_even_over_the_sphere() -> None:
    rays = even_rays(500, 3)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, atol=1e-12)
    assert np.abs(rays.mean(axis=0)).max() < 2e-3
    nearest = np.sort(rays @ rays.T, axis=1)[:, -2]
    assert np.arccos(nearest).min() > 0.75 * np.sqrt(4.0 * np.pi / 500)
    ways = np.random.default_rng(1).normal(size=(5000, 3))
    away = np.arccos((ways @ rays.T).max(axis=1) / np.linalg.norm(ways, axis=1))
    assert 0.9 < 2.0 * away.max() / widest_gap(500, 3) < 1.0


def test_what_rays_return_is_recorded_and_drawn(compiled: None) -> None:
    keys = {
        "duration": 0.1,
        "robots": {"count": 1, "radius": 0.1, "positions": [[0.4, -0.3]]},
        "obstacles": [body for body, _ in AROUND],
        "mission": {"behaviors": ["surface"]},
        "sensing": {"lidar": {"rays": 90, "range": 7.0, "record": True}},
    }
    scenario = Scenario.model_validate(keys)
    trace = escort_mj.run(scenario).trace
    setup, rays = Mission(scenario).setup, trace["lidar_ray"].values
    found, q = trace["lidar_range"].values, trace["q"].values
    for lengths, place in zip(found[:, 0], q[:, 0], strict=True):
        first, last = stretches_inside(place, rays, setup)
        nearest = np.where((first < last) & (last > 0.0), first, np.inf).min(axis=1)
        np.testing.assert_allclose(lengths, np.where(nearest < 7.0, nearest, np.inf), rtol=1e-6)
    replay = replay_of(trace)
    ends, whose = replay.returned(replay.at(0.0))
    assert len(ends) == np.isfinite(found[0]).sum() > 10 and not whose.any()
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 0.1, rtol=1e-5)


def returning(axes: int, outer: Any) -> tuple[Setup, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(axes)
    mission = {"outer": outer, "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 2}, "surface"]}
    lidar = {"rays": 60, "range": 8.0, "noise": 0.05, "rate": 250.0}
    setup = among_shapes(
        axes, knowledge=None, communication=None, mission=mission,
        sensing={"lidar": lidar, "position": {"noise": 0.02}, "velocity": {"noise": 0.01}},
    )  # fmt: skip
    return setup, rng.normal(scale=9.0 / axes, size=(6, axes)), rng.normal(size=(6, axes))


@pytest.mark.parametrize(
    ("axes", "outer"), [(2, "nsb"), (3, "set_based"), (2, "barrier_filter"), (3, "potential_field")]
)
def test_kernel_and_twin_avoid_the_same_returns(axes: int, outer: str) -> None:
    setup, q, v = returning(axes, outer)
    assert compare(setup, q, v, steps=8).any()


@pytest.mark.parametrize("keys", [MISSIONS["planar"], MISSIONS["spatial"]], ids=["planar", "spatial"])
def test_in_the_loop_rays_meet_the_geometry_of_mujoco(keys: dict[str, Any], compiled: None) -> None:
    """Shapes, walls with doors and what moves, seen by one robot, against `mj_multiRay`."""
    axes, far = keys.get("axes", 2), 60.0
    robots = {"positions": [[0.5, 0.3, -0.2][:axes]]}
    mover = {"shape": "box", "size": [0.5, 0.3, 0.4], "motion": {"position": ["4 - t", *[2] * (axes - 1)]}}
    changes = {
        "robots": robots,
        "target": {"position": [900.0] * axes},
        "sensing": {"lidar": {"rays": 300, "range": far}},
        "obstacles": [*keys["obstacles"], mover],
    }
    world = build(Scenario.model_validate(keys | changes))
    model = world.model
    with native_loop(world):
        plant = Plant(world)
        plant.step(50)
        mujoco.mj_forward(model, plant.data)
        rays = np.zeros((300, 3))
        rays[:, :axes] = even_rays(300, axes)
        eye, lengths = plant.data.geom("robot_1_body").xpos, np.zeros((300, 1))
        geoms = np.zeros((300, 1), dtype=np.int32)
        body = model.geom("robot_1_body").bodyid[0]
        found = geoms, lengths, None, 300, far
        mujoco.mj_multiRay(model, plant.data, eye, rays.reshape(-1, 1), None, True, body, *found)
        for number, name in enumerate(world.bodies.names[2:-1]):
            mine = geoms[:, 0] == model.geom(f"{name}_body").id
            expected = lengths[mine, 0].min(initial=np.inf)
            assert plant.state.lidar_nearest[number] == pytest.approx(expected, abs=1e-7), name
        assert np.isfinite(plant.state.lidar_nearest).sum() >= 5
