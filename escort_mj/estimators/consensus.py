"""A Kalman filter on each robot, and a consensus with its neighbors on what they believe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from escort_mj.estimators.covariance_intersection import CovarianceIntersection, mix
from escort_mj.estimators.kalman import carried_message, move_belief
from escort_mj.knowledge.belief import Belief

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


class Consensus(CovarianceIntersection):
    """A Kalman filter on each robot, and a consensus with those that it hears (Battistelli, Chisci 2014).

    Each message moves the belief by a fixed share toward the sender's, in the sense of the Kullback-Leibler
    average: covariance intersection with a weight that does not depend on who is surer.
    """

    estimator: Literal["consensus"] = "consensus"  # type: ignore[assignment]
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.3
    """Weight of what is heard [1]."""

    def weight(self, own: Belief, other: Belief, axes: int) -> float:
        """Return the weight of a robot's own belief."""
        return 1.0 - self.share

    def hear_kernel(self: Any, i: int, message: int, plan: Plan, state: State) -> None:
        """Move the belief of robot i toward that of a message, compiled."""
        move_belief(i, self.noise * self.noise, state)
        x, covariance = carried_message(message, self.noise * self.noise, state)
        own, spare = state.belief_covariance[i], state.belief_work[2]
        mix(state.belief[i], own, x, covariance, 1.0 - self.share, spare)
        state.belief_fix[i] = max(state.belief_fix[i], state.sent_fix[message])
