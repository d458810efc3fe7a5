"""What a trace says to each kind of expectation: one function per kind."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.control.custom.place import place_of
from escort_mj.expect.sanity import sanity
from escort_mj.expect.touches import least_clearance, touches, unseen_by_mujoco
from escort_mj.measuring import measure
from escort_mj.metrics.contacts import FORCELESS, contacts_untold
from escort_mj.metrics.metric import Bodies, Measure, in_words
from escort_mj.metrics.radius_error import radius_error
from escort_mj.record.episodes import by_geometry, pair
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import sealed
from escort_mj.record.window import window
from escort_mj.scenario.schema.expectations import (
    ClearanceExpectation,
    ContactExpectation,
    Expectation,
    Judgment,
    MetricExpectation,
    OutcomeExpectation,
    OwnExpectation,
    SanityExpectation,
    SettledExpectation,
)

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

NEAR = 0.05  # a margin below this share of the bound is a near miss
NO_SAMPLE = "the run has no sample in the window"


@dataclass(frozen=True)
class Found:
    """What there is to say of one expectation.

    Attributes:
        subject: What was looked at.
        demanded: The bound and its window in words.
        held: Whether what was demanded held.
        words: What was found, in words.
        value: Worst value; None where there was none.
        unit: Its unit, empty for none.
        time: When it was found [s].
        bodies: Names of the bodies that had it.
        margin: Distance from the bound, negative beyond it.
        near_miss: It held, but barely.
        broken: A plugin raised an error instead.
    """

    subject: str
    demanded: str
    held: bool
    words: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    bodies: Bodies = ()
    margin: float | None = None
    near_miss: bool = False
    broken: bool = False

    @property
    def who(self) -> str:
        """The bodies in words."""
        return in_words(self.bodies)


@dataclass(frozen=True)
class Bound:
    """One side of what a value may be.

    Attributes:
        value: The bound.
        upper: Whether values must not be above it, or not below it.
        least: No value is below this.
    """

    value: float
    upper: bool = True
    least: float = 0.0

    def margin(self, value: float) -> float:
        """Distance of a value from the bound, negative beyond it."""
        return self.value - value if self.upper else value - self.value

    def is_near(self, margin: float) -> bool:
        """Whether a margin is a near miss; a bound of zero has none."""
        return 0.0 <= margin < NEAR * abs(self.value - self.least)

    def words(self, unit: str) -> str:
        """As `at most 3 m`."""
        return f"at {'most' if self.upper else 'least'} {self.value:g}{unit and ' ' + unit}"


def judged(expectation: Expectation, trace: Recorded, outcome: Outcome) -> Found:
    """What there is to say of one expectation.

    Args:
        expectation: What is expected.
        trace: The whole trace.
        outcome: How the run ended.
    """
    if isinstance(expectation, MetricExpectation):
        return _metric(expectation, trace)
    if isinstance(expectation, ContactExpectation):
        return _contacts(expectation, trace)
    if isinstance(expectation, ClearanceExpectation):
        return _clearance(expectation, trace)
    if isinstance(expectation, SettledExpectation):
        return _settled(expectation, trace)
    if isinstance(expectation, SanityExpectation):
        return _sanity(expectation, trace, outcome)
    if isinstance(expectation, OwnExpectation):
        return _own(expectation, trace)
    assert isinstance(expectation, OutcomeExpectation), "of other kinds there are none"
    held = outcome.value == expectation.outcome
    words = outcome.value if outcome.good else f"{outcome.value}, {outcome.meaning}"
    time = float(trace["time"][-1]) if trace.sizes["time"] and not outcome.good else None
    return Found("outcome", expectation.outcome, held, words, time=time)


def _own(expectation: OwnExpectation, trace: Recorded) -> Found:
    """What a plugin's expectation says; an error that it raises is no verdict, and is told as such."""
    part, demanded = window(trace, *expectation.window), expectation.kind
    if not part.sizes["time"]:
        return Found(expectation.subject, demanded, False, NO_SAMPLE)
    try:
        demanded = expectation.demanded + _when(expectation.window)
        said = expectation.judge(sealed(part))
        if not isinstance(said, Judgment):
            raise TypeError(f"judge returned {type(said).__name__}; expected a Judgment")
    except Exception as error:
        words = place_of(error, type(expectation).judge)
        return Found(expectation.subject, demanded, False, words, broken=True)
    return Found(
        expectation.subject, demanded, bool(said.held), said.words, said.value, said.unit, said.time,
        said.bodies, said.margin,
    )  # fmt: skip


