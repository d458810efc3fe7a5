"""Drag in a current: at rest, adrift, as it turns, and beside the drag that a robot's model has."""

from typing import Any

import numpy as np
import pytest

from escort_mj.conformance.stand import Stand
from escort_mj.disturbances.current import Current
from escort_mj.scenario.schema.scenario import Scenario

SURGE = 0.72253, 1.32742  # -X_u and -X_|u|u of CyberShip II


def forces(velocity: Any, time: float = 0.0, **keys: Any) -> Any:
    velocity = np.array(velocity, dtype=float)
    stand = Stand(Current(**keys), Scenario, *velocity.shape)
    stand.state.v[:], stand.state.time[0] = velocity, time
    stand.call()
    return stand.state.disturbance_force.copy()


def drag(velocity: float) -> float:
    return SURGE[0] * velocity + SURGE[1] * abs(velocity) * velocity


def test_at_rest_and_adrift_it_is_that_of_the_model_ship() -> None:
    found = forces([[0.0, 0.0], [0.3, 0.0], [0.5, 0.0], [-0.2, 0.0]], speed=0.3)
    np.testing.assert_allclose(found[:, 0], [drag(0.3), 0.0, -drag(0.2), drag(0.5)], rtol=1e-12, atol=1e-15)
    assert np.abs(found[:, 1]).max() == 0.0


def test_it_turns_with_time() -> None:
    found = forces([[0.0, 0.0, 0.0]], time=10.0, speed=0.2, heading=0.3, turn_rate=-0.05)
    expected = drag(0.2) * np.array([[np.cos(-0.2), np.sin(-0.2), 0.0]])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("speed", [0.0, 0.4])
def test_where_the_model_has_the_drag_in_still_water_only_the_difference_acts(speed: float) -> None:
    velocity = [[0.3, -0.1], [0.0, 0.0]]
    whole, still = forces(velocity, speed=speed), forces(velocity, speed=0.0)
    found = forces(velocity, speed=speed, still_water=False)
    np.testing.assert_allclose(found, whole - still, rtol=1e-12, atol=1e-15)
