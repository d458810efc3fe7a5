"""Lines through shapes: against MuJoCo's rays, and against signed distances along the line."""

import mujoco
import numpy as np
import pytest

from escort_mj.components.rays import KINDS, stretch
from escort_mj.control.setup import Setup
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.shapes import in_space, nearest_on_shape
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from tests.oracle.rays import stretches_inside
from tests.world.loop.test_depth import SHAPES

BODIES = [{"shape": "sphere", "radius": 0.8}, *SHAPES]


def mission(axes: int) -> tuple[Scenario, Setup]:
    """All shapes at one place, which hide the target."""
    keys = {
        "axes": axes,
        "robots": {"positions": [[9.0] * axes]},
        "target": {"position": [-9.0] * axes},
        "knowledge": {"target": {"hidden": True}},
        "obstacles": [body | {"position": [0.3] * axes} for body in BODIES],
    }
    scenario = Scenario.model_validate(keys)
    return scenario, Mission(scenario).setup


def lines(axes: int) -> tuple[np.ndarray, np.ndarray]:
    """Points around the shapes, and vectors of any length, some along an axis."""
    rng = np.random.default_rng(axes)
    points, ways = rng.normal(scale=1.5, size=(2, 40, axes))
    ways[:4], ways[4:8], points[:2] = 2.0 * np.eye(axes)[0], -0.5 * np.eye(axes)[-1], 0.3
    return points, ways - 0.6 * points


def test_shapes_are_numbered_as_in_mujoco() -> None:
    assert {name: int(getattr(mujoco.mjtGeom, f"mjGEOM_{name.upper()}")) for name in KINDS} == KINDS


@pytest.mark.parametrize("axes", [2, 3])
def test_stretches_are_where_signed_distances_are_negative(axes: int) -> None:
    scenario, setup = mission(axes)
    bodies, places, crossed = obstacles_of(scenario), np.linspace(-3.0, 3.0, 121), 0
    for point, way in zip(*lines(axes), strict=True):
        first, last = (each[0] for each in stretches_inside(point, way[None], setup))
        for j, body in enumerate(bodies):
            gaps = nearest_on_shape(body.solid, in_space(point + places[:, None] * way))[1]
            within = (first[j] < places) & (places < last[j])
            assert ((gaps < 0.0) == within)[np.abs(gaps) > 1e-6].all(), body.shape
            if first[j] < last[j]:
                crossed += 1
                ends = np.array([first[j], last[j]])[:, None] * way + point
                np.testing.assert_allclose(nearest_on_shape(body.solid, in_space(ends))[1], 0.0, atol=1e-8)
    assert crossed > 100


def test_lines_enter_where_rays_of_mujoco_do_and_the_kernel_agrees() -> None:
    _, setup = mission(3)
    met = 0
    for point, way in zip(*lines(3), strict=True):
        first, last = (each[0] for each in stretches_inside(point, way[None], setup))
        for j, shape in enumerate(setup.shapes):
            if shape.kind == KINDS["mesh"]:
                continue
            center = setup.obstacle_position[j]
            hit = mujoco.mju_rayGeom(center, shape.turn.ravel(), shape.size, point, way, shape.kind)
            front = first[j] if first[j] > 0.0 else last[j]  # from inside, a ray meets the far side
            assert hit == pytest.approx(front if first[j] < last[j] and last[j] > 0.0 else -1.0, abs=1e-9)
            met += hit > 0.0
            if shape.kind != KINDS["sphere"]:
                local = (point - center) @ shape.turn, way @ shape.turn
                ends = stretch(shape.kind, shape.size, *local)
                if first[j] < last[j]:
                    np.testing.assert_allclose(ends, (first[j], last[j]), rtol=1e-12, atol=1e-12)
                else:
                    assert not ends[0] < ends[1]
    assert met > 40
