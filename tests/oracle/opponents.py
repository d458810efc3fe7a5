"""Which opponents come, and who guards against whom."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.movers import COMES, INTERCEPTED, REACHED, WAITS
from escort_mj.control.opponents import KEPT, NEAR
from tests.oracle.setup import SetupNow
from tests.oracle.teams import Teams, targets_at

Array = NDArray[np.float64]


class Threats(NamedTuple):
    """What each robot guards against.

    Attributes:
        number: Of the opponent, from 1; 0 for none, shape (n,).
        position: Where it is, shape (n, p) [m]; 0 for none.
        velocity: How fast it moves, likewise [m/s].
    """

    number: NDArray[np.int64]
    position: Array
    velocity: Array


class Watch:
    """What becomes of opponents, step by step; arguments as in `assign_guards`."""

    def __init__(self, setup: SetupNow) -> None:
        self.status = np.zeros(len(setup.opponent_places))
        self.interceptor = np.zeros(len(setup.opponent_places), dtype=int)
        self._number = np.zeros(setup.count, dtype=int)

    def judge(self, t: float, q: Array, target: Array, lost: NDArray[np.bool_], setup: SetupNow) -> None:
        """Let opponents come, be intercepted, and reach the target."""
        targets = [(target, setup.target_radius or 0.0)]
        if setup.teams:
            quarries = [j for each in targets_at(setup, t + 0.5 * setup.timestep) for j in each]
            targets = [(setup.obstacle_position[j], setup.obstacle_radius[j]) for j in quarries]
        rules = [(group, number) for group in setup.opponents for number in range(group.count)]
        for o, (j, (group, number)) in enumerate(zip(setup.opponent_places, rules, strict=True)):
            here, size = setup.obstacle_position[j], setup.obstacle_radius[j]
            if self.status[o] == WAITS and t >= group.start + number * group.interval:
                self.status[o] = COMES
            if self.status[o] != COMES:
                continue
            gaps = np.linalg.norm(q - here, axis=1) - setup.robot_radius - size
            near = np.flatnonzero((gaps <= group.capture_distance) & ~lost)
            nearest, radius = min(targets, key=lambda each: float(np.linalg.norm(each[0] - here)))
            if len(near):
                self.status[o], self.interceptor[o] = INTERCEPTED, near[0] + 1
            elif np.linalg.norm(nearest - here) - radius - size <= group.reach_distance:
                self.status[o] = REACHED

    def assign(
        self, q: Array, target: Array, lost: NDArray[np.bool_], setup: SetupNow, teams: Teams | None = None
    ) -> Threats:
        """Return which robot guards against which opponent."""
        places = [*setup.opponent_places]
        here, speed = setup.obstacle_position[places], setup.obstacle_velocities()[places]
        center, radius = np.tile(target, (len(here), 1)), np.full(len(here), setup.radius)
        team = np.zeros(len(here), dtype=int)
        if teams is not None:
            owner = sorted((j, number) for number, each in enumerate(teams.targets) for j in each)
            spots = setup.obstacle_position[[j for j, _ in owner]]
            nearest = np.linalg.norm(here[:, None] - spots, axis=2).argmin(axis=1)
            team = np.array([number for _, number in owner])[nearest]
            center, radius = teams.center[team], teams.radius[team]
        way = np.linalg.norm(here - center, axis=1)
        time = way / np.maximum(np.linalg.norm(speed, axis=1), 0.1)
        coming = [o for o in np.lexsort((np.arange(len(time)), time)) if self.status[o] == COMES]
        before, self._number = self._number, np.zeros_like(self._number)
        for o in coming[: len(q)]:
            point = center[o] + min(radius[o], way[o]) / max(way[o], NEAR) * (here[o] - center[o])
            distance = np.linalg.norm(point - q, axis=1) * np.where(before == o + 1, KEPT, 1.0)
            distance[(self._number > 0) | lost] = np.inf
            if teams is not None:
                distance[teams.members != team[o]] = np.inf
            if np.isfinite(distance.min()):
                self._number[distance.argmin()] = o + 1
        threatened = self._number > 0
        rows = np.maximum(self._number - 1, 0)
        return Threats(
            self._number,
            np.where(threatened[:, None], here[rows], 0.0),
            np.where(threatened[:, None], speed[rows], 0.0),
        )
