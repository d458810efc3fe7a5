"""What is asked of a behavior."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from escort_mj.behaviors.behavior import Behavior
from escort_mj.components.views import ACROSS, ALONG, NOTHING, BehaviorView
from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import SEED, BrokenError, CheckResult, Stand, stands
from escort_mj.scenario.schema.scenario import Scenario

DRAWS = 20
SMALL = 1e-6  # m, for differences
PARALLEL = 1e-4  # sine of the angle between a direction and what it should be
TASK = "task"


def check_behavior(member: type[Behavior], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a behavior: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The behavior.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _consistent(member, kind)
    yield _at_target(member, kind)
    if hasattr(member, TASK):
        yield _jacobian(member, kind)
    yield _works(member, kind)


def _draws(member: type[Behavior], kind: type[Scenario]) -> Iterator[tuple[Stand, int, int]]:
    """Stands with drawn positions, a robot, and what the behavior returns for it."""
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        for draw in range(DRAWS):
            stand.fill(random)
            robot = draw % len(stand.state.q)
            yield stand, robot, stand.call(robot)


def _sine(a: Any, b: Any) -> float:
    """Sine of the angle between two vectors; 0 where one is 0."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return (
        float(np.linalg.norm(a * float(b @ b) - b * float(a @ b)) / (size * np.linalg.norm(b)))
        if size
        else 0.0
    )


def _cosine(a: Any, b: Any) -> float:
    """Absolute cosine of the angle between two vectors; 0 where one is 0."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return abs(float(a @ b)) / size if size else 0.0


def _degrees(sine: float) -> str:
    """An angle in words."""
    return f"{np.degrees(np.arcsin(min(sine, 1.0))):.1g} degrees"


def _consistent(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """What is wished lies in what the task takes: else what lower priorities may keep would be overruled."""
    name, seen = "keeps to its task", {ALONG: 0, ACROSS: 0, NOTHING: 0}
    for stand, _, rank in _draws(member, kind):
        direction, velocity = stand.state.wish_direction, stand.state.wish_velocity
        if rank not in seen:
            raise BrokenError(name, f"returned {rank}; expected ALONG, ACROSS or NOTHING")
        seen[rank] += 1
        if rank == NOTHING:
            continue
        if not direction.any():
            raise BrokenError(name, "wish_direction is 0 while the task is active")
        off = _sine(velocity, direction) if rank == ALONG else _cosine(velocity, direction)
        if off > PARALLEL:
            wanted = "along" if rank == ALONG else "across"
            return CheckResult(
                name,
                False,
                f"wish_velocity is {_degrees(off)} off {wanted} wish_direction",
            )
    names = zip(("along", "across", "nothing"), seen.values(), strict=True)
    words = ", ".join(f"{word} {count} times" for word, count in names if count)
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


def _view(stand: Stand) -> BehaviorView:
    """What the behavior sees, for its task function."""
    from escort_mj.memory.layout import LAYOUT

    view: BehaviorView = LAYOUT.read(BehaviorView, int(stand.plan.ctypes.data), int(stand.memory.ctypes.data))
    return view


def _jacobian(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """The direction is the gradient of the task function, or lies across it, by central differences."""
    worst = 0.0
    for stand, robot, rank in _draws(member, kind):
        if rank == NOTHING:
            continue
        view, position = _view(stand), stand.state.q_measured[robot]
        gradient = np.zeros(len(position))
        for k in range(len(position)):
            here = position[k]
            sides = []
            for side in (SMALL, -SMALL):
                position[k] = here + side
                sides.append(float(getattr(stand.own, TASK)(view, robot)))
            position[k] = here
            gradient[k] = (sides[0] - sides[1]) / (2.0 * SMALL)
        direction = stand.state.wish_direction
        worst = max(worst, _sine(direction, gradient) if rank == ALONG else _cosine(direction, gradient))
    return CheckResult(
        "Jacobian",
        worst <= PARALLEL,
        f"against differences of task(): {_degrees(worst)} off",
    )


def _works(member: type[Behavior], kind: type[Scenario]) -> CheckResult:
    """A short step of the robot as wished does not take the task farther from done."""
    step, rises, most = 1e-4, 0, 0
    for stand, robot, rank in _draws(member, kind):
        if rank == NOTHING:
            continue
        before = float(stand.state.wish_error[0])
        stand.state.q_measured[robot] += step * stand.state.wish_velocity
        stand.call(robot)
        most += 1
        rises += float(stand.state.wish_error[0]) > before + 1e-9 * max(1.0, before)
    return CheckResult("works", rises == 0, f"wish_error rises in {rises} of {most} steps as wished")
