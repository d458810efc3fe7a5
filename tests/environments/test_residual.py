"""Residual commands: velocities added to those of the behaviors, below the outer loop's constraints."""

import numpy as np
import pytest

import escort_mj
from escort_mj import Controller
from escort_mj.environments import Simulation
from escort_mj.errors import UsageError
from escort_mj.record.outcome import Outcome

SHORT = {"duration": 3}
ROCK = {
    "target": {"position": [0, 0]},
    "duration": 12,
    "robots": {"positions": [[3.5, 0]]},
    "obstacles": [{"position": [6, 0], "radius": 0.5}],
    "mission": {
        "outer": "set_based",
        "max_speed": 1,
        "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.4}, "surface"],
    },
}


def flown(scenario: escort_mj.Scenario, command: float) -> escort_mj.Run:
    """The mission with the same command all the time, along x."""
    simulation = Simulation(scenario, command="residual")
    given = np.zeros((simulation.count, simulation.axes))
    given[:, 0] = command
    simulation.reset(command=given)
    while simulation.outcome is Outcome.RUNNING:
        simulation.step(given)
    return simulation.run()


@pytest.mark.parametrize("name", ["main_3d", "patrol", "supervised", "event_triggered"])
def test_without_a_residual_it_is_the_run_of_the_scenario(name: str, compiled: None) -> None:
    scenario = escort_mj.load_scenario(name, SHORT)
    one, other = escort_mj.run(scenario).trace, flown(scenario, 0.0).trace
    for signal in ("q", "v", "v_d", "tau"):
        assert one[signal].values.tobytes() == other[signal].values.tobytes(), signal


def test_it_is_added_to_what_the_behaviors_lead_to(compiled: None) -> None:
    scenario = escort_mj.load_scenario("main_3d", {**SHORT, "mission.max_speed": None})
    one, other = escort_mj.run(scenario).trace, flown(scenario, 0.25).trace
    change = (other["v_d"] - one["v_d"]).values[0]
    np.testing.assert_allclose(change, np.tile([0.25 * 2.0, 0.0, 0.0], (6, 1)), atol=1e-12)


def test_the_outer_loop_keeps_robots_off_obstacles_all_the_same(compiled: None) -> None:
    scenario = escort_mj.Scenario(**ROCK)
    run = flown(scenario, 1.0)
    assert run.trace["q"].values[-1, 0, 0] > 4.5, "the residual pulls it from its radius to the rock"
    assert run.values["contacts"] == 0 and run.values["obstacle_clearance_min"] > 0.39


def test_missions_and_controllers_take_them_too(compiled: None) -> None:
    scenario = escort_mj.Scenario(**{**ROCK, "obstacles": []})
    added = np.array([[0.3, 0.0]])
    asked = []
    for command in (None, added):
        mission = escort_mj.start(scenario, command=None if command is None else "residual")
        controller = Controller(scenario, command=None if command is None else "residual")
        if command is not None:
            mission.command(command)
        controller(0.0, [[3.5, 0.0]], [[0.0, 0.0]], commanded=command)
        asked.append((mission.step(0.002)["v_d"], controller.velocity))
    np.testing.assert_allclose(asked[1][0] - asked[0][0], added, atol=1e-4)
    np.testing.assert_allclose(asked[1][1] - asked[0][1], added, atol=1e-12)


def test_an_outer_loop_that_composes_nothing_refuses_them() -> None:
    with pytest.raises(UsageError, match="command: found residual; the outer loop potential_field"):
        Simulation(escort_mj.load_scenario("main", {"mission.outer": "potential_field"}), command="residual")
