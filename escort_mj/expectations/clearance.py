"""A bound on the distance between two sides, surface to surface."""

from collections.abc import Iterator
from typing import Any

from pydantic import NonNegativeFloat

from escort_mj.expectations.bound import Limits, held_against
from escort_mj.expectations.expectation import Judgment, Sides, Windowed
from escort_mj.expectations.sides import sides
from escort_mj.expectations.touches import clearance_watch, least_clearance, require_sides
from escort_mj.metrics.watching import Watch, to_the_step


class ClearanceExpectation(Windowed):
    """A bound on the distance between two groups or bodies, surface to surface."""

    kind = "clearance"
    rank = 30
    in_unit = "m"
    of_floor = False

    clearance: sides()  # type: ignore[valid-type]
    """Two groups or bodies other than the floor; at least one of the two must be robots or the target."""
    at_least: NonNegativeFloat
    """Minimum distance at every physics step [m]."""

    def judge(self, trace: Any) -> Judgment:
        """Whether the least distance of the window is enough."""
        least = to_the_step(trace, self._watch, least_clearance(trace, self.clearance))
        found = held_against(least, "m", [self._bound])
        if found.held:
            require_sides(trace, self.clearance)
        return found

    @property
    def watches(self) -> tuple[Watch, ...]:
        """When the clearance is least."""
        return (self._watch,)

    @property
    def _watch(self) -> Watch:
        return clearance_watch(self.clearance)

    @property
    def lasting(self) -> bool:
        """Whether what does not hold of a part does not hold of all: it does not get farther by more."""
        return True

    @property
    def reads_samples(self) -> bool:
        """It sees every physics step."""
        return False

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return f"clearance {'/'.join(self.clearance)}"

    @property
    def demanded(self) -> str:
        """The bound in words."""
        return self._bound.words("m")

    @property
    def named_sides(self) -> Sides:
        """The two groups or bodies."""
        pair: Sides = self.clearance
        return pair

    @property
    def watched_sides(self) -> Sides:
        """The same: their clearance has to be watched."""
        return self.named_sides

    def exact_distances(self) -> Iterator[float]:
        """Its bound [m]."""
        yield self.at_least

    @property
    def _bound(self) -> Limits:
        return Limits(self.at_least, upper=False)
