"""What a mission's expectations come to, by their documented meaning, from the flight that was recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from escort_mj.expectations.clearance import ClearanceExpectation
from escort_mj.expectations.contacts import ContactExpectation
from escort_mj.expectations.expectation import Expectation
from escort_mj.expectations.metric import MetricExpectation
from escort_mj.expectations.sanity import SanityExpectation
from tests.independent.flight import BARELY, Flight, Touch

CLEARANCES = {
    "robot_clearance_min": [("robots", "robots")],
    "obstacle_clearance_min": [("robots", "obstacles"), ("robots", "walls")],
}


@dataclass(frozen=True)
class Judgment:
    """Whether an expectation held; None where the documented meaning leaves it open.

    Attributes:
        held: Whether it held.
        value: The value that decides it; None where none does.
        most: What the value may be at most; None: the value itself.
    """

    held: bool | None
    value: float | None
    most: float | None = None


def judge(flight: Flight, expectation: Expectation) -> Judgment:
    """Judge one expectation of a flight."""
    window = expectation.after, expectation.before
    if isinstance(expectation, ClearanceExpectation):
        least = clearance(flight, expectation.clearance, *window)
        return Judgment(least >= expectation.at_least, least)
    if isinstance(expectation, ContactExpectation):
        return _touches(flight, expectation)
    if isinstance(expectation, SanityExpectation):
        return Judgment(_at_most(1.0, *tunneling(flight, *window)), None)
    assert isinstance(expectation, MetricExpectation)
    if expectation.metric == "tunneling":
        assert expectation.at_most is not None
        least, most = tunneling(flight, *window)
        return Judgment(_at_most(expectation.at_most, least, most), least, most)
    value = metric(flight, expectation.metric, *window)
    above = expectation.at_least is None or value >= expectation.at_least
    return Judgment(above and (expectation.at_most is None or value <= expectation.at_most), value)


def _at_most(bound: float, least: float, most: float) -> bool | None:
    """Whether a value between two others is below a bound; None where it may be or not."""
    return True if most <= bound else False if least > bound else None


def metric(flight: Flight, name: str, after: float = 0.0, before: float | None = None) -> float:
    """Return a metric in a window, in its unit."""
    if name == "contacts":
        return float(len(touches(flight, "any", after, before)))
    return min(clearance(flight, sides, after, before) for sides in CLEARANCES[name])


def clearance(flight: Flight, sides: Any, after: float = 0.0, before: float | None = None) -> float:
    """Return the least distance of two sides in a window, surface to surface [m]; infinite for none."""
    inside = flight.steps(after, before)
    found = (flight.distance(pair)[inside].min() for pair in flight.pairs(sides))
    return float(min(found, default=math.inf))


def tunneling(flight: Flight, after: float = 0.0, before: float | None = None) -> tuple[float, float]:
    """Return the most that two bodies can close in a step of a window, over the smallest thickness.

    Returns:
        What they close in one and the same step; and a bound on what they can, as if the fastest steps of
        both bodies, those on the edges included, were one.
    """
    inside = flight.steps(after, before)
    within, touching = flight.moved[inside[1:] & inside[:-1]], flight.moved[inside[1:] | inside[:-1]]
    return (
        float(np.sort(within, axis=1)[:, -2:].sum(axis=1).max()),
        float(np.sort(touching.max(axis=0))[-2:].sum()),
    )


def touches(flight: Flight, sides: Any, after: float = 0.0, before: float | None = None) -> list[Touch]:
    """Return the touches of two sides that have a physics step in a window."""
    wanted, watched = set(flight.pairs(sides)), flight.steps(after, before)
    return [
        touch
        for touch in flight.touches
        if touch.pair in wanted and watched[touch.first : touch.last + 1].any()
    ]


def inside(flight: Flight, touch: Touch, after: float = 0.0, before: float | None = None) -> float:
    """Return how long a touch lasts inside a window [s]; a step lasts from its time to the next one's."""
    start, end = touch.first * flight.timestep, (touch.last + 1) * flight.timestep
    return max(min(end, math.inf if before is None else before) - max(start, after), 0.0)


def _touches(flight: Flight, expectation: ContactExpectation) -> Judgment:
    window = expectation.after, expectation.before
    found = touches(flight, expectation.contacts, *window)
    most, held = expectation.at_most, True
    bounds = expectation.touch_time, expectation.penetration, expectation.at_least
    if most is None and all(bound is None for bound in bounds):
        most = 0
    value: float | None = None
    if most is not None:
        value, held = float(len(found)), held and len(found) <= most
    if expectation.at_least is not None:
        value, held = float(len(found)), held and len(found) >= expectation.at_least
    if expectation.touch_time is not None:
        value = max((inside(flight, touch, *window) for touch in found), default=0.0)
        held = held and value <= expectation.touch_time + BARELY
    if expectation.penetration is not None:
        value = max((touch.depth for touch in found), default=0.0)
        held = held and value <= expectation.penetration
    return Judgment(held, value)
