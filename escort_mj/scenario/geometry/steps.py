"""Which physics steps a run has, and in which of them samples are taken."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from escort_mj.numerics.steps import first_step, last_step

if TYPE_CHECKING:
    from escort_mj.scenario.schema.scenario import Scenario


@dataclass(frozen=True)
class Schedule:
    """The physics steps in which samples are taken, both numbered from 0.

    Attributes:
        stride: Every so many steps there is one.
        last: The last step of the run.
        extra: Steps of further samples, ascending, none a multiple of the stride.
    """

    stride: int
    last: int
    extra: tuple[int, ...] = ()

    @property
    def count(self) -> int:
        """Samples of the whole run."""
        return self.before(self.last + 1)

    def before(self, step: int) -> int:
        """How many samples are taken before a step."""
        return -(-step // self.stride) + bisect_left(self.extra, step)

    def step(self, sample: int) -> int:
        """The step of a sample; past the end of the run they are a stride apart."""
        earlier = bisect_left(self._numbers, sample)
        if earlier < len(self.extra) and self._numbers[earlier] == sample:
            return self.extra[earlier]
        return (sample - earlier) * self.stride

    def ending_at(self, step: int) -> Schedule:
        """The schedule of a run that ends in a step, in which a sample is taken."""
        earlier = self.extra[: bisect_left(self.extra, step)]
        return Schedule(self.stride, step, (*earlier, step) if step % self.stride else earlier)

    @cached_property
    def _numbers(self) -> list[int]:
        """The numbers of the further samples."""
        return [self.before(step) for step in self.extra]


def schedule_of(scenario: Scenario, more: Iterable[int] = ()) -> Schedule:
    """When a scenario's samples are taken.

    Beside those that `recording.rate` asks for there is one in the run's last step, and there are some where
    windows of expectations begin and end. What is watched between samples is known from one sample to the
    next, so where an expectation reads that, there is one in the step before its window as well. And totals
    count robots until the team knows that they failed, so there is one before and after that.

    Args:
        scenario: A checked scenario.
        more: Further steps with a sample.
    """
    timestep = scenario.physics.timestep
    stride = round(1.0 / (scenario.recording.rate * timestep))
    last = last_step(scenario.duration, timestep)
    wanted = {last, *more}
    for expectation in scenario.expect:
        start, end = expectation.window_in(last * timestep)  # of its trace: the duration need not be a step
        first = first_step(start, timestep)
        wanted.add(first)
        if expectation.watched or expectation.watches:
            wanted.add(first - 1)
        if end is not None:
            wanted.add(last_step(end, timestep))
    for failure in scenario.robots.failures if scenario.expect else ():
        lost = first_step(failure.at + failure.notice - 0.5 * timestep, timestep)
        wanted |= {lost - 1, lost}
    extra = sorted(step for step in wanted if 0 < step <= last and step % stride)
    return Schedule(stride, last, tuple(extra))
