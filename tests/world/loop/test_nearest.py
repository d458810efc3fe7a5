"""What robots see of obstacles that are no spheres, against exact geometry; and what the law makes of it."""

import mujoco
import numpy as np
import pytest

from escort_mj.mission import fly
from escort_mj.scenario import parse_scenario
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.shapes import in_space, nearest_on_shape
from escort_mj.scenario.reader.dump import flow
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant
from tests.corpus import missions
from tests.oracle.reference import ReferenceController

MISSIONS = missions(__file__)


def points_by_geometry(world: World, scenario, state) -> np.ndarray:
    """What every robot and the target see, shape (n + 1, m, p), by exact geometry."""
    seers = np.vstack([state.q, state.target_position])
    seen = []
    for body in obstacles_of(scenario):
        if body.is_sphere:
            seen.append(np.tile(body.position, (len(seers), 1)))
        else:
            seen.append(nearest_on_shape(body.solid, in_space(seers))[0][:, : scenario.axes])
    return np.stack(seen, axis=1)


@pytest.mark.parametrize("mission", [MISSIONS["planar"], MISSIONS["spatial"]], ids=["plane", "space"])
def test_points_are_the_nearest(mission):
    scenario = parse_scenario(flow(mission)).replace({"mission.outer": "nsb"})  # set_based looks farther
    world = build(scenario)
    plant = Plant(world)
    n, m, p = world.sizes["robot"], world.sizes["obstacle"], world.sizes["axis"]
    near = far = 0
    with native_loop(world):
        for _ in range(40):
            plant.step(200)
            seen = plant.state.obstacle_point.reshape(n + 1, m, p)
            exact = points_by_geometry(world, scenario, plant.state)
            seers = np.vstack([plant.state.q, plant.state.target_position])
            gaps = np.linalg.norm(seers[:, None] - exact, axis=2)
            bound = np.linalg.norm(seers[:, None] - seen, axis=2)
            close = gaps < world.setup.nearest_within
            np.testing.assert_allclose(seen[close], exact[close], atol=2e-4)
            np.testing.assert_allclose(bound[close], gaps[close], atol=5e-6)
            assert (bound[~close] <= gaps[~close] + 5e-6).all()
            assert (bound[~close] >= world.setup.nearest_within - 0.5).all()
            near, far = near + close.sum(), far + (~close).sum()
    assert near > 20 and far > 20


def test_a_bound_far_away_is_held_against_the_shape_and_not_the_box_around_it(compiled):
    """The target passes a disc at 2.2 m; its box, turned, has a corner that is nearer."""
    keys = {
        "duration": 4,
        "target": {"position": ["-2+t", "0"]},
        "robots": {"count": 1, "positions": [[-2, -9]]},
        "mission": {"radius": 9, "behaviors": ["surface"]},
        "obstacles": [
            {"shape": "cylinder", "size": [1, 2], "position": [0, 3.5], "orientation": 0.785, "name": "disc"}
        ],
        "expect": [{"clearance": ["target", "disc"], "at_least": bound} for bound in (2.1999, 2.2001)],
    }
    near, beyond = fly(parse_scenario(flow(keys))).verdicts[1:]
    assert near.value == beyond.value == pytest.approx(3.5 - 1.0 - 0.3, abs=1e-5)
    assert near.passed and not beyond.passed


@pytest.mark.parametrize(
    ("mission", "outer"),
    [
        pytest.param(MISSIONS["planar"], "nsb", id="nsb"),
        pytest.param(MISSIONS["spatial"], "barrier_filter", id="barrier_filter", marks=pytest.mark.slow),
    ],
)
def test_the_law_is_the_twins(mission, outer):
    agree(mission, outer, 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("timestep", [0.01, 0.002])
@pytest.mark.parametrize("outer", ["nsb", "potential_field", "barrier_filter"])
@pytest.mark.parametrize("mission", [MISSIONS["planar"], MISSIONS["spatial"]], ids=["plane", "space"])
def test_every_law_is_the_twins(mission, outer, timestep):
    agree(mission, outer, timestep)


def agree(mission, outer, timestep):
    orders = {"radius": 4.0, "max_speed": 2.0, "outer": outer}
    scenario = parse_scenario(flow(mission | {"mission": orders, "physics": {"timestep": timestep}}))
    world = build(scenario)
    plant = Plant(world)
    twin = ReferenceController(world.setup, world.schedule.stride, world.schedule.extra)
    twin.reset(world.team.position)
    n, m, p = world.sizes["robot"], world.sizes["obstacle"], world.sizes["axis"]
    avoided = False
    with native_loop(world):
        for _ in range(round(6.0 / timestep)):
            mujoco.mj_step1(world.model, plant.data)
            state = plant.state
            signals = twin.evaluate(
                plant.data.time, state.q, state.v, obstacle_points=state.obstacle_point.reshape(n + 1, m, p)
            )
            np.testing.assert_allclose(state.tau, signals.tau, atol=1e-6, rtol=1e-6)
            np.testing.assert_allclose(state.v_d, signals.v_d, atol=1e-8, rtol=1e-8)
            avoided |= bool(signals.avoidance_active.any())
            mujoco.mj_step2(world.model, plant.data)
    assert avoided
