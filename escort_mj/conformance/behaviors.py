"""What is asked of a behavior."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.task import ACROSS, ACTIVE, DIRECTIONS, ERROR, OTHER_WEIGHT, VALUE, WEIGHT
from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import SEED, CheckResult, Stand, stands
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

DRAWS = 20
SMALL = 1e-6  # m, for differences
PARALLEL = 1e-4  # sine of the angle between a direction and what it should be


class Asked(NamedTuple):
    """What a behavior asks of one robot.

    Attributes:
        velocity: What it is to do [m/s].
        taken: Unit vectors that the task takes, shape (directions, p); of a task across x, x itself.
        across: Whether it takes all directions but these.
        error: How far it is from done [m].
        value: The task function.
    """

    velocity: Array
    taken: Array
    across: bool
    error: float
    value: float


def check_behavior(member: type[Behavior], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a behavior: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The behavior.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _consistent(member, kind)
    yield _at_target(member, kind)
    yield _jacobian(member, kind)
    yield _works(member, kind)


def _draws(member: type[Behavior], kind: type[Scenario]) -> Iterator[tuple[Stand, int, Asked | None]]:
    """Stands with drawn positions, a robot, and what the behavior asks of it; None where it asks nothing."""
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        for draw in range(DRAWS):
            stand.fill(random)
            robot = draw % len(stand.state.q)
            yield stand, robot, _asked(stand, robot)


def _asked(stand: Stand, robot: int) -> Asked | None:
    stand.call(0)
    state, traits = stand.state, stand.state.asked[robot]
    if traits[ACTIVE] < 0.5 and not stand.own.limits:
        return None
    both = ((WEIGHT, state.asked_x), (OTHER_WEIGHT, state.asked_other))[: int(traits[DIRECTIONS])]
    taken = [x[robot] / np.linalg.norm(x[robot]) for weight, x in both if traits[weight] or stand.own.limits]
    return Asked(
        state.asked_velocity[robot].copy(), np.reshape(taken, (len(taken), state.q.shape[1])),
        bool(traits[ACROSS] > 0.5), float(traits[ERROR]), float(traits[VALUE]),
    )  # fmt: skip


def _share(vector: Array, directions: Array) -> float:
    """Share of a vector in the span of directions; 0 where it is 0."""
    if not len(directions) or not vector.any():
        return 0.0
    inside = np.linalg.lstsq(directions.T, vector, rcond=None)[0] @ directions
    return float(np.linalg.norm(inside) / np.linalg.norm(vector))


def _off(asked: Asked, vector: Array) -> float:
    """Sine of the angle between a vector and what a task takes; 0 where one is 0."""
    share = _share(vector, asked.taken)
    if asked.across or not vector.any():
        return share
    return float(np.sqrt(max(1.0 - share * share, 0.0)))


def _degrees(sine: float) -> str:
    """An angle in words."""
    return f"{np.degrees(np.arcsin(min(sine, 1.0))):.1g} degrees"


def _consistent(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """What is asked lies in what the task takes: else what lower priorities may keep would be overruled."""
    name, seen = "keeps to its task", {"along": 0, "across": 0, "nothing": 0}
    for _, _, asked in _draws(member, kind):
        if asked is None:
            seen["nothing"] += 1
            continue
        where = "across" if asked.across else "along"
        seen[where] += 1
        if (off := _off(asked, asked.velocity)) > PARALLEL:
            return CheckResult(name, False, f"its velocity is {_degrees(off)} off {where} x")
    words = ", ".join(f"{word} {count} times" for word, count in seen.items() if count)
    return CheckResult(name, True, words)


def _at_target(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """Numbers even where a robot is where the target or a teammate is."""
    for stand in stands(member, kind):
        stand.fill(np.random.default_rng(SEED))
        stand.state.q_measured[:] = stand.state.target_position_measured
        stand.call(0)
        if not np.isfinite(stand.outputs()).all():
            return CheckResult("no singularity", False, "not finite where all robots are at the target")
    return CheckResult("no singularity", True, "finite where all robots are at the target")


def _jacobian(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """The gradient is that of the task function, by central differences; a task across x has none."""
    worst, tried = 0.0, 0
    for stand, robot, asked in _draws(member, kind):
        if asked is None or asked.across or not len(asked.taken):
            continue
        x, position = stand.state.asked_x[robot].copy(), stand.state.q_measured[robot]
        found = np.zeros(len(position))
        for k in range(len(position)):
            here, sides = position[k], []
            for side in (SMALL, -SMALL):
                position[k] = here + side
                sides.append(_value(stand, robot))
            position[k] = here
            found[k] = (sides[0] - sides[1]) / (2.0 * SMALL)
        tried += 1
        worst = max(worst, float(np.linalg.norm(found - x)) / max(1.0, float(np.linalg.norm(x))))
    words = f"gradient against differences: {worst:.1g} off in {tried} places" if tried else "no gradient"
    return CheckResult("Jacobian", worst <= PARALLEL, words)


def _value(stand: Stand, robot: int) -> float:
    """The task function of a robot now."""
    stand.call(0)
    return float(stand.state.asked[robot, VALUE])


def _works(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """A short step of the robot as asked does not take the task farther from done."""
    step, rises, most = 1e-4, 0, 0
    for stand, robot, asked in _draws(member, kind):
        if asked is None:
            continue
        stand.state.q_measured[robot] += step * asked.velocity
        after: Any = _asked(stand, robot)
        most += 1
        rises += after is not None and after.error > asked.error + 1e-9 * max(1.0, asked.error)
    return CheckResult("works", rises == 0, f"the error rises in {rises} of {most} steps as asked")
