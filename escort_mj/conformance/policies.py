"""What is asked of a policy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import SEED, CheckResult, stands
from escort_mj.policies import Policy
from escort_mj.scenario.schema.scenario import Scenario

DRAWS = 20
ROUNDING = 1e-9


def check_policy(member: type[Policy], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a policy: on memory filled by hand, in plane and space.

    Args:
        member: The policy.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _within_speed(member, kind)
    yield _among_robots(member, kind)


def _within_speed(member: type[Policy], kind: type[Scenario]) -> CheckResult:
    """No body wants more than its speed."""
    most = 0.0
    for stand in stands(member, kind):
        random, kept = np.random.default_rng(SEED), np.zeros_like(stand.state.policy_memory)
        for _ in range(DRAWS):
            stand.fill(random)
            stand.state.policy_memory[:] = kept  # what it has kept itself
            stand.call(0)
            kept[:] = stand.state.policy_memory
            most = max(most, float(np.linalg.norm(stand.state.mover_wish[0])) / stand.own.speed)
    return CheckResult(
        "keeps to its speed", most <= 1.0 + ROUNDING, f"wants at most {most:.3g} times its speed"
    )


def _among_robots(member: type[Policy], kind: type[Scenario]) -> CheckResult:
    """Numbers even where the body is where all robots and the target are."""
    for stand in stands(member, kind):
        stand.fill(np.random.default_rng(SEED))
        stand.state.q[:] = stand.state.target_position[:] = stand.state.mover_position[0]
        stand.call(0)
        if not np.isfinite(stand.outputs()).all():
            return CheckResult("no singularity", False, "not finite where all bodies are at one point")
    return CheckResult("no singularity", True, "finite where all bodies are at one point")
