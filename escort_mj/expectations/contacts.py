"""Bounds on touches between two sides."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from pydantic import NonNegativeFloat, NonNegativeInt, PositiveInt

from escort_mj.expectations.bound import NEAR, Limits, circumstances, order_faults, text_of
from escort_mj.expectations.expectation import Fault, Judgment, Sides, Windowed, not_judged
from escort_mj.expectations.sides import sides
from escort_mj.expectations.touches import least_clearance, require_sides, touches, unseen_by_mujoco
from escort_mj.metrics.contacts import FORCELESS, contacts_untold
from escort_mj.metrics.measure import Measure
from escort_mj.record.episodes import by_geometry, pair
from escort_mj.record.recording import Recorded, is_log
from escort_mj.record.window import rate_of, window

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome

QUANTITIES = {
    "at_most": ("", ""),
    "touch_time": ("episode_touch_time", "s"),
    "peak_force": ("episode_peak_force", "N"),
    "impulse": ("episode_impulse", "N s"),
    "penetration": ("episode_depth", "m"),
}
"""Variable and unit of what a bound on touches is about; of `at_most`, their number."""


class ContactExpectation(Windowed):
    """Bounds on touches between bodies; without any bound, no touch is allowed."""

    kind = "contacts"
    rank = 20

    contacts: sides("none", "any")  # type: ignore[valid-type]
    """Two groups or bodies; `any`: any two bodies other than the floor; `none`: likewise, with no touch
    allowed."""
    at_most: NonNegativeInt | None = None
    """Maximum number of touches; each is one unbroken contact between two bodies; null: 0 if there is no
    other bound."""
    at_least: PositiveInt | None = None
    """Minimum number of touches."""
    touch_time: NonNegativeFloat | None = None
    """Maximum duration of a touch [s]."""
    peak_force: NonNegativeFloat | None = None
    """Maximum normal force of a touch [N]."""
    impulse: NonNegativeFloat | None = None
    """Maximum impulse of a touch, the integral of its normal force [N s]."""
    penetration: NonNegativeFloat | None = None
    """Maximum penetration during a touch [m]."""

    def judge_run(self, trace: Recorded, outcome: Outcome) -> Judgment:
        """Whether the touches of the window are within all bounds; the one with the least room counts."""
        found = self._of_known(trace)
        if found.held or not self.lasting:
            require_sides(trace, self.named_sides)
        return found

    def _of_known(self, trace: Recorded) -> Judgment:
        """The same of the bodies whose places are known."""
        part, named = window(trace, *self.window), self.named_sides
        met = touches(trace, named, *self.window)
        each = [_touch(key, bound, met) for key, bound in self._bounds()]
        worst = min((found for found in each if not found.skip), key=_room, default=each[0])
        if worst.held and (unknown := next((found for found in each if found.skip), None)):
            return unknown
        if not worst.held or not part.sizes["time"]:
            return worst
        if untold := contacts_untold(part).value:
            return worst._replace(
                held=False, margin=None, words=f"the contact log had no room for {untold:g} contacts"
            )
        if met.sizes["episode"]:
            return worst
        near = _barely_missed(named, part)
        words = worst.words + (", by geometry" if unseen_by_mujoco(trace, named) else "") + near
        return worst._replace(words=words, near_miss=worst.near_miss or bool(near))

    @property
    def lasting(self) -> bool:
        """Whether what does not hold of a part does not hold of all: more has no fewer touches."""
        return self.at_least is None

    @property
    def reads_samples(self) -> bool:
        """It sees every physics step."""
        return False

    @property
    def demanded(self) -> str:
        """The bounds in words."""
        return "none" if self.contacts == "none" else ", ".join(_demanded(*one) for one in self._bounds())

    @property
    def sampled_at_ends(self) -> bool:
        """Touches are known from their log, whatever is sampled."""
        return False

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return "contacts" if self.named_sides is None else f"contacts {'/'.join(self.named_sides)}"

    @property
    def named_sides(self) -> Sides | None:
        """The two groups or bodies; None for any two bodies but the floor."""
        return None if isinstance(self.contacts, str) else self.contacts

    def faults(self) -> Iterator[Fault]:
        """Touches that are not to be have no bounds, and those of any two bodies have one."""
        keys = ("at_most", "at_least", "touch_time", "peak_force", "impulse", "penetration")
        given = [key for key in keys if getattr(self, key) is not None]
        if self.contacts == "none":
            for key in given:
                yield (key,), "found a bound on contacts of which there are to be none; write contacts: any"
        elif self.contacts == "any" and not given:
            yield (), f"has no bound; give {', '.join(keys[:-1])} or {keys[-1]}, or write contacts: none"
        yield from order_faults(self.at_least, self.at_most)

    def _bounds(self) -> list[tuple[str, Limits]]:
        """The bounds that are given, by key of what they are about; where there is none, of no touch."""
        bounds = [(key, Limits(bound)) for key in QUANTITIES if (bound := getattr(self, key)) is not None]
        if self.at_least is not None:
            bounds.append(("at_most", Limits(self.at_least, upper=False)))
        return bounds or [("at_most", Limits(0.0))]


def _demanded(key: str, bound: Limits) -> str:
    """A bound in words."""
    name, unit = QUANTITIES[key]
    return f"{key.replace('_', ' ') if name else ''} {bound.words(unit)}".strip()


def _room(found: Judgment) -> float:
    """A margin as a share of its bound; least of all where nothing is known."""
    if found.margin is None or found.value is None:
        return -math.inf
    bound = abs(found.value + found.margin)
    return found.margin / bound if bound else found.margin


def _touch(key: str, bound: Limits, met: Recorded) -> Judgment:
    """One bound on the touches of a window."""
    name, unit = QUANTITIES[key]
    count = met.sizes["episode"]
    if not count:
        margin = bound.margin(0.0)
        return Judgment(margin >= 0.0, "none", 0.0, unit, margin=margin)
    if unit in ("N", "N s") and by_geometry(met).any():
        return not_judged(FORCELESS) if is_log(met) else Judgment(False, FORCELESS, unit=unit)
    worst = int(np.argmax(met[name].values)) if name else 0
    value = float(met[name].values[worst]) if name else float(count)
    at = "episode_peak_time" if key in ("peak_force", "penetration") else "episode_start"
    found = Measure(value, float(met[at].values[worst]), pair(met, worst))
    margin = bound.margin(value)
    near = bool(name) and bound.is_near(margin)  # one touch less is not nearly none
    words = f"{text_of(value, unit)} ({found.who} at {found.time:.3f} s: {_story(met, worst)}"
    words += f"{', the first' if not name and count > 1 else ''}){', a near miss' if near else ''}"
    return Judgment(margin >= 0.0, words, value, unit, found.time, found.bodies, margin, near)


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
    """The bodies that nearly touched in a window; empty where none did, or where no clearance is recorded."""
    found = least_clearance(part, sides)
    nearest = NEAR * float(part["robot_radius"].values.min())
    if found.value is None or not 0.0 <= found.value < nearest:
        return ""
    at = "at" if rate_of(part) == 1.0 / float(part.attrs["timestep"]) else "by"  # a sample
    return f", a near miss: {1e3 * found.value:.2g} mm{circumstances(found, at)}"
