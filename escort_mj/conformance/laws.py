"""What is asked of a law."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import ROUNDING, SEED, CheckResult, Stand, stands
from escort_mj.laws.law import Law
from escort_mj.scenario.schema.scenario import Scenario

FAR = 100.0  # m and m/s: errors at which a law must still give numbers


def check_law(member: type[Law], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a law: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The law.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _bounded(member, kind)
    yield _holds_still(member, kind)


def _bounded(member: type[Law], kind: type[Scenario]) -> CheckResult:
    """Forces are numbers for errors of any size."""
    largest = 0.0
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        for scale in (1e-9, 1e-3, 1.0, FAR):
            stand.fill(random, scale)
            stand.call()
            if not np.isfinite(stand.outputs()).all():
                return CheckResult(
                    "bounded", False, f"what it writes is no number at errors of {scale:g} m and m/s"
                )
            largest = max(largest, float(np.abs(stand.state.tau).max()))
    return CheckResult("bounded", True, f"at most {largest:.3g} N at errors of {FAR:g} m and {FAR:g} m/s")


def _holds_still(member: type[Law], kind: type[Scenario]) -> CheckResult:
    """Where there is no error and nothing was learned, no force but what holds the robot."""
    for stand in stands(member, kind):
        _at_rest(stand)
        stand.call()
        force = np.abs(stand.state.tau - (stand.state.model_bias if member.needs_model else 0.0)).max()
        rates = max(
            (float(np.abs(rate).max()) for rate in (stand.state.rho_hat_rate, stand.state.component_rate)
             if rate.size), default=0.0,
        )  # fmt: skip
        if max(force, rates) > ROUNDING:
            return CheckResult(
                "at rest",
                False,
                f"without error, the force is {force:.3g} N and the rate of adaptation {rates:.3g} N/s",
            )
    return CheckResult("at rest", True, "without error, force and adaptation are zero")


def _at_rest(stand: Stand) -> None:
    """Every robot is where its reference is, and neither moves."""
    random = np.random.default_rng(SEED)
    stand.fill(random)
    state = stand.state
    for values in (
        state.e,
        state.e_dot,
        state.s,
        state.v_d,
        state.v_measured,
        state.rho_hat,
        state.component_memory,
    ):
        values[:] = 0.0
    state.q_d[:] = state.q_measured
