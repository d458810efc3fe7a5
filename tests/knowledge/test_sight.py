"""Who sees the target, and whose messages pass, past shapes and teammates and within a field of view."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from escort_mj import Controller
from escort_mj.control.setup import Setup
from escort_mj.errors import UsageError
from escort_mj.scenario import Scenario
from escort_mj.scenario.mission import Mission
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant
from tests.components.test_rays import BODIES
from tests.control.twins import Kernel, assert_same
from tests.oracle.rays import stretches_inside
from tests.oracle.reference import ReferenceController

COUNT = 6


def among_shapes(axes: int, **changes: Any) -> Setup:
    """Robots whose sight and messages shapes block."""
    rng = np.random.default_rng(7)
    places = [[3.0 * number - 15.0, *rng.uniform(-2.0, 2.0, axes - 1)] for number in range(len(BODIES))]
    keys = {
        "axes": axes,
        "robots": {"count": COUNT, "placement": {"within": 12}},
        "target": {"position": ["t", *[0.5] * (axes - 1)]},
        "mission": {"behaviors": ["surface"]},
        "knowledge": {"target": {"hidden": True, "hidden_by_teammates": True}},
        "communication": {"blocked": True, "timeout": 0.003},
        "obstacles": [body | {"position": place} for body, place in zip(BODIES, places, strict=True)],
        **changes,
    }
    return replace(Mission(Scenario.model_validate(keys)).setup, shaped=False)


@pytest.mark.parametrize("axes", [2, 3])
def test_kernel_and_twin_see_and_hear_the_same(axes: int) -> None:
    """Robots are thrown among the shapes and look anywhere."""
    rng, seen, heard = np.random.default_rng(axes), [], []
    setup = among_shapes(axes)
    assert setup.sight is not None
    setup = replace(setup, sight=setup.sight.model_copy(update={"field_of_view": 3.5}))
    kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
    q, v = rng.normal(scale=14.0 / axes**1.5, size=(COUNT, axes)), np.zeros((COUNT, axes))
    twin.reset(q)
    for step in range(12):
        headings = rng.normal(size=(COUNT, axes))
        kernel.state.heading[:] = headings
        state = kernel.evaluate(step * 0.002, q, v)
        assert_same(state, twin.evaluate(step * 0.002, q, v, headings=headings), 1e-10)
        seen.append(state.target_seen.copy())
        heard.append((state.link_step == step).sum())
        way = setup.target.position(step * 0.002) - q
        angle = np.einsum("ij,ij->i", way, headings) / np.linalg.norm(headings, axis=1)
        outside = np.arccos(angle / np.linalg.norm(way, axis=1)) > 1.75
        ends = np.array([stretches_inside(a, b[None], setup) for a, b in zip(q, way, strict=True)])[:, :, 0]
        blocked = ((ends[:, 0] < ends[:, 1]) & (ends[:, 0] < 1.0) & (ends[:, 1] > 0.0)).any(axis=1)
        assert not state.target_seen[outside | blocked].any()
        q = rng.normal(scale=14.0 / axes**1.5, size=(COUNT, axes))
    assert 0.05 < np.mean(seen) < 0.6
    assert 0.1 < np.mean(heard) / (COUNT * (COUNT - 1)) < 0.9


def sees(robots: list[list[float]], *obstacles: dict[str, Any], **sight: Any) -> list[bool]:
    """Who sees a target at (6, 0)."""
    keys = {
        "robots": {"positions": robots, "radius": 0.2},
        "target": {"position": [6, 0]},
        "mission": {"behaviors": ["surface"]},
        "knowledge": {"target": sight},
        "obstacles": list(obstacles),
        "walls": [{"points": [[2, -5], [2, -1]], "thickness": 0.1}],
    }
    setup = replace(Mission(Scenario.model_validate(keys)).setup, shaped=False)
    places = np.array(robots, float)
    return (Kernel(setup).evaluate(0.0, places, 0.0 * places).target_seen > 0.0).tolist()


def test_walls_shapes_and_teammates_hide_the_target() -> None:
    robots = [[0.0, 0.0], [0.0, -3.0], [4.0, 0.1]]
    assert sees(robots) == [True] * 3
    assert sees(robots, hidden=True) == [True, False, True], "a wall"
    box = {"shape": "box", "position": [1, 0.9], "size": [0.5, 0.8], "orientation": 0.3}
    assert sees(robots, box, hidden=True) == [False, False, True]
    assert sees(robots, hidden_by_teammates=True) == [False, True, True]


def test_robots_look_along_the_x_axis_of_their_bodies(compiled: None) -> None:
    """A drive, a vessel and a quadrotor, which look away from the target or toward it."""
    kinds = [{"kind": "diff_drive", "heading": 2.0}, "quadrotor", {"kind": "surface_vessel", "heading": 0.3}]
    keys = {
        "robots": {
            "positions": [[0.0, 0.0], [0.0, 3.0], [0.0, -3.0], [9.0, 9.0]],
            "overrides": [{"robot": robot, "kind": kind} for robot, kind in enumerate(kinds, 1)],
        },
        "target": {"position": [8, 0]},
        "mission": {"behaviors": ["surface"]},
        "knowledge": {"target": {"robots": [1, 2, 3], "field_of_view": 1.6}},
    }
    world = build(Scenario.model_validate(keys))
    with native_loop(world):
        plant = Plant(world)
        plant.step(1)
        headings = [[np.cos(angle), np.sin(angle)] for angle in (2.0, 0.0, 0.3)]
        np.testing.assert_allclose(plant.state.heading[:3], headings, atol=1e-3)
        assert plant.state.target_seen.tolist() == [0.0, 1.0, 1.0, 0.0]


def test_robots_of_a_controller_have_no_headings() -> None:
    keys = {"robots": {"kind": "diff_drive"}, "knowledge": {"target": {"field_of_view": 2.0}}}
    assert Controller(keys).count == 5
    with pytest.raises(UsageError, match="is not given headings"):
        Controller(keys, simulate=True)