def _metric(expectation: MetricExpectation, trace: Recorded) -> Found:
    """A bound on a metric."""
    name, low, high = expectation.metric, expectation.at_least, expectation.at_most
    metric = expectation.definition
    unit = "" if metric.unit == "1" else metric.unit
    least = metric.least if math.isfinite(metric.least) else 0.0
    bounds = [] if low is None else [Bound(low, False, least)]
    bounds += [] if high is None else [Bound(high, True, least)]
    demanded = " and ".join(bound.words("") for bound in bounds) + (unit and f" {unit}")
    found = measure(metric, trace, *expectation.window)
    return _held_against(name, demanded + _when(expectation.window), found, unit, bounds)


def _clearance(expectation: ClearanceExpectation, trace: Recorded) -> Found:
    """The least distance between two sides."""
    part, bound = window(trace, *expectation.window), Bound(expectation.at_least, upper=False)
    demanded = bound.words("m") + _when(expectation.window)
    sampled = part.sizes["time"] > 0
    found = least_clearance(part, expectation.clearance) if sampled else Measure(None, reason=NO_SAMPLE)
    return _held_against(expectation.subject, demanded, found, "m", [bound])


def _settled(expectation: SettledExpectation, trace: Recorded) -> Found:
    """Every robot at the mission's radius, by some time."""
    bound, (by, before) = Bound(expectation.settled), expectation.window
    demanded = f"within {bound.value:g} m by {by:g} s{_when((0.0, before))}"
    found = _held_against(
        expectation.subject, demanded, measure("radius_error_max", trace, by, before), "m", [bound]
    )
    if found.value is None:
        return found
    part = window(trace, 0.0, before)
    far = np.flatnonzero((np.abs(radius_error(part)) > bound.value).any(axis=1))
    if not len(far):
        since = ", from the start"
    elif far[-1] + 1 < part.sizes["time"]:
        since = f", from {float(part['time'][far[-1] + 1]):.2f} s on"
    else:
        since = ", not settled at the end"
    return replace(found, words=found.words + since)


def _held_against(subject: str, demanded: str, found: Measure, unit: str, bounds: list[Bound]) -> Found:
    """A value against its bounds, of which the one with the least margin counts."""
    if found.value is None:
        return Found(subject, demanded, False, found.reason, unit=unit)
    margin, bound = min(((one.margin(found.value), one) for one in bounds), key=lambda pair: pair[0])
    near = bound.is_near(margin)
    words = f"{_number(found.value, unit)}{_circumstances(found)}{', a near miss' if near else ''}"
    return Found(
        subject, demanded, margin >= 0.0, words, found.value, unit, found.time, found.bodies, margin, near
    )


def _number(value: float, unit: str) -> str:
    """A value as text."""
    if math.isinf(value):
        return "never" if unit == "s" else "nothing near"
    return f"{value:.4g}{unit and ' ' + unit}"


def _circumstances(found: Measure) -> str:
    """Who and when, where known."""
    words = f" ({found.who}" if found.bodies else ""
    if found.time is not None:
        words += f"{' at' if words else ' (at'} {found.time:.2f} s"
    return f"{words})" if words else ""


def _when(limits: tuple[float, float | None]) -> str:
    """A window in words."""
    after, before = limits
    return (f" after {after:g} s" if after > 0.0 else "") + (
        "" if before is None else f" before {before:g} s"
    )


def _sanity(expectation: SanityExpectation, trace: Recorded, outcome: Outcome) -> Found:
    """Whether the simulation can be trusted."""
    part = window(trace, *expectation.window)
    demanded = ", ".join(expectation.sanity) + _when(expectation.window)
    if not part.sizes["time"]:
        return Found("sanity", demanded, False, NO_SAMPLE)
    reports = [sanity(check, part, outcome) for check in expectation.sanity]
    wrong = [report for report in reports if not report.held]
    worst = min(wrong or reports, key=lambda report: report.room)
    words = "; ".join(report.words for report in wrong or reports)
    return Found(
        "sanity", demanded, not wrong, words, worst.value, worst.unit, worst.time, worst.bodies, worst.margin
    )


