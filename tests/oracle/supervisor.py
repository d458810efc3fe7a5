"""Which phase rules each robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Behavior
from escort_mj.rules import Rule
from tests.oracle.sensing import in_range
from tests.oracle.setup import SetupNow

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def quantity(name: str, q: Array, c: Array, setup: SetupNow, lost: Mask) -> Array:
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
        gaps = np.linalg.norm(q[:, None] - setup.obstacles_seen()[:-1], axis=2) - setup.seen_radius
        gaps = in_range(gaps - setup.robot_radius[:, None], setup.sensing.obstacles)
        if name == "target_obstacle_distance":
            around = np.linalg.norm(c[:, None] - setup.obstacles_seen()[-1], axis=2) - setup.obstacle_radius
            gaps = np.where(np.isfinite(gaps), around, np.inf)
    return np.asarray(gaps.min(axis=1, initial=np.inf))


def holds(
    when: Rule | None, latched: Mask, q: Array, c: Array, setup: SetupNow, lost: Mask, ruled: Mask
) -> Mask:
    """For whom of those that a phase rules its condition holds, given for whom it did before, shape (n,)."""
    if when is None:
        return ruled
    bound = np.where(latched, when.end, when.threshold)
    value = quantity(when.quantity, q, c, setup, lost)
    found = value < bound if when.below is not None else value > bound
    found &= ruled
    return ruled & found.any() if when.scope == "team" else found


class Supervisor:
    """Which phase rules each robot; remembers the hysteresis."""

    def __init__(self, setup: SetupNow) -> None:
        self.setup = setup
        self.latched = np.zeros((len(setup.phases), setup.count), dtype=bool)

    def choose(
        self, t: float, q: Array, c: Array, lost: Mask, members: NDArray[np.int64] | None = None
    ) -> NDArray[np.int64]:
        """Phase of each robot at t, 0 for the mission's own, shape (n,); members as in `Situation`."""
        phase = np.zeros(self.setup.count, dtype=np.int64)
        moment = t + 0.5 * self.setup.timestep
        for number, candidate in enumerate(self.setup.phases):
            ruled = np.full(self.setup.count, True)
            if candidate.team is not None:
                names = [team.name for team in self.setup.teams]
                ruled = np.asarray(members) == names.index(candidate.team)
            found = holds(candidate.when, self.latched[number], q, c, self.setup, lost, ruled)
            self.latched[number] = found & (candidate.after <= moment < (candidate.before or np.inf))
            phase[self.latched[number]] = number + 1
        return phase

    def stack(self, phase: int) -> tuple[Behavior, ...]:
        """Behaviors of a phase."""
        return self.setup.phases[phase - 1].behaviors if phase else self.setup.behaviors
