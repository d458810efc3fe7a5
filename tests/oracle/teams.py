"""Teams, their targets, and who moves to another one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.setup import Setup
from tests.oracle.behaviors import turned_rotation
from tests.oracle.failure import KnownRobots as Formed
from tests.oracle.failure import placed
from tests.oracle.setup import SetupNow, radius_at

Array = NDArray[np.float64]


class Teams:
    """Who is in which team, step by step.

    Attributes:
        members: Team of each robot, from 0, shape (n,).
        targets: Which obstacles the targets of each team are.
        radius: Distance that each team keeps from their middle, shape (teams,) [m].
        center: Middle of each team's targets, shape (teams, p) [m].
        velocity: How fast it moves, likewise [m/s].
        rotation: Of the even figure of each robot's team, shape (n, p, p).
        formed: Steps in which members last came, went or were lost, shape (teams,); -1 for none.
        aimed: Steps in which their targets last changed, likewise.
        told: Which robots have other targets from this step on, shape (n,).
    """

    def __init__(self, setup: SetupNow) -> None:
        self.members = setup.members
        self.targets = targets_at(setup, 0.5 * setup.timestep)
        self.rotation = np.broadcast_to(np.eye(setup.axes), (setup.count, setup.axes, setup.axes)).copy()
        self._missed = np.zeros(setup.count, dtype=bool)
        self.formed, self.aimed = np.full((2, len(setup.teams)), -1)
        self.told = np.zeros(setup.count, dtype=bool)

    def form(self, t: float, q: Array, formed: Formed, setup: SetupNow) -> Formed:
        """Move robots from one team to another; return the team with the vertices that they then have.

        Args:
            t: Time [s].
            q: Measured positions, shape (n, p) [m].
            formed: Who is lost, and has which vertex.
            setup: Gives the teams, and where their targets are.
        """
        place, speed = setup.obstacle_position, setup.obstacle_velocity  # true ones, even with a lidar
        speed = np.zeros_like(place) if speed is None else speed
        lost, moment = formed.lost, t + 0.5 * setup.timestep
        before, self.targets = self.targets, targets_at(setup, moment)
        others = np.array([now != then for now, then in zip(self.targets, before, strict=True)])
        self.radius = np.array([radius_at(setup, team, moment) for team in setup.teams])
        self.aimed[others] = round(t / setup.timestep)
        self.center = np.array([place[each].mean(axis=0) for each in self.targets])
        self.velocity = np.array([speed[each].mean(axis=0) for each in self.targets])
        changed = {*self.members[lost & ~self._missed].tolist()}
        self._missed = lost
        needed = [
            ([0] + [each.robots for each in team.demand if each.after <= moment])[-1] for team in setup.teams
        ]
        left = [int((~lost & (self.members == number)).sum()) for number in range(len(setup.teams))]
        start, self.members = self.members, self.members.copy()
        for number, demand in enumerate(needed):
            while left[number] < demand:
                can = np.array([left[k] > max(needed[k], 1) for k in range(len(left))])
                spare = can[self.members] & (self.members != number) & ~lost
                if not spare.any():
                    break
                away = np.where(spare, np.linalg.norm(q - self.center[number], axis=1), np.inf)
                robot = int(away.argmin())
                other = int(self.members[robot])
                left[other], left[number] = left[other] - 1, left[number] + 1
                changed |= {other, number}
                self.members[robot] = number
        self.told = (self.members != start) | others[self.members]
        self.formed[[*changed]] = round(t / setup.timestep)
        if setup.reforming is None:
            return formed
        vertices = formed.vertices.copy()
        for number in sorted(changed):
            here = (self.members == number) & ~lost
            if here.any():
                offset = q[here] - self.center[number]
                turns = np.concatenate([self.rotation[here][:1], setup.reforming.turns])
                points = setup.reforming.figures[len(q) - left[number] - 1]
                away = np.linalg.norm(offset, axis=1, keepdims=True)
                vertices[here], self.rotation[here] = placed(points, offset / away, turns), np.eye(setup.axes)
        return replace(formed, vertices=vertices)

    def turn(self, q: Array, formed: Formed) -> None:
        """Let the figure of each team turn to fit its members; arguments as of `form`."""
        for i in np.flatnonzero(~formed.lost).tolist():
            here = (self.members == self.members[i]) & ~formed.lost
            center = self.center[self.members[i]]
            self.rotation[i] = turned_rotation(self.rotation[i], q[here], center, formed.vertices[here])


def targets_at(setup: Setup, time: float) -> list[list[int]]:
    """Return which obstacles the targets of each team are at a time [s], in the order of obstacles."""
    numbers = {team.name: number for number, team in enumerate(setup.teams)}
    now: dict[int, int] = {}
    for number, (team, places) in enumerate(zip(setup.teams, setup.target_places, strict=True)):
        for place, target in zip(places, team.targets, strict=True):
            later = [numbers.get(each.team, -1) for each in target.escorted_by if each.after <= time]
            now[place] = [number, *later][-1]
    return [[place for place, owner in now.items() if owner == number] for number in numbers.values()]
