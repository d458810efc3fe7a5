"""What is asked of all that the native loop calls: numbers, the same ones again, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.components.equations import Equations
from escort_mj.conformance.stand import (
    ROUNDING,
    SEED,
    CheckResult,
    Stand,
    other_form,
    relative_gap,
    stands,
)
from escort_mj.policies import Policy
from escort_mj.scenario.schema.scenario import Scenario

DRAWS = 20


def check_calls(member: type[Equations], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a component, call by call.

    Args:
        member: What is called.
        kind: The type of scenarios that knows it.
    """
    plain = other_form(member)
    finite, same, apart, touched = True, True, 0.0, False
    for stand in stands(member, kind):
        twin = (
            Stand(plain.model_validate(stand.own.model_dump()), kind, *stand.state.q.shape)
            if plain is not None
            else None
        )
        random = np.random.default_rng(SEED)
        for draw in range(DRAWS):
            stand.fill(random)
            robot = None if member.answers is None else draw % stand.numbers
            before, kept = stand.inputs(), stand.memory.copy()
            first = _written(stand, robot)
            touched |= stand.inputs() != before
            finite &= bool(np.isfinite(first).all())
            stand.fill(np.random.default_rng(draw))  # something else in between leaves no trace
            stand.call(robot)
            stand.memory[:] = kept
            same &= _written(stand, robot).tobytes() == first.tobytes()
            if twin is not None:
                twin.memory[:] = kept
                apart = max(apart, relative_gap(first, _written(twin, robot)))
    sizes = "in 2 and 3 axes" if issubclass(member, Policy) else "in 2, 3 and 5 axes"
    yield CheckResult("finite", finite, f"{'finite' if finite else 'not finite'} {sizes}")
    yield CheckResult("inputs", not touched, "unchanged" if not touched else "changed; write outputs only")
    yield CheckResult(
        "deterministic",
        same,
        "same input, same bits" if same else "same input, other bits: it keeps state between calls",
    )
    if plain is not None:
        held = apart <= ROUNDING
        yield CheckResult("forms agree", held, f"compiled and NumPy: relative difference {apart:.1g}")


def _written(stand: Stand, robot: int | None) -> np.ndarray:
    """What a call writes and returns, in a row."""
    returned = stand.call(robot)
    return np.append(stand.outputs(), float(returned) if robot is not None else 0.0)
