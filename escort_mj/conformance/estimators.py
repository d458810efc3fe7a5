"""What is asked of an estimator."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import ROUNDING, SEED, CheckResult, Stand, stands
from escort_mj.estimators import Estimator
from escort_mj.knowledge.sight import MEASURES, NOT_MEASURED
from escort_mj.scenario.schema.scenario import Scenario

DRAWS = 20
LOOKS, STEP = 100, 0.04  # and time between two of them [s]
SURE = 1e-4  # variance of measurements without error
FOUND = 0.5  # share of the first error that may be left


def check_estimator(member: type[Estimator], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check an estimator: on memory filled by hand, in plane, space and beyond.

    Args:
        member: The estimator.
        kind: The type of scenarios that knows it.
    """
    yield from check_calls(member, kind)
    yield _own_rows(member, kind)
    yield from _consistent(member, kind)
    for needed in member.needs:
        yield _finds(member, kind, needed)


def _own_rows(member: type[Estimator], kind: type[Scenario]) -> CheckResult:
    """The beliefs of other robots stay as they are."""
    for stand in stands(member, kind):
        random = np.random.default_rng(SEED)
        rows = [getattr(stand.state, name) for name in member.outputs]
        for draw in range(DRAWS):
            robot = draw % stand.numbers
            stand.fill(random)
            before = [np.delete(each, robot, axis=0).tobytes() for each in rows]
            stand.call(robot)
            if before != [np.delete(each, robot, axis=0).tobytes() for each in rows]:
                return CheckResult("keeps to its robot", False, "changes what another robot believes")
    return CheckResult("keeps to its robot", True, "changes the belief of one robot only")


def _consistent(member: type[Estimator], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Covariances stay covariances, and nothing is newer than now."""
    worst, ahead = 0.0, 0.0
    for stand in stands(member, kind):
        random, state = np.random.default_rng(SEED), stand.state
        size = state.belief.shape[1]
        for draw in range(DRAWS):
            robot = draw % stand.numbers
            stand.fill(random)
            stand.call(robot)
            newest = max(state.belief_time[robot], state.belief_fix[robot])
            ahead = max(ahead, float(newest - state.time[0]))
            square = state.belief_covariance[robot].reshape(size, size)
            if np.isfinite(square).all():
                off = max(np.abs(square - square.T).max(), -np.linalg.eigvalsh(square)[0])
                worst = max(worst, float(off / np.abs(square).max(initial=1e-300)))
    words = "of now or before" if ahead <= 0.0 else f"{ahead:.3g} s ahead of now"
    yield CheckResult("times", ahead <= 0.0, words)
    words = "symmetric, no variance below 0"
    if worst > ROUNDING:
        words = f"not symmetric, or a variance below 0: off by {worst:.2g} of its largest number"
    yield CheckResult("covariance", worst <= ROUNDING, words)


def _finds(member: type[Estimator], kind: type[Scenario], needed: tuple[str, ...]) -> CheckResult:
    """Measurements without error, from many places, lead to a target at rest."""
    left = 0.0
    for stand in stands(member, kind):
        random, axes = np.random.default_rng(SEED), stand.state.q.shape[1]
        stand.fill(random)
        stand.sight_variance[:] = [SURE if name in needed else NOT_MEASURED for name in MEASURES]
        target, state = random.standard_normal((axes,)), stand.state
        size, first = state.belief.shape[1], np.ones(axes)
        state.belief[0], state.belief_covariance[0] = 0.0, np.eye(size).ravel()
        state.belief[0, :axes] = target + first
        state.belief_time[0] = state.belief_fix[0] = state.time[0]
        for _ in range(LOOKS):
            state.time[0] += STEP
            _look(stand, target, 5.0 * random.standard_normal((axes,)))
            stand.call(0)
        error = np.linalg.norm(state.belief[0, :axes] - target) / np.linalg.norm(first)
        left = max(left, float(error) if np.isfinite(error) else np.inf)
    words = f"of an error, {left:.2g} is left after {LOOKS} looks without error: {', '.join(needed)}"
    return CheckResult("finds the target", left <= FOUND, words)


def _look(stand: Stand, target: np.ndarray, place: np.ndarray) -> None:
    """Robot 1 measures a target at rest, without error."""
    state, way = stand.state, target - place
    state.message[0] = -1.0
    state.q_measured[0], state.seen_position[0], state.seen_velocity[0] = place, target, 0.0
    state.seen_range[0] = np.linalg.norm(way)
    state.seen_bearing[0] = way / state.seen_range[0]
