"""The opponents' side of a mission: what they perceive and are asked, commanded from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.opponents import COMES, INTERCEPTED, REACHED
from escort_mj.errors import UsageError
from escort_mj.policies.learned import inputs, perceived, within_speed
from escort_mj.policies.policy import PolicyView, policy_view
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]
Seen = NDArray[np.float32]


@dataclass(frozen=True)
class RivalReward:
    """What is asked of each opponent at each command while it comes, as weights of terms without units.

    Attributes:
        approach: Of how much nearer to the target it has come, in radii of the mission.
        reach: Of having reached the target.
        capture: Of having been intercepted.
        command: Of the mean square of the command.
    """

    approach: float = 1.0
    reach: float = 10.0
    capture: float = 10.0
    command: float = 0.001


class Rivals:
    """Opponents of one mission, o of them, each with a velocity that is wanted from outside.

    Attributes:
        count: o.
        width: How many numbers each perceives: those of the policy `learned`.
        observed: The same, shape (o, width).
        rewards: Of each for the last command, shape (o,).
        comes: Which are on their way, shape (o,).
        over: Which have been intercepted or have reached the target, shape (o,).
    """

    def __init__(self, plant: Plant, reward: RivalReward) -> None:
        """Prepare for a mission.

        Args:
            plant: Steps it; built with `opponents_outside`.
            reward: Weights of what is asked.

        Raises:
            UsageError: If it has no opponents.
        """
        setup, self._reward = plant.world.setup, reward
        if not setup.opponents:
            raise UsageError("opponents: found none; a side needs somebody who is on it")
        if setup.teams:
            raise UsageError("teams: found some; opponents are commanded where there is one target")
        movers = {mover.obstacle: (body, mover) for body, mover in enumerate(setup.movers)}
        found = [movers[opponent.obstacle] for opponent in setup.opponents]
        self._bodies = [body for body, _ in found]
        self._speed = np.array([mover.policy.speed if mover.policy else 1.0 for _, mover in found])
        self.count, self.width = len(found), inputs(setup.axes)
        self._state, (plan, memory) = plant.state, plant.addresses
        self._view: PolicyView = policy_view(plan, memory, setup.axes)
        self._commanded: Array = np.zeros((self.count, setup.axes))
        self._distance = np.zeros(self.count)
        self.observed: Seen = np.zeros((self.count, self.width), np.float32)
        self.rewards = np.zeros(self.count)
        self.comes, self.over = np.zeros(self.count, dtype=bool), np.zeros(self.count, dtype=bool)

    def command(self, commands: Array) -> None:
        """Say where opponents want to go; those that do not come are not asked.

        Args:
            commands: Shares of the speed of each one's policy, shape (o, p), cut off at the length 1.
        """
        self._commanded[:] = within_speed(np.asarray(commands, dtype=float))
        self._state.mover_wish[self._bodies] = self._speed[:, None] * self._commanded

    def perceive(self) -> None:
        """Find what opponents perceive now, and their rewards since the last time."""
        view, reward, status = self._view, self._reward, self._state.opponent_status.copy()
        for o, (body, speed) in enumerate(zip(self._bodies, self._speed, strict=True)):
            self.observed[o] = np.nan_to_num(perceived(view, body, float(speed)))
        distance = np.linalg.norm(view.target_position - view.mover_position[self._bodies], axis=1)
        nearer = np.nan_to_num((self._distance - distance) / view.radius)
        effort = np.mean(self._commanded**2, axis=1)
        on_the_way = np.where(self.comes, reward.approach * nearer - reward.command * effort, 0.0)
        ends = reward.reach * (status == REACHED) - reward.capture * (status == INTERCEPTED)
        self.rewards = on_the_way + np.where(self.over, 0.0, ends)
        self._distance, self.comes, self.over = distance, status == COMES, status > COMES
