"""What motors do to commands: lag, dead zone and gain errors, each against its formula."""

import numpy as np
import pytest

from escort_mj.scenario import parse_scenario, team

ROBOTS = {"positions": [[6.0, 1.0], [-4.0, 4.0]], "force_limit": 6.0}
MISSION = {
    "mission": {"radius": 3.0, "max_speed": 2.0},
    "sensing": {"position": {"noise": 0.02}, "velocity": {"noise": 0.01}},
    "recording": {"rate": 500},
}


@pytest.mark.parametrize("lag", [0.05, 0.2])
def test_a_lagging_motor_follows_a_step(lag: float, drifting, record_steps) -> None:
    """Told its limit from the start, it has (1 - exp(-t / lag)) of it, exactly."""
    world = drifting(
        {"positions": [[0.0, 0.0]], "force_limit": 2.0, "actuators": {"lag": lag}},
        target={"position": [1e4, 0]},
    )
    record = record_steps(world, 600)
    expected = 2.0 * (1.0 - np.exp(-record["time"] / lag))
    np.testing.assert_allclose(record["force"][:, 0, 0], expected, rtol=1e-9, atol=1e-12)
    assert record["tau"][:, 0, 0].min() > 2.0


def test_a_dead_zone_takes_its_part(make_world, record_steps) -> None:
    zone = 0.7
    robots = {**ROBOTS, "overrides": [{"robot": 2, "actuators": {"dead_zone": zone}}]}
    record = record_steps(make_world(robots=robots, **MISSION), 1500)
    tau, force = record["tau"], record["force"]
    np.testing.assert_array_equal(force[:, 0], np.clip(tau[:, 0], -6.0, 6.0))
    left = np.sign(tau[:, 1]) * np.maximum(np.abs(tau[:, 1]) - zone, 0.0)
    np.testing.assert_allclose(force[:, 1], np.clip(left, -6.0, 6.0), rtol=0, atol=1e-12)
    quiet = np.abs(tau[:, 1]) < zone
    assert 0.05 < quiet.mean() < 0.95 and (force[:, 1][quiet] == 0.0).all()


def test_gains_multiply_commands(make_world, record_steps) -> None:
    robots = {**ROBOTS, "overrides": [{"robot": 2, "actuators": {"gains": [0.8, 1.25]}}]}
    record = record_steps(make_world(robots=robots, **MISSION), 1500)
    told = record["tau"] * np.array([[1.0, 1.0], [0.8, 1.25]])
    np.testing.assert_allclose(record["force"], np.clip(told, -6.0, 6.0), rtol=0, atol=1e-12)


def gains_of(text: str) -> np.ndarray:
    return np.array(team(parse_scenario(text, "s")).gains)


def test_gains_are_drawn_for_each_motor_from_the_seed() -> None:
    robots = "robots: {{count: 200, placement: {{within: 90}}, actuators: {{gain_error: 0.2}}}}"
    text = f"seed: {{}}\nmission: {{{{radius: 50}}}}\n{robots}"
    first, again, other = (gains_of(text.format(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all() and len(np.unique(first)) == 400
    assert np.abs(first - 1.0).max() <= 0.2
    assert np.abs(first - 1.0).max() > 0.19 and abs(first.mean() - 1.0) < 0.02


def test_gains_of_a_robot_do_not_depend_on_the_others() -> None:
    text = "seed: 3\nrobots: {{count: 6, force_limit: 30, actuators: {{gain_error: 0.2}}{}}}\naxes: 3"
    plain = team(parse_scenario(text.format(""), "s")).gains
    mixed = team(parse_scenario(text.format(", overrides: [{robot: 2, kind: quadrotor}]"), "s")).gains
    assert [len(gains) for gains in mixed] == [3, 4, 3, 3, 3, 3]
    for robot in (0, 2, 3, 4, 5):
        np.testing.assert_array_equal(plain[robot], mixed[robot])


def test_what_is_not_asked_for_is_not_there(make_world) -> None:
    world = make_world(robots=ROBOTS)
    assert world.model.na == 0 and world.model.nkey == 0
    np.testing.assert_array_equal(world.model.actuator_gainprm[:, 0], 1.0)
