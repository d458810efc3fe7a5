"""Bounds on a metric over a part of the run that is named, not timed."""

import pytest

from escort_mj.expect.verdicts import judge_one
from escort_mj.expectations.metric import MetricExpectation
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import parse_scenario
from escort_mj.scenario.geometry.steps import schedule_of
from tests.metrics.motions import RADIUS, TIME, ring, steps


def bound(**keys) -> MetricExpectation:
    return MetricExpectation(metric="radius_error_max", at_most=0.5, **keys)


@pytest.fixture
def trace(make_trace):
    """Off by 1.1 m until 7.99 s, by 0.1 m from then on, of 10 s."""
    return make_trace(TIME, q=ring(1, RADIUS + (steps(TIME, 7.99, -1.0) + 1.1)[:, None]))


@pytest.mark.parametrize(
    ("keys", "held", "value", "demanded"),
    [
        ({}, False, 1.1, "at most 0.5 m"),
        ({"over": "whole"}, False, 1.1, "at most 0.5 m over the whole run"),
        ({"over": "tail"}, True, 0.1, "at most 0.5 m over the last fifth"),
        ({"after": 8.0}, True, 0.1, "at most 0.5 m after 8 s"),
        ({"after": 7.0}, False, 1.1, "at most 0.5 m after 7 s"),
    ],
)
def test_a_bound_says_over_which_part_of_the_run_it_holds(trace, keys, held, value, demanded):
    found = judge_one(bound(**keys), trace, Outcome.COMPLETED)
    assert (found.held, found.demanded) == (held, demanded) and found.value == pytest.approx(value)


def test_a_run_that_broke_off_has_no_tail(trace):
    found = judge_one(bound(over="tail"), trace, Outcome.DIVERGED)
    assert not found.held and "broke off at 10 s, and has no tail" in found.message
    assert found.value is found.time is None and found.bodies == ()


def test_the_tail_begins_at_a_sample():
    bounded = "{metric: robot_clearance_min, at_least: 0, over: tail}"
    scenario = parse_scenario(f"duration: 10.01\nrecording: {{rate: 1}}\nexpect: [{bounded}]")
    assert {4003, 4004} <= set(schedule_of(scenario).extra)  # 8.008 s, and the step before
