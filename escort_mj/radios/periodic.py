"""A radio that sends at a fixed rate."""

import math
from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.components.facts import Facts, Misfit
from escort_mj.native.values import Values
from escort_mj.radios.radio import Radio


class Periodic(Radio):
    """Each robot sends at a fixed rate: its position, its velocity and its estimate of the target."""

    rates: ClassVar[tuple[str, ...]] = ("rate",)
    radio: Literal["periodic"] = "periodic"
    rate: PositiveFloat | None = None
    """Messages per second of each robot [1/s], a whole number of physics steps apart; null: at every
    step."""
    jitter: NonNegativeFloat = 0.0
    """Largest random delay before a message is sent [s]; the delay is uniformly distributed."""

    def sends(self, r: Values) -> Any:
        """Return the time of a message: late by a random number of steps."""
        every = max(round(1.0 / (self.rate * r.timestep)), 1)
        late = math.floor(r.draw * (round(self.jitter / r.timestep) + 1.0))
        return r.timestep * (r.number * every + late)

    def period(self, timestep: float, robots: int) -> float:
        """Return the mean time between two messages of a robot [s]."""
        return timestep if self.rate is None else 1.0 / self.rate

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a delay with which a message would be due before the one before it."""
        most, half = self.period(mission.timestep, 1) - mission.timestep, 0.5 * mission.timestep
        if most > -half and self.jitter > most + half:  # else the rate is too high
            words = "a step less than the time between two messages"
            yield Misfit(f"found {self.jitter:g} s; expected at most {most:g} s, {words}", "jitter")

    @property
    def longest(self) -> float:
        """Return the longest time from when a message is due to its arrival [s]."""
        return super().longest + self.jitter
