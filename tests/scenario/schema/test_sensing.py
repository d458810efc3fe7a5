"""The table `sensing` in the controller's numbers."""

import numpy as np

from escort_mj.scenario import parse_scenario
from escort_mj.scenario.mission import Mission
from escort_mj.sensing.sensors import Channel, Sensors


def sensors_of(text: str, *overrides: str) -> Sensors:
    """What the controller is told."""
    return Mission(parse_scenario(text, "s", overrides)).setup.sensing


def test_nothing_said_is_nothing_wrong() -> None:
    assert sensors_of("{}") == Sensors()


def test_delays_become_steps() -> None:
    sensor = "{delay: 0.1, noise: 0.3, dropout: 0.25, resolution: 2}"
    text = f"physics: {{timestep: 0.005}}\nsensing: {{position: {sensor}}}"
    assert sensors_of(text).position == Channel(0.3, None, 20, 0.25, 2.0)


def test_a_bias_may_be_given_or_drawn() -> None:
    text = (
        "axes: 3\nsensing: {position: {bias: [1, 2, 3]}, velocity: {bias: 0.5}, target_position: {bias: 0.5}}"
    )
    told = sensors_of(text)
    assert told.target_velocity.bias is None
    np.testing.assert_array_equal(told.position.bias, np.tile([1.0, 2.0, 3.0], (6, 1)))
    assert told.velocity.bias.shape == (6, 3) and told.target_position.bias.shape == (1, 3)
    again, other = sensors_of(text), sensors_of(text, "seed=1")
    np.testing.assert_array_equal(told.velocity.bias, again.velocity.bias)
    assert (told.velocity.bias != other.velocity.bias).all()
    assert (told.velocity.bias[0] != told.target_position.bias[0]).all()


def test_drawn_biases_fill_the_ball_and_do_not_depend_on_the_team() -> None:
    text = "robots: {placement: {within: 200}}\nsensing: {position: {bias: 0.5}}"
    many = sensors_of(text, "robots.count=300", "mission.radius=100").position.bias
    length = np.linalg.norm(many, axis=1)
    assert 0.48 < length.max() <= 0.5 and np.abs(many.mean(axis=0)).max() < 4.0 * 0.25 / np.sqrt(300)
    np.testing.assert_array_equal(sensors_of(text).position.bias, many[:5])


def test_sight() -> None:
    told = sensors_of("sensing: {radius: {robots: 7}}")
    assert (told.robots, told.obstacles) == (7.0, np.inf)
