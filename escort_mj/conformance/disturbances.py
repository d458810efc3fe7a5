"""What is asked of a disturbance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import ROUNDING, SEED, CheckResult, relative_gap, stands
from escort_mj.disturbances import Disturbance
from escort_mj.scenario.schema.scenario import Scenario

FAR = 1e3  # m and m/s: places and speeds at which a force must still be a number


def check_disturbance(member: type[Disturbance], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a disturbance: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The disturbance.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _bounded(member, kind)
    if not member.sees_others:
        yield _alone(member, kind)


def _bounded(member: type[Disturbance], kind: type[Scenario]) -> CheckResult:
    """Forces are numbers wherever robots are, and however fast."""
    largest = 0.0
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        for scale in (0.0, 1.0, -1.0, FAR):
            stand.fill(random)
            for values in (stand.state.q, stand.state.v):
                values *= scale
            stand.call()
            if not np.isfinite(stand.outputs()).all():
                words = f"what it writes is no number at places of {scale:g} m and speeds of {scale:g} m/s"
                return CheckResult("bounded", False, words)
            largest = max(largest, float(np.abs(stand.state.disturbance_force).max()))
    return CheckResult("bounded", True, f"at most {largest:.3g} N at {FAR:g} m and {FAR:g} m/s")


def _alone(member: type[Disturbance], kind: type[Scenario]) -> CheckResult:
    """The force on a robot is the same whatever the other robots do."""
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        stand.fill(random)
        stand.call()
        alone = stand.state.disturbance_force[0].copy()
        for values in (stand.state.q, stand.state.v):
            values[1:] = random.standard_normal(values[1:].shape)
        stand.call()
        if relative_gap(stand.state.disturbance_force[0], alone) > ROUNDING:
            return CheckResult("robot by robot", False, "the force on a robot depends on other robots")
    return CheckResult("robot by robot", True, "the force on a robot depends on no other robot")
