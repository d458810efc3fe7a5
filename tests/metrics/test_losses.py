"""Metrics of a team that loses robots: who still counts, and how evenly those that are left stand."""

import math

import numpy as np
import pytest

from escort_mj.measuring import measure
from escort_mj.numerics.thomson import least_energy

TIME = np.linspace(0.0, 10.0, 501)
AFTER = TIME >= 4.0 - 1e-9  # robot 3 is lost
RADIUS = 5.0
POLYGONS = {"least_energy": [least_energy(count, 2) for count in (4, 3)]}


def polygon(count: int) -> np.ndarray:
    angle = 2.0 * np.pi * np.arange(count) / count
    return RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.fixture
def bereaved(make_trace):
    """A square of which robot 3 drifts off, and an even triangle of the others; changes to its signals."""
    q = np.broadcast_to(polygon(4), (501, 4, 2)).copy()
    q[np.ix_(AFTER, [0, 1, 3])] = polygon(3)
    q[AFTER, 2] = [40.0, 7.0]
    lost = np.zeros((501, 4))
    lost[AFTER, 2] = 1.0

    def make(about=POLYGONS, **changes):
        spacing = {"neighbors": [[1, 2], [2, 3], [3, 4], [1, 4]], "spacing": math.sqrt(2.0) * RADIUS}
        return make_trace(TIME, robots=4, about=spacing | about, **{"q": q, "lost": lost, **changes})

    return make


def test_polygons_have_least_energy_in_closed_form() -> None:
    for count in range(2, 17):
        chords = 2.0 * np.sin(np.pi * np.arange(1, count) / count)
        assert least_energy(count, 2) == pytest.approx(0.5 * count * (1.0 / chords).sum())


def test_an_even_team_has_ratio_one_before_and_after(bereaved) -> None:
    assert measure("energy_ratio", bereaved()).value == pytest.approx(1.0, abs=1e-12)


def test_the_worst_moment_of_an_uneven_team(bereaved) -> None:
    trace = bereaved()
    trace["q"].values[400, 1] = RADIUS * np.array([math.cos(1.0), math.sin(1.0)])
    angles = np.array([0.0, 1.0, 4.0 * math.pi / 3.0])
    apart = [2.0 * math.sin(0.5 * abs(a - b)) for a, b in [angles[[0, 1]], angles[[0, 2]], angles[[1, 2]]]]
    found = measure("energy_ratio", trace)
    assert found.value == pytest.approx(sum(1.0 / d for d in apart) / least_energy(3, 2))
    assert found.time == TIME[400]
    assert measure("energy_ratio", trace, before=7.9).value == pytest.approx(1.0)


def test_only_directions_count(bereaved) -> None:
    trace = bereaved()
    trace["q"].values[:] *= np.linspace(0.5, 2.0, 501)[:, None, None]
    assert measure("energy_ratio", trace).value == pytest.approx(1.0, abs=1e-12)


def test_two_robots_in_one_direction_are_infinitely_uneven(bereaved) -> None:
    trace = bereaved()
    trace["q"].values[100, 1] = 2.0 * trace["q"].values[100, 0]
    assert math.isinf(measure("energy_ratio", trace).value)


def test_no_ratio_without_a_least_energy_or_another_robot(bereaved, make_trace) -> None:
    assert "not looked for" in measure("energy_ratio", bereaved(about={})).reason
    lone = make_trace(TIME, about={"least_energy": [0.0]})
    assert measure("energy_ratio", lone).reason == "there is one robot"
    lost = np.stack([AFTER, np.zeros(501)], axis=1)
    pair = make_trace(TIME, robots=2, q=polygon(2), lost=lost, about={"least_energy": [0.5, 0.0]})
    assert measure("energy_ratio", pair).value == pytest.approx(1.0)
    assert measure("energy_ratio", pair, after=5.0).reason == "a single robot is left"


def test_an_error_before_the_loss_counts(bereaved) -> None:
    e = np.zeros((501, 4, 2))
    e[~AFTER, 2] = [0.3, 0.4]
    e[AFTER, 2] = 1e6
    alive = 501 * 4 - AFTER.sum()
    expected = math.sqrt(0.25 * (~AFTER).sum() / alive)
    assert measure("tracking_error_rms", bereaved(e=e)).value == pytest.approx(expected)
    assert measure("velocity_error_rms", bereaved(e_dot=e)).value == pytest.approx(expected)


def test_totals_stop_at_the_loss(bereaved) -> None:
    """Each robot gains 2 a second; the lost one 100 from then on, which is not the team's."""
    total = np.broadcast_to(2.0 * TIME[:, None], (501, 4)).copy()
    total[AFTER, 2] += 100.0 * (TIME[AFTER] - 4.0)
    trace = bereaved(effort=total, force_variation=total, saturated_time=total, work=total)
    assert measure("force_rms", trace).value == pytest.approx(math.sqrt(2.0))
    assert measure("chattering", trace).value == pytest.approx(2.0)
    assert measure("saturated_share", trace).value == pytest.approx(2.0)
    assert measure("energy", trace).value == pytest.approx(2.0 * (3 * 10.0 + 3.98))
    assert measure("energy", trace, after=6.0).value == pytest.approx(2.0 * 3 * 4.0)


def test_neighbors_are_judged_until_the_first_loss(bereaved) -> None:
    trace = bereaved()
    assert measure("spacing_error_max", trace).value < 1e-12
    assert measure("spacing_error_mean", trace).value < 1e-12
    trace["q"].values[50, 3] *= 1.1
    assert measure("spacing_error_max", trace).time == TIME[50]
    for name in ("spacing_error_mean", "spacing_error_max"):
        found = measure(name, trace, after=5.0)
        assert found.value is None and "lost before" in found.reason


def test_what_must_not_be_touched_counts_on(bereaved) -> None:
    near = np.ones((501, 4, 4))
    near[450, [1, 2]] = -0.01
    assert measure("robot_clearance_min", bereaved(clearance=near)).value == -0.01
