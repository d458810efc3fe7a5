"""What is asked of a sensor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import SEED, CheckResult, stands
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensors import Sensor
from escort_mj.sensors.sensor import MOVES, SHOWS


def check_sensor(member: type[Sensor], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a sensor: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The sensor.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _waits(member, kind)


def _waits(member: type[Sensor], kind: type[Scenario]) -> CheckResult:
    """What a sensor shows again at the same time is the same, and its own numbers stay."""
    for stand in stands(member, kind):
        stand.fill(np.random.default_rng(SEED))
        stand.call(MOVES)
        memory, shown = stand.state.sensor_memory.copy(), stand.state.sensor_shown.copy()
        stand.call(SHOWS)
        same = np.array_equal(memory, stand.state.sensor_memory)
        if not same or not np.array_equal(shown, stand.state.sensor_shown):
            return CheckResult("same time", False, "asked again at the same time, it shows something else")
    return CheckResult("same time", True, "shows the same again")
