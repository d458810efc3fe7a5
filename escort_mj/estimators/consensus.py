"""A Kalman filter on each robot, and a consensus with its neighbors on what they believe."""

from typing import Annotated, Any, Literal

from pydantic import Field

from escort_mj.estimators.covariance_intersection import CovarianceIntersection, mix
from escort_mj.estimators.estimator import EstimatorView
from escort_mj.estimators.kalman import hear, see


class Consensus(CovarianceIntersection):
    """A Kalman filter on each robot, and consensus with teammates in range (Battistelli, Chisci 2014).

    Each message moves the receiver's belief by a fixed share toward the sender's, in the sense of the
    Kullback-Leibler average: covariance intersection with a weight that does not depend on which belief is
    more certain.
    """

    estimator: Literal["consensus"] = "consensus"  # type: ignore[assignment]
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.3
    """Weight of the sender's belief [1]."""

    def update(self: Any, view: EstimatorView, robot: int) -> None:
        """Correct the belief by what is measured, or move it toward that of a message, compiled."""
        density, own, spare = self.noise * self.noise, view.belief_covariance[robot], view.belief_work[2]
        if view.message[0] < 0:
            see(robot, density, view)
            return
        x, covariance = hear(robot, density, view)
        mix(view.belief[robot], own, x, covariance, 1.0 - self.share, spare)
