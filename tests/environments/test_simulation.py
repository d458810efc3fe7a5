"""Commands from outside meet the same plant: what the outer loop would say gives the same bits."""

import subprocess
import sys

import numpy as np
import pytest

from escort_mj.api import fly, load_scenario
from escort_mj.environments import Reward, Simulation
from escort_mj.errors import UsageError
from escort_mj.record.outcome import Outcome

EVERY_STEP = {"duration": 1.0, "expect": [], "recording.rate": 500.0}


@pytest.mark.parametrize("name", ["main", "paper/case1_3d"])
def test_told_what_the_outer_loop_says_the_run_is_the_same(name: str) -> None:
    scenario = load_scenario(name, EVERY_STEP | {"mission.max_speed": 8.0})
    ours = fly(scenario).trace
    simulation = Simulation(scenario)
    told = ours["v_d"].values / 8.0
    assert np.abs(told).max() <= 1.0
    simulation.reset(command=told[0])
    for command in told[1:]:
        simulation.step(command)
    run = simulation.run()
    assert run.outcome is Outcome.COMPLETED
    for signal in ("q", "v", "tau", "force", "q_d", "rho_hat", "clearance"):
        np.testing.assert_array_equal(run.trace[signal].values, ours[signal].values)


def test_commands_keep_their_length_where_windows_begin_and_the_last_goes_to_the_end() -> None:
    window = {"clearance": ["robots", "robots"], "at_least": 0.0, "after": 0.031, "before": 0.05}
    scenario = load_scenario("main", {"duration": 0.107, "expect": [window], "mission.max_speed": 8.0})
    simulation = Simulation(scenario)
    simulation.reset()
    times = [simulation.time]
    while simulation.outcome is Outcome.RUNNING:
        simulation.step(np.zeros((5, 2)))
        times.append(simulation.time)
    assert times == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.106])
    run = simulation.run()
    assert run.message == "completed 0.106 s" and run.passed
    assert run.trace["time"].values == pytest.approx(sorted([*times, 0.03, 0.032, 0.05]))


def test_forces_reach_the_motors_as_told() -> None:
    scenario = load_scenario("paper/case1_2d", {"duration": 0.4, "expect": [], "uncertainty": {}})
    simulation = Simulation(scenario, "force")
    simulation.reset()
    start = simulation.plant.state.q.copy()
    push = np.zeros((5, 2))
    push[:, 0] = 0.5
    while simulation.outcome is Outcome.RUNNING:
        simulation.step(push)
    seconds, limit = simulation.time - 0.002, simulation.world.setup.force_limit[0]
    gone = simulation.plant.state.q - start
    half = 0.5 * 0.5 * limit / simulation.world.team.mass[:, None] * seconds**2
    np.testing.assert_allclose(gone[:, :1], half, rtol=0.02)
    assert not gone[:, 1].any()


def test_the_same_seed_is_the_same_mission() -> None:
    simulation = Simulation(load_scenario("main", {"duration": 2.0, "expect": []}))
    dice = np.random.default_rng(0)
    commands = dice.uniform(-1.0, 1.0, (10, 5, 2))

    def observed(seed: int) -> list[np.ndarray]:
        simulation.reset(seed)
        found = [simulation.observe()]
        for command in commands:
            simulation.step(command)
            found.append(simulation.observe())
        return found

    first, again, other = observed(3), observed(3), observed(4)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_rewards_say_what_is_asked() -> None:
    scenario = load_scenario("main", {"duration": 2.0, "expect": [], "sensing": {}})
    only_radius = Simulation(scenario, reward=Reward(spacing=0.0, command=0.0, clearance=0.0, touch=0.0))
    only_radius.reset()
    rewards = only_radius.step(np.zeros((5, 2)))
    state = only_radius.plant.state
    distance = np.linalg.norm(state.q - state.target_position, axis=1)
    np.testing.assert_allclose(rewards, -np.abs(distance - 3.0) / 3.0)
    only_command = Simulation(
        scenario, reward=Reward(radius=0.0, spacing=0.0, command=2.0, clearance=0.0, touch=0.0)
    )
    only_command.reset()
    np.testing.assert_allclose(only_command.step(np.full((5, 2), 0.5)), -0.5)
    near = load_scenario("main", {"duration": 2.0, "expect": [], "mission.behaviors[0].safe_distance": 4.0})
    only_clearance = Simulation(near, reward=Reward(0.0, 0.0, command=0.0, touch=0.0))
    only_clearance.reset()
    rewards = only_clearance.step(np.zeros((5, 2)))
    least = only_clearance.plant.state.clearance.min(axis=1)
    np.testing.assert_allclose(rewards, np.minimum(least / 4.0 - 1.0, 0.0))
    assert (rewards < 0.0).any()


