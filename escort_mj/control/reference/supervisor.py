"""The supervisor's phases and the event trigger."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles, Behavior
from escort_mj.control.setup import Setup
from escort_mj.control.supervisor import Condition
from escort_mj.sensing.instruments import in_range

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def quantity(name: str, q: Array, c: Array, setup: Setup, lost: Mask) -> Array:
    """What a condition looks at, for every robot, shape (n,) [m]; infinite where nothing can be near."""
    if name == "robots_lost":
        return np.full(len(q), float(lost.sum()))
    if name == "target_distance":
        return np.asarray(np.linalg.norm(q - c, axis=1))
    if name == "robot_distance":
        gaps = np.linalg.norm(q[:, None] - q, axis=2) - setup.robot_radius[:, None] - setup.robot_radius
        np.fill_diagonal(gaps, np.inf)
        gaps = in_range(gaps, setup.sensing.robots)
    else:
        gaps = np.linalg.norm(q[:, None] - setup.obstacles_seen()[:-1], axis=2) - setup.obstacle_radius
        gaps = in_range(gaps - setup.robot_radius[:, None], setup.sensing.obstacles)
        if name == "target_obstacle_distance":
            around = np.linalg.norm(c - setup.obstacles_seen()[-1], axis=1) - setup.obstacle_radius
            gaps = np.where(np.isfinite(gaps), around, np.inf)
    return np.asarray(gaps.min(axis=1, initial=np.inf))


def holds(when: Condition | None, latched: Mask, q: Array, c: Array, setup: Setup, lost: Mask) -> Mask:
    """For whom a condition holds, given for whom it held before, shape (n,)."""
    if when is None:
        return np.ones(len(q), dtype=bool)
    release = when.threshold if when.release is None else when.release
    bound = np.where(latched, release, when.threshold)
    value = quantity(when.quantity, q, c, setup, lost)
    found = value < bound if when.below is not None else value > bound
    return np.full(len(q), found.any()) if when.scope == "team" else found


class Supervisor:
    """Which phase rules each robot; remembers the hysteresis."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.latched = np.zeros((len(setup.phases), setup.count), dtype=bool)

    def choose(self, t: float, q: Array, c: Array, lost: Mask) -> NDArray[np.int64]:
        """Phase of each robot at t, 0 for the mission's own, shape (n,)."""
        phase = np.zeros(self.setup.count, dtype=np.int64)
        moment = t + 0.5 * self.setup.timestep
        for number, candidate in enumerate(self.setup.phases):
            found = holds(candidate.when, self.latched[number], q, c, self.setup, lost)
            self.latched[number] = found & (candidate.after <= moment < candidate.before)
            phase[self.latched[number]] = number + 1
        return phase

    def ladder(self, phase: int) -> tuple[Behavior, ...]:
        """Behaviors of a phase."""
        return self.setup.phases[phase - 1].behaviors if phase else self.setup.behaviors


class Holder:
    """The event trigger: who computes its reference velocity anew, and since when the others hold theirs."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.since = np.full(setup.count, -np.inf)
        self.place = np.zeros((setup.count, setup.axes))
        self.phase = np.full(setup.count, -1)
        self.lost = 0

    def fires(
        self,
        t: float,
        q: Array,
        c: Array,
        w: Array,
        phase: NDArray[np.int64],
        avoided: Mask,
        supervisor: Supervisor,
        lost: Mask,
    ) -> Mask:
        """Who runs the outer loop at t; w is what they hold, relative to the target, shape (n, p) [m/s]."""
        trigger = self.setup.trigger
        if trigger is None:
            return np.ones(len(q), dtype=bool)
        fired = (self.phase != phase) | avoided | lost | (lost.sum() != self.lost)
        self.lost = int(lost.sum())
        for i, number in enumerate(phase):
            ladder = supervisor.ladder(int(number))
            gain = next(
                (b.convergence for b in ladder if b.frame == "target" and b.convergence > 0.0), np.inf
            )
            for behavior in ladder:
                if isinstance(behavior, AvoidObstacles):
                    fired[i] |= behavior.intrusion(q, self.setup, lost)[0][i] > 0.0
            bound = trigger.distance + trigger.share * float(np.linalg.norm(w[i])) / gain
            waited = t - self.since[i] + 0.5 * self.setup.timestep
            moved = float(np.linalg.norm(q[i] - c - self.place[i]))
            fired[i] |= waited >= trigger.dwell and (waited >= trigger.longest or moved > bound)
        self.since[fired], self.phase[fired] = t, phase[fired]
        self.place[fired] = (q - c)[fired]
        return fired
