"""Downwash: the published formula, who feels it, and a mission with and without it."""

from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.conformance.stand import Stand
from escort_mj.disturbances.downwash import Downwash
from escort_mj.mission.batch import fly_many
from escort_mj.scenario.schema.scenario import Scenario


def pushes(places: Any, **keys: Any) -> Any:
    """Forces along the last axis [N]; there are no others."""
    places = np.array(places, dtype=float)
    stand = Stand(Downwash(**keys), Scenario, *places.shape)
    stand.state.q[:] = places
    stand.call()
    assert np.abs(stand.state.disturbance_force[:, :-1]).max() == 0.0
    return stand.state.disturbance_force[:, -1].copy()


def published(below: float, aside: float) -> float:
    """Force on a drone, as gym-pybullet-drones computes it for a Crazyflie 2.x."""
    alpha = 2267.18 * (2.31348e-2 / (4.0 * below)) ** 2
    beta = 0.16 * below - 0.11
    return -alpha * float(np.exp(-0.5 * (aside / beta) ** 2))


@pytest.mark.parametrize(("below", "aside"), [(0.5, 0.0), (0.5, 0.02), (1.0, 0.05), (2.0, 0.3), (5.0, 9.0)])
def test_the_force_is_the_published_one(below: float, aside: float) -> None:
    found = pushes([[0.0, 0.0, below], [0.6 * aside, 0.8 * aside, 0.0]])
    assert found[0] == 0.0
    assert found[1] == pytest.approx(published(below, aside), rel=1e-9, abs=1e-300)


def test_half_a_meter_below_a_crazyflie_it_is_more_than_the_weight_of_one() -> None:
    assert pushes([[0.0, 0.0, 0.5], [0.0, 0.0, 0.0]])[1] == pytest.approx(-0.30336, rel=1e-4)


def test_it_adds_up_and_ends_at_its_limits() -> None:
    places = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 10.1, 5.0], [0.0, 0.0, 0.0]]
    found = pushes(places)
    assert found[0] == found[4] == pytest.approx(published(1.0, 0.0) + published(2.0, 0.0))
    assert found[2] == found[3] == 0.0
    near = pushes([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]], nearest=0.4)
    assert near[0] == pytest.approx(published(0.4, 0.0))


def test_those_who_fly_below_sag_and_without_it_do_not(compiled: None) -> None:
    keys = {"expect": [], "sensing": {}, "duration": 6}
    heights = []
    for strength in (2267.18, 0.0):
        change = {"uncertainty.disturbances": [{"disturbance": "downwash", "strength": strength}]}
        (flight,) = fly_many([escort_mj.load_scenario("worlds/downwash", keys | change)], 1, traces=True)
        assert flight.outcome.good, flight.message
        heights.append(flight.trace["q"].values[..., 2])
    sag = (heights[1] - heights[0]).max(axis=0)
    below = heights[1][0] < heights[1][0].mean()
    assert sag[below].min() > 0.01 > 10.0 * np.abs(sag[~below]).max()
