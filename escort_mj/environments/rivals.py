"""The opponents' side of a mission: what they perceive and are asked, commanded from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.movers import COMES
from escort_mj.environments.senses import check_weights
from escort_mj.errors import UsageError
from escort_mj.memory.rivals import REWARD, SEEN, STATUS, WEIGHTS, rival_perception_of
from escort_mj.policies.learned import LARGEST, inputs, within_speed
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

    def __post_init__(self) -> None:
        check_weights(self)


class Rivals:
    """Opponents of one mission, o of them, each with a velocity that is wanted from outside.

    Attributes:
        count: o.
        width: How many numbers each perceives: those of the policy `learned`.
        limits: The largest size of each of them, shape (width,).
    """

    def __init__(self, plant: Plant, reward: RivalReward) -> None:
        """Prepare for a mission.

        Args:
            plant: Steps it; built with `opponents_outside`.
            reward: Weights of what is asked.

        Raises:
            UsageError: If it has no opponents.
        """
        setup = plant.world.setup
        if not setup.opponents:
            raise UsageError("opponents: found none; a side needs somebody who is on it")
        movers = {mover.obstacle: (body, mover) for body, mover in enumerate(setup.movers)}
        found = [movers[place] for place in setup.opponent_places]
        self._bodies = [body for body, _ in found]
        self._speed = np.array([[mover.policy.speed] for _, mover in found if mover.policy])
        self.count, self.width = len(found), inputs(setup.axes)
        self.limits: Seen = np.full(self.width, LARGEST, np.float32)
        self._plant, self._perceive = plant, rival_perception_of(setup.axes)
        weights = [getattr(reward, name) for name in WEIGHTS]
        self._arrays = (
            np.array(weights, dtype=float),
            np.zeros((self.count, setup.axes)),
            np.zeros((self.count, SEEN + self.width)),
        )
        _, self._commanded, self._found = self._arrays
        self._given = (*plant.addresses, *(each.ctypes.data for each in self._arrays))

    def command(self, commands: Array) -> None:
        """Say where opponents want to go; those that do not come are not asked.

        Args:
            commands: Shares of the speed of each one's policy, shape (o, p), cut off at the length 1.
        """
        self._commanded[:] = within_speed(np.asarray(commands, dtype=float))
        self._plant.state.mover_wish[self._bodies] = self._speed * self._commanded

    def perceive(self) -> None:
        """Find what opponents perceive now, and their rewards since the last time."""
        self._perceive(*self._given)

    def kept(self) -> tuple[Array, Array]:
        """Return copies of what is known of opponents since their last command, for `put`."""
        return self._commanded.copy(), self._found.copy()

    def put(self, kept: tuple[Array, Array]) -> None:
        """Take up what `kept` returned."""
        self._commanded[:], self._found[:] = kept

    @property
    def observed(self) -> Seen:
        """What each perceives, shape (o, width)."""
        return np.nan_to_num(self._found[:, SEEN:]).astype(np.float32)

    @property
    def rewards(self) -> Array:
        """Of each for the last command, shape (o,)."""
        return self._found[:, REWARD].copy()

    @property
    def comes(self) -> NDArray[np.bool_]:
        """Which are on their way, shape (o,)."""
        return np.asarray(self._found[:, STATUS] == COMES)

    @property
    def over(self) -> NDArray[np.bool_]:
        """Which have been intercepted or have reached the target, shape (o,)."""
        return np.asarray(self._found[:, STATUS] > COMES)
