"""Robots with goals: both forms agree, waypoints are passed in order, the distance decays at the gain."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj import Controller, api
from escort_mj.behaviors import Goal
from escort_mj.environments.simulation import Simulation
from escort_mj.errors import UsageError
from escort_mj.mission.stepped import SteppedMission
from escort_mj.rules.quantities import RobotDistance
from escort_mj.scenario.schema.scenario import Phase
from tests.control.twins import AVOID, SURFACE, Kernel, compare, mission

GOAL = Goal(goals=((0.0, 0.0),), gain=0.7, reach=0.5)
SQUARE = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


@pytest.mark.parametrize(("axes", "max_speed"), [(2, 1.5), (3, np.inf)])
@pytest.mark.parametrize(
    "stack", [(GOAL,), (AVOID, GOAL), (GOAL, AVOID), (AVOID, SURFACE, GOAL), (AVOID, GOAL, SURFACE)]
)
def test_kernel_and_numpy_agree(stack, axes: int, max_speed: float) -> None:
    """The target moves: a goal takes none of its velocity, unless an escort task ranks higher."""
    setup, q, v = mission(axes, seed=31)
    rng = np.random.default_rng(axes)
    first = tuple(q[i] + rng.normal(scale=0.4, size=(1 + i % 3, axes)) for i in range(len(q)))
    second = tuple(rng.normal(size=(1, axes)) for _ in q)
    phases = (
        Phase(behaviors=(AVOID, Goal(goals=((1.0, 1.0),), gain=2.0)), after=0.003),
        Phase(behaviors=(SURFACE,), when=RobotDistance(below=3.0)),
    )
    compare(replace(setup, behaviors=stack, goals=(first, second), phases=phases, max_speed=max_speed), q, v)


def test_waypoints_are_passed_in_order() -> None:
    setup, q, v = mission(2, seed=1, count=2, obstacles=0)
    ways = (np.array(SQUARE), np.array([[5.0, 5.0]]))
    setup = replace(setup, behaviors=(GOAL,), goals=(ways,), sensing=type(setup.sensing)())
    kernel = Kernel(setup)
    for step, place in enumerate([[9.0, 9.0], [1.0, 0.4], [1.0, 0.4], [0.9, 1.0], [0.0, 1.0], [9.0, 9.0]]):
        q[0] = place
        state = kernel.evaluate(step * setup.timestep, q, v)
        at = [0, 1, 1, 2, 2, 2][step]
        assert state.goal[0].tolist() == SQUARE[at]
        assert state.goals_left.tolist() == [2 - at, 0]
        np.testing.assert_allclose(state.v_d[0], 0.7 * (np.array(SQUARE[at]) - place), rtol=1e-12)


def test_the_distance_to_a_goal_decays_at_the_gain() -> None:
    goal = {"behavior": "goal", "goals": [[-3.0, 4.0], [3.0, -4.0]], "gain": 0.5}
    keys = {
        "target": None,
        "duration": 4.0,
        "robots": {"positions": [[3.0, 4.0], [-3.0, -4.0]], "force_limit": None},
        "mission": {"behaviors": [goal]},
    }
    trace = api.run(keys).trace
    distance = np.linalg.norm(trace["q"].values - trace["goal"].values, axis=2)
    decay = np.exp(-0.5 * trace["time"].values)[:, None]
    np.testing.assert_allclose(distance, distance[0] * decay, atol=0.02 * distance[0, 0])
    assert np.isinf(trace["clearance"].sel(group="target")).all()


def test_goals_change_while_a_mission_runs() -> None:
    """Fewer waypoints than a robot has passed: it goes to the last one; goals neither come nor go away."""
    ways = [[[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], [[0.0, 3.0]]]
    behaviors = [{"behavior": "goal", "goals": ways, "gain": 3.0, "reach": 0.2}, "surface"]
    keys = {"robots": {"positions": [[0.0, 0.5], [0.0, 2.0]]}, "target": {"position": [0, 9]}}
    mission = SteppedMission(api.load_scenario(keys | {"mission": {"behaviors": behaviors}}))
    mission.step(4.0)
    assert mission["goals_left"].tolist() == [0.0, 0.0]
    mission.change({"mission.behaviors[0].goals": [[5.0, 0.0], [[0.0, 3.0], [0.0, 5.0]]]})
    mission.step(4.0)
    np.testing.assert_allclose(mission["q"], [[5.0, 0.0], [0.0, 5.0]], atol=0.01)
    with pytest.raises(UsageError, match="the number of goals entries becomes 0; it is 1"):
        mission.change({"mission.behaviors": ["avoid_obstacles", "surface"]})


def test_what_moves_or_observes_a_target_needs_one() -> None:
    keys = {"target": None, "robots": {"positions": [[1.0, 0.0]]}}
    keys |= {"mission": {"behaviors": [{"behavior": "goal", "goals": [[2.0, 0.0]]}]}}
    controller = Controller(keys)
    at = controller.start
    for act in (
        lambda: controller.reset(target=[0.0, 0.0]),
        lambda: controller(0.0, at, 0.0 * at, target=([0.0, 0.0], [0.0, 0.0])),
        lambda: SteppedMission(api.load_scenario(keys)).move_target([0.0, 0.0]),
        lambda: Simulation(api.load_scenario(keys)),
    ):
        with pytest.raises(UsageError, match="target"):
            act()
    assert controller(0.0, at, 0.0 * at)[0, 0] > 0.0
