"""Detours: when they begin, turn around and end, and the direction that follows a boundary."""

import math

import numpy as np
import pytest

from escort_mj.api import load_scenario, run
from escort_mj.control.outer_loops.detour import Detour, next_detour
from tests.oracle.set_based import boundary, turned

NONE = Detour(0.0, 0.0, 0.0, 0.0)


def after(before: Detour, moved=True, share=0.0, advance=0.0, near=True, elapsed=1.0) -> Detour:
    return next_detour(before, elapsed, moved, share, advance, near, 1.5, 10.0)


def test_a_robot_is_patient_before_it_follows_a_boundary():
    once = after(NONE)
    assert once == Detour(0.0, 1.0, 0.0, 0.0)
    assert after(once) == Detour(1.0, 0.0, 0.0, 10.0)
    assert after(once, share=0.3) == after(once, moved=False) == NONE, "it gets on"


def test_a_detour_ends_where_the_way_is_free_and_further_than_it_began():
    before = Detour(1.0, 3.0, -0.5, 10.0)
    assert after(before, share=1.0, advance=0.4).side == 1.0, "not yet further"
    assert after(before, share=0.5, advance=0.6).side == 1.0, "not free"
    assert after(before, share=1.0, advance=0.6).side == 0.0
    assert after(before, near=False).side == 0.0, "nothing left to follow"


def test_a_detour_around_teammates_alone_ends_anywhere():
    before = Detour(0.0, 1.0, 0.0, 0.0)
    around = after(before, near=0.5)
    assert around.side == 1.0
    around = after(around, near=0.5, advance=-3.0)
    assert after(around, near=0.5, share=1.0).side == 0.0
    wall = after(around, near=1.0, advance=-3.0, share=1.0)
    assert wall.side == 1.0 and after(wall, near=0.5, share=1.0).side == 1.0, "a wall may lead it back"
    turned_back = after(around._replace(held=10.0), near=0.5)
    assert turned_back.side == -1.0 and after(turned_back, near=0.5, share=1.0).side == 0.0


def test_it_turns_around_after_times_that_double():
    before, turns = Detour(1.0, 0.0, 0.0, 10.0), []
    for second in range(75):
        now = after(before, advance=-0.1)
        if now.side != before.side:
            turns.append(second)
        before = now
    assert np.diff([-1, *turns]).tolist() == [11, 21, 41]
    left = after(before._replace(progress=1.0), share=1.0)
    assert left.side == 0.0 and left.limit == 80.0
    assert after(Detour(0.0, 1.0, 0.0, left.limit)).limit == 80.0, "the next one goes as far"


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("bound", [-0.3, 0.0, 0.2])
def test_the_boundary_of_one_body_is_followed_along_its_condition(side: float, bound: float):
    """The first free direction: r . v = b at the wanted speed, on the side that was asked for."""
    r = np.array([math.cos(0.7), math.sin(0.7)])
    v = boundary(side, 1.0, r[None], np.array([bound]), np.zeros(1))
    assert np.linalg.norm(v) == pytest.approx(1.0)
    assert r @ v == pytest.approx(bound, abs=1e-8)
    assert np.sign(turned(r) @ v) == side


def test_a_corner_is_left_and_a_narrow_gap_slows_down():
    corner = np.array([[-1.0, 0.0], [0.0, 1.0]])  # a wall ahead, one below
    v = boundary(-1.0, 1.0, corner, np.array([0.0, -0.1]), np.zeros(2))
    assert v == pytest.approx([0.0, 1.0], abs=1e-8)
    closed = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    assert boundary(1.0, 1.0, closed, np.full(4, -0.17), np.zeros(4)) == pytest.approx([0.0, 0.0])
    v = boundary(1.0, 1.0, closed, np.full(4, -0.45), np.zeros(4))
    assert np.linalg.norm(v) == pytest.approx(0.5) and np.abs(v).max() <= 0.45 + 1e-9


@pytest.mark.parametrize("axes", [2, 3, 4, 5])
def test_across_is_a_unit_vector_across(axes: int):
    for r in [*np.eye(axes), *np.random.default_rng(axes).normal(size=(20, axes))]:
        r = r / np.linalg.norm(r)
        assert np.linalg.norm(turned(r)) == pytest.approx(1.0)
        assert r @ turned(r) == pytest.approx(0.0, abs=1e-12)


def test_without_patience_a_robot_waits_in_the_dead_end(compiled):
    scenario = load_scenario("goals/dead_end", {"duration": 30.0, "expect": []})
    waiting = run(scenario.replace({"mission.outer": "set_based"}))
    assert waiting.metrics["arrived"]["value"] == 0.0
    assert waiting.trace["q"].values[-1, :, 0].max() < 2.0