def test_observations_are_what_sensors_and_geometry_say() -> None:
    scenario = load_scenario("main", {"duration": 2.0, "expect": [], "sensing": {}})
    simulation = Simulation(scenario)
    simulation.reset()
    state = simulation.plant.state
    seen = simulation.observe().reshape(5, -1, 2)
    np.testing.assert_allclose(state.q + 3.0 * seen[:, 0], np.tile(state.target_position, (5, 1)), atol=1e-12)
    np.testing.assert_allclose(seen[:, 2] * 2.0, state.v)
    gap = np.linalg.norm(state.q[:, None] - state.obstacle_position, axis=2)
    gap -= simulation.world.setup.obstacle_radius + simulation.world.setup.robot_radius[:, None]
    np.testing.assert_allclose(np.linalg.norm(seen[:, 3], axis=1) * 3.0, gap.min(axis=1))
    lengths = np.linalg.norm(seen[:, 4:], axis=2)
    assert (np.diff(lengths, axis=1) >= 0.0).all()
    apart = np.linalg.norm(state.q[:, None] - state.q, axis=2)
    np.testing.assert_allclose(np.sort(apart, axis=1)[:, 1:] / 3.0, lengths)


def test_a_robot_that_is_driven_into_the_target_touches_it() -> None:
    scenario = load_scenario(
        "paper/case1_2d",
        {"duration": 9.0, "expect": [{"metric": "contacts", "at_most": 0}], "mission.max_speed": 3.0},
    )
    simulation = Simulation(scenario)
    simulation.reset()
    touched = np.zeros(5, dtype=bool)
    while simulation.outcome is Outcome.RUNNING:
        simulation.step(simulation.observe()[:, :2] * 10.0)
        touched |= simulation.touching
    assert touched.any()
    run = simulation.run()
    assert not run.passed and run.values["contacts"]


def test_what_cannot_be() -> None:
    simulation = Simulation(load_scenario("main", {"duration": 0.1, "expect": []}))
    with pytest.raises(UsageError, match="call reset"):
        simulation.step(np.zeros((5, 2)))
    simulation.reset()
    run = simulation.run()
    assert run.outcome is Outcome.INTERRUPTED and run.message == "judged before its end, at 0.00 s"
    assert run.verdicts[0].message.endswith("interrupted, the run was stopped before its end")
    while simulation.outcome is Outcome.RUNNING:
        simulation.step(np.zeros((5, 2)))
    with pytest.raises(UsageError, match="call reset"):
        simulation.step(np.zeros((5, 2)))
    with pytest.raises(UsageError, match="force_limit"):
        Simulation(load_scenario("main", {"robots.force_limit": None}), "force")


INTERRUPTED = """
import signal
from escort_mj.native import artifacts
from escort_mj.api import load_scenario
from escort_mj.environments import Simulation
signal.signal(signal.SIGINT, signal.default_int_handler)  # who was started in the background ignores it
simulation = Simulation(load_scenario("main", {"duration": 1.0, "expect": []}))
simulation.reset()
address = artifacts.address
def slow(piece):
    artifacts.address = address
    signal.raise_signal(signal.SIGINT)
    return address(piece)
artifacts.address = slow
from escort_mj.native import on_demand
for entry in on_demand.entries.values():
    entry.slot.value = None
try:
    while True:
        simulation.step([[0.0, 0.0]] * 5)
except KeyboardInterrupt:
    print("interrupted", simulation.time > 0.0, flush=True)
simulation.step([[0.0, 0.0]] * 5)
print("goes on", simulation.outcome.value)
"""


def test_an_interrupt_while_a_kernel_is_fetched_waits_for_the_end_of_the_step() -> None:
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["interrupted True", "goes on running"]
    assert "Exception" not in done.stderr
