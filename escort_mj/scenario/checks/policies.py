"""Checks of what targets want."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.numerics.program import Op
from escort_mj.scenario.findings import Finding
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.scenario import Scenario, Target


def check_policy(scenario: Scenario) -> Iterator[Finding]:
    """A target with a policy begins at one place, and wants something else than to reach the target."""
    target = scenario.target
    if target is None or target.policy is None:
        return
    found = target.policy.policy
    if target.policy.seeks:
        yield Finding(
            ("target", "policy"), f"found {found}: an opponent's policy, which wants to reach the target"
        )
    if target.waypoints is not None:
        yield Finding(
            ("target", "waypoints"),
            f"found waypoints beside the policy {found}; expected position, its start",
        )
    for axis in _moving(target):
        yield Finding(
            ("target", "position", axis),
            f"found an expression in t beside the policy {found}; expected a number",
        )


def _moving(target: Target) -> list[int]:
    """Return the axes on which a target's position depends on time."""
    return [
        axis
        for axis, component in enumerate(target.position or ())
        if any(op == Op.AFFINE and rate for op, _, rate in Expression(component).instructions())
    ]
