"""Verdicts and values of escort_mj against the independent watcher's."""

import json

import numpy as np
import pytest

from escort_mj.scenario.reader.load import parse_scenario
from tests.independent import motions
from tests.independent.comparison import compare
from tests.independent.drawn import drawn
from tests.independent.flight import fly
from tests.independent.variations import EVERY, GROUPS, Variation
from tests.independent.watcher import clearance, touches, tunneling

CHEAP = {variations[0].name for variations in GROUPS.values()}
DRAWN = 24


@pytest.mark.parametrize(
    "variation",
    [
        pytest.param(one, id=f"{group}: {one.name}", marks=[] if one.name in CHEAP else pytest.mark.slow)
        for group, one in EVERY
    ],
)
def test_verdicts_and_values_are_those_of_the_watcher(variation: Variation) -> None:
    wrong = [row for row in compare(variation) if row.differs]
    assert not wrong, "\n".join(map(str, wrong))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(DRAWN))
def test_so_they_are_in_missions_drawn_at_random(seed: int) -> None:
    wrong = [row for row in compare(drawn(seed)) if row.differs]
    assert not wrong, "\n".join(map(str, wrong))


def test_the_watcher_finds_what_can_be_said_without_it() -> None:
    """A target of radius 0.3 at 1 m/s goes through a ball of radius 0.6."""
    keys = {
        "duration": 10,
        "target": {"position": ["-4+1*t", 0]},
        "robots": {"count": 2, "positions": [[-4, 8], [-4, -8]]},
        "mission": {"radius": 8, "behaviors": ["surface"]},
        "obstacles": [{"position": [2, 0], "radius": 0.6, "name": "rock"}],
    }
    flight = fly(parse_scenario(json.dumps(keys)))
    assert clearance(flight, ("target", "obstacles")) == pytest.approx(-0.9, abs=1e-9)
    assert clearance(flight, ("target", "rock"), 0.0, 5.0) == pytest.approx(0.1, abs=1e-9)
    (touch,) = touches(flight, ("target", "rock"))
    assert touch.depth == pytest.approx(0.9, abs=1e-9)
    assert (touch.last - touch.first + 1) * flight.timestep == pytest.approx(1.8, abs=2 * flight.timestep)
    assert not touches(flight, ("target", "rock"), 0.0, 5.09)
    assert touches(flight, ("target", "rock"), 6.88, 10.0)
    assert not touches(flight, ("target", "rock"), 6.91, 10.0)
    assert tunneling(flight, 9.0)[0] == pytest.approx(2.0 * flight.timestep / 0.4, rel=0.05)


def test_motions_are_evaluated_as_written() -> None:
    t = np.array([0.0, 0.5, 3.0])
    np.testing.assert_allclose(motions.expression("-2**2 + abs(t - 1) * max(t, 1)", t), [-3.0, -3.5, 2.0])
    np.testing.assert_allclose(motions.expression(3, t), [3.0, 3.0, 3.0])
    way = {"waypoints": [{"time": 1, "position": [0, 1]}, {"time": 2, "position": [2, 1]}]}
    np.testing.assert_allclose(motions.positions(way, 2, np.array([0, 1.5, 9])), [[0, 1], [1, 1], [2, 1]])
