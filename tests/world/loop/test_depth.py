"""How deep a center is inside a shape, and which way leads out: against exact geometry and brute force."""

import mujoco
import numpy as np
import pytest

from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.shapes import Solid, nearest_on_shape
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

MESH = [[-1, -0.2, -0.6], [1, 0, -0.5], [0, 1, -0.4], [0.1, 0, 1], [0.5, 0.5, 1]]
SHAPES = [
    {"shape": "box", "size": [1.5, 0.4, 0.9]},
    {"shape": "box", "size": [1.5, 0.4, 0.9], "orientation": [0.3, 0.5, 1.0]},
    {"shape": "cylinder", "size": [0.8, 0.5]},
    {"shape": "cylinder", "size": [0.8, 1.5], "orientation": [1.2, 0.3, 0.0]},
    {"shape": "capsule", "size": [0.5, 1.2], "orientation": [0.0, 1.5707963, 0.4]},
    {"shape": "capsule", "size": [0.5, 0.7], "orientation": [0.7, 0.2, 0.0]},
    {"shape": "ellipsoid", "size": [1.2, 0.5, 0.7]},
    {"shape": "ellipsoid", "size": [1.2, 0.2, 0.7], "orientation": [1.0, 0.5, 0.2, 0.1]},
    {"shape": "mesh", "vertices": MESH, "orientation": 0.7},
    {"shape": "mesh", "vertices": MESH, "orientation": [1.0, 0.4, 0.2]},
]
RADIUS = 0.2


def scenario(axes: int) -> Scenario:
    places = [[6.0 * number, *[3.0] * (axes - 1)] for number in range(len(SHAPES))]
    return Scenario.model_validate(
        {
            "axes": axes,
            "robots": {"positions": [[0.0] * axes], "radius": RADIUS},
            "target": {"position": [-20.0] * axes},
            "mission": {"radius": 5.0, "outer": "nsb"},
            "obstacles": [shape | {"position": place} for shape, place in zip(SHAPES, places, strict=True)],
        }
    )


def way_out(solid: Solid, point: np.ndarray) -> float:
    """How far the shortest of 360 rays in the plane goes until it leaves a shape, by bisection [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    rays = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(360)])
    low, high = np.zeros(360), np.full(360, 4.0)
    for _ in range(45):
        middle = 0.5 * (low + high)
        inside = nearest_on_shape(solid, point + middle[:, None] * rays)[1] < 0.0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        first = low <= high.min()  # the others end later
        rays, low, high = rays[first], low[first], high[first]
    return float(low.min())


@pytest.mark.parametrize("axes", [2, 3])
def test_depth_and_way_out_are_exact_in_every_shape(axes: int, compiled: None) -> None:
    mission = scenario(axes)
    world, rng, deep = build(mission), np.random.default_rng(axes), 0
    with native_loop(world):
        plant = Plant(world)
        for number, body in enumerate(obstacles_of(mission)):
            offsets = rng.uniform(-1.0, 1.0, (12, axes)) * 0.8
            offsets[0], offsets[1], offsets[2, 1:] = 0.0, [0.3, *[0.0] * (axes - 1)], 0.0
            for offset in offsets:
                place = body.position + offset
                point = np.zeros(3)
                point[:axes] = place
                gap = nearest_on_shape(body.solid, point[None])[1][0]
                if gap > -1e-3:
                    continue
                deep += 1
                plant.data.qpos[:axes] = place
                mujoco.mj_forward(world.model, plant.data)
                state = plant.state
                depth, way = -float(state.obstacle_gap[number]), np.zeros(3)
                seen = state.obstacle_point[number]
                behind = min(depth, RADIUS)
                way[:axes] = (place - seen) / behind
                assert np.linalg.norm(way) == pytest.approx(1.0, abs=1e-9)
                on_surface = nearest_on_shape(body.solid, (point + depth * way)[None])[1][0]
                assert on_surface == pytest.approx(0.0, abs=1e-9), "the way out ends at the surface"
                if axes == 3:
                    assert depth == pytest.approx(-gap, abs=1e-9)
                else:
                    assert depth <= way_out(body.solid, point) + 1e-9, "no way out is shorter"
                assert state.avoidance_active[0] == 1.0
                assert state.v_d[0] @ way[:axes] > 0.0, "avoidance leads out"
    assert deep > 50


def test_outside_the_gap_is_the_distance(compiled: None) -> None:
    """To the box around a shape where that is beyond the mission's reach, else to the shape."""
    mission = scenario(3)
    world, rng = build(mission), np.random.default_rng(7)
    with native_loop(world):
        plant = Plant(world)
        for number, body in enumerate(obstacles_of(mission)):
            for offset in rng.normal(scale=1.5, size=(10, 3)):
                place = body.position + offset
                gap = nearest_on_shape(body.solid, place[None])[1][0]
                if not 1e-3 < gap < world.setup.nearest_within:
                    continue
                plant.data.qpos[:3] = place
                mujoco.mj_forward(world.model, plant.data)
                assert plant.state.obstacle_gap[number] == pytest.approx(gap, abs=5e-6)
