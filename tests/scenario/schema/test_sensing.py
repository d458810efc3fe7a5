"""The table `sensing` in the controller's numbers."""

import numpy as np

from escort_mj.scenario import parse_scenario
from escort_mj.scenario.mission import Mission
from escort_mj.sensing.sensors import Sensors, bias_of, steps_late
from escort_mj.sensors import Plain


def sensors_of(text: str, *overrides: str) -> Sensors:
    """What the controller is told."""
    return Mission(parse_scenario(text, "s", overrides)).setup.sensing


def test_nothing_said_is_nothing_wrong() -> None:
    assert sensors_of("{}") == Sensors()


def bias(text: str, channel: int, *overrides: str) -> np.ndarray | None:
    """The constant errors of a channel."""
    setup = Mission(parse_scenario(text, "s", overrides)).setup
    bodies = setup.count if channel < 2 else 1
    return bias_of(setup.sensing.channels[channel], setup.seed, channel, bodies, setup.axes)


def test_delays_become_steps() -> None:
    sensor = "{delay: 0.1, noise: 0.3, dropout: 0.25, resolution: 2}"
    text = f"physics: {{timestep: 0.005}}\nsensing: {{position: {sensor}}}"
    told = sensors_of(text).position
    assert told == Plain(noise=0.3, delay=0.1, dropout=0.25, resolution=2.0)
    assert steps_late(told, 0.005) == 20


def test_a_bias_may_be_given_or_drawn() -> None:
    text = (
        "axes: 3\nsensing: {position: {bias: [1, 2, 3]}, velocity: {bias: 0.5}, target_position: {bias: 0.5}}"
    )
    position, velocity, target_position, target_velocity = (bias(text, channel) for channel in range(4))
    assert target_velocity is None
    np.testing.assert_array_equal(position, np.tile([1.0, 2.0, 3.0], (6, 1)))
    assert velocity.shape == (6, 3) and target_position.shape == (1, 3)
    np.testing.assert_array_equal(velocity, bias(text, 1))
    assert (velocity != bias(text, 1, "seed=1")).all()
    assert (velocity[0] != target_position[0]).all()


def test_drawn_biases_fill_the_ball_and_do_not_depend_on_the_team() -> None:
    text = "robots: {placement: {within: 200}}\nsensing: {position: {bias: 0.5}}"
    many = bias(text, 0, "robots.count=300", "mission.radius=100")
    length = np.linalg.norm(many, axis=1)
    assert 0.48 < length.max() <= 0.5 and np.abs(many.mean(axis=0)).max() < 4.0 * 0.25 / np.sqrt(300)
    np.testing.assert_array_equal(bias(text, 0), many[:5])


def test_sight() -> None:
    told = sensors_of("sensing: {radius: {robots: 7}}")
    assert (told.robots, told.obstacles) == (7.0, np.inf)
