"""A Kalman filter on each robot, and a consensus with its neighbors on what they believe."""

from typing import Annotated, Literal

from pydantic import Field

from escort_mj.estimators.belief import Belief, Witness
from escort_mj.estimators.covariance_intersection import CovarianceIntersection


class Consensus(CovarianceIntersection):
    """A Kalman filter on each robot, and consensus with teammates in range (Battistelli, Chisci 2014).

    Each message moves the receiver's belief by a fixed share toward the sender's, in the sense of the
    Kullback-Leibler average: covariance intersection with a weight that does not depend on which belief is
    more certain.
    """

    estimator: Literal["consensus"] = "consensus"  # type: ignore[assignment]
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.3
    """Weight of the sender's belief [1]."""

    def hears(self, r: Witness) -> Belief:
        """Return the belief of now, moved toward that of the message."""
        own, other = r.belief.at(r.time, self.density), r.heard.at(r.time, self.density)
        return own.mixed(other, 1.0 - self.share)