QUANTITIES = {
    "at_most": ("", ""),
    "touch_time": ("episode_touch_time", "s"),
    "peak_force": ("episode_peak_force", "N"),
    "impulse": ("episode_impulse", "N s"),
    "penetration": ("episode_depth", "m"),
}
"""Variable and unit of what a bound on touches is about; of `at_most`, their number."""


def _contacts(expectation: ContactExpectation, trace: Recorded) -> Found:
    """Bounds on touches between two sides; of several, the one with the least room counts."""
    part = window(trace, *expectation.window)
    met = touches(trace, expectation.pair, *expectation.window)
    bounds = [(key, Bound(bound)) for key, bound in expectation.upper_bounds.items()]
    if expectation.at_least is not None:
        bounds.append(("at_most", Bound(expectation.at_least, upper=False)))
    findings = [_touch(expectation.subject, key, bound, met) for key, bound in bounds]
    demanded = "none" if expectation.contacts == "none" else ", ".join(one.demanded for one in findings)
    demanded += _when(expectation.window)
    worst = replace(min(findings, key=_room), demanded=demanded)
    if not worst.held or not part.sizes["time"]:
        return worst
    if untold := contacts_untold(part).value:
        return replace(worst, held=False, words=f"the contact log had no room for {untold:g} contacts")
    if met.sizes["episode"]:
        return worst
    near = _barely_missed(expectation.pair, part)
    words = worst.words + (", by geometry" if unseen_by_mujoco(trace, expectation.pair) else "") + near
    return replace(worst, words=words, near_miss=worst.near_miss or bool(near))


def _room(found: Found) -> float:
    """A margin as a share of its bound; least of all where nothing is known."""
    if found.margin is None or found.value is None:
        return -math.inf
    bound = abs(found.value + found.margin)
    return found.margin / bound if bound else found.margin


def _touch(subject: str, key: str, bound: Bound, met: Recorded) -> Found:
    """One bound on the touches of a window."""
    name, unit = QUANTITIES[key]
    count = met.sizes["episode"]
    label = key.replace("_", " ") if name else ""
    demanded = f"{label} {bound.words(unit)}".strip()
    if not count:
        margin = bound.margin(0.0)
        return Found(subject, demanded, margin >= 0.0, "none", 0.0, unit, margin=margin)
    if unit in ("N", "N s") and by_geometry(met).any():
        return Found(subject, demanded, False, FORCELESS, unit=unit)
    worst = int(np.argmax(met[name].values)) if name else 0
    value = float(met[name].values[worst]) if name else float(count)
    at = "episode_peak_time" if key in ("peak_force", "penetration") else "episode_start"
    found = Measure(value, float(met[at].values[worst]), pair(met, worst))
    margin = bound.margin(value)
    near = bool(name) and bound.is_near(margin)  # one touch less is not nearly none
    words = f"{_number(value, unit)} ({found.who} at {found.time:.3f} s: {_story(met, worst)}"
    words += f"{', the first' if not name and count > 1 else ''}){', a near miss' if near else ''}"
    return Found(subject, demanded, margin >= 0.0, words, value, unit, found.time, found.bodies, margin, near)


def _story(met: Recorded, episode: int) -> str:
    """A touch in words."""
    forceless = by_geometry(met)[episode]
    time, force, impulse, depth = (
        float(met[f"episode_{name}"].values[episode])
        for name in ("touch_time", "peak_force", "impulse", "depth")
    )
    lasts = f"{1e3 * time:.3g} ms" if time < 1.0 else f"{time:.3g} s"
    if forceless:
        return f"{lasts}, {1e3 * depth:.3g} mm deep, by geometry, which knows no force"
    return f"{lasts}, up to {force:.3g} N, {impulse:.3g} N s, {1e3 * depth:.3g} mm deep"


def _barely_missed(sides: tuple[str, str] | None, part: Recorded) -> str:
    """Who nearly touched in a window; empty where nobody did, or where no clearance is recorded."""
    found = least_clearance(part, sides)
    nearest = NEAR * float(part["robot_radius"].values.min())
    if found.value is None or not 0.0 <= found.value < nearest:
        return ""
    return f", a near miss: {1e3 * found.value:.2g} mm{_circumstances(found)}"
