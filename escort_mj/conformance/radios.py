"""What is asked of a radio."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import SEED, CheckResult, stands
from escort_mj.radios import Radio
from escort_mj.radios.radio import PASSES, SENDS
from escort_mj.scenario.schema.scenario import Scenario

MESSAGES = 200  # of each robot
DRAWS = 100


def check_radio(member: type[Radio], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a radio: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The radio.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _in_order(member, kind)
    yield _in_time(member, kind)


def _in_order(member: type[Radio], kind: type[Scenario]) -> CheckResult:
    """Messages follow each other, as many as `period` says."""
    worst = 0.0
    for stand in stands(member, kind):
        random, timestep = np.random.default_rng(SEED), stand.timestep
        period = stand.own.period(timestep, len(stand.state.q))
        for sender in range(len(stand.state.q)):
            stand.fill(random)
            due = []
            for number in range(MESSAGES):
                stand.state.message_sender[0], stand.state.message_number[0] = sender, number
                stand.state.message_draws[:] = random.random(2)
                stand.call(SENDS)
                due.append(float(stand.state.message_due[0]))
            if min(due) < -timestep:
                return CheckResult(
                    "sends", False, f"message {int(np.argmin(due))} is sent at {min(due):.3g} s"
                )
            if (later := np.diff(due)).min() <= 0.0:
                number = int(np.argmax(later <= 0.0)) + 1
                words = f"message {number} is sent at {due[number]:.3g} s, no later than the one before"
                return CheckResult("sends", False, words)
            mean = (due[-1] - due[0]) / (MESSAGES - 1)
            worst = max(worst, (max(period, timestep) - mean) / max(period, timestep))
    words = (
        "as often as period says" if worst < 0.05 else f"period is {worst:.0%} longer than what sends gives"
    )
    return CheckResult("sends", worst < 0.05, words)


def _in_time(member: type[Radio], kind: type[Scenario]) -> CheckResult:
    """No message takes less than no time, or more than `longest`, and it is lost or not."""
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        for _ in range(DRAWS):
            stand.fill(random)
            stand.call(PASSES)
            taken, lost = float(stand.state.message_delay[0]), float(stand.state.message_lost[0])
            if lost not in (0.0, 1.0):
                return CheckResult("delays", False, f"loses returned {lost:g}; expected True or False")
            if not 0.0 <= taken <= stand.own.longest + stand.timestep:
                words = (
                    f"delays returned {taken:.3g} s; expected 0 to {stand.own.longest:.3g} s, as longest says"
                )
                return CheckResult("delays", False, words)
    return CheckResult("delays", True, "within longest")
