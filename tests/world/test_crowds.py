"""Crowds: the physics chosen for them, and room for contacts when all of them touch."""

from typing import Any

import mujoco
import numpy as np
import pytest

from escort_mj.scenario.geometry.crowd import CROWD
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant

MIB = 2.0**20


def heap(count: int, **robots: Any) -> dict[str, Any]:
    """Robots in a dense cube, driven to the target in its middle."""
    side = int(np.ceil(count ** (1 / 3)))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:count]
    return {
        "axes": 3,
        "robots": {"positions": (0.41 * (grid - grid.mean(axis=0) + 0.01)).tolist(), **robots},
        "mission": {"radius": 0.5, "behaviors": ["surface"], "target_feedforward": False},
        "target": {"radius": 0.001},
    }


@pytest.mark.slow_cases("physics0")
@pytest.mark.parametrize("physics", [{}, {"friction": True}])
def test_a_thousand_robots_squeezed_together_run(make_world, physics) -> None:
    world = make_world(**heap(1000), physics=physics)
    assert world.model.narena < 100 * MIB
    with native_loop(world):
        plant = Plant(world)
        plant.step(60)
        assert plant.data.ncon > 2000, "they touch"
        assert plant.warnings() == {}
        assert plant.state.contacts_untold[0] == 0.0
        assert np.isfinite(plant.data.qpos).all()
        assert plant.data.maxuse_arena < 0.5 * world.model.narena


def test_what_is_chosen_for_crowds(make_world) -> None:
    few, crowd = make_world(**heap(CROWD - 1)).model, make_world(**heap(CROWD)).model
    assert few.opt.solver == mujoco.mjtSolver.mjSOL_NEWTON and set(few.geom_condim.tolist()) == {3}
    assert crowd.opt.solver == mujoco.mjtSolver.mjSOL_CG and set(crowd.geom_condim.tolist()) == {1}
    told = make_world(**heap(CROWD), physics={"solver": "newton", "friction": True}).model
    assert told.opt.solver == mujoco.mjtSolver.mjSOL_NEWTON and set(told.geom_condim.tolist()) == {3}
    assert told.narena != crowd.narena, "Newton's method needs the room that MuJoCo guesses"
    slippery = make_world(**heap(5), physics={"friction": False}).model
    assert set(slippery.geom_condim.tolist()) == {1}


def test_a_crowd_of_balls_still_rubs_on_the_floor(make_world) -> None:
    at = [[x, y] for x in range(10) for y in range(10)]
    world = make_world(robots={"kind": "rolling_sphere", "positions": at}, target={"position": [30.0, 30.0]})
    assert world.model.geom("floor").condim == 3 and world.model.geom("robot_1_body").condim == 1
    with native_loop(world):
        plant = Plant(world)
        plant.step(100)
        assert set(plant.data.contact.dim.tolist()) == {3}
        spin = plant.data.qvel.reshape(-1, 6)[:, 3:5]
        assert np.abs(spin).max() > 0.1, "they roll"


def test_both_solvers_find_the_same_forces(make_world) -> None:
    """A heap in which all touch moves the same: the problem is convex, only the way to its end differs."""
    moved = []
    for solver in ("newton", "cg"):
        world = make_world(**heap(CROWD), physics={"solver": solver, "friction": True})
        with native_loop(world):
            plant = Plant(world)
            plant.step(60)
            moved.append(plant.data.qpos.copy())
            assert plant.data.ncon > CROWD
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-6)
