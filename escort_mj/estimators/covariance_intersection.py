"""A Kalman filter on each robot, and what teammates believe mixed in by covariance intersection."""

from typing import Literal

from escort_mj.estimators.belief import Belief, Witness
from escort_mj.estimators.kalman import Kalman


class CovarianceIntersection(Kalman):
    """A Kalman filter on each robot, and covariance intersection of beliefs (Julier, Uhlmann 1997).

    Two beliefs with the covariances P_1 and P_2 are fused into one with the covariance P, where P^-1 = w
    P_1^-1 + (1 - w) P_2^-1. P is consistent whatever information the two beliefs share; w follows from the
    traces of P_1 and P_2 (Niehsen 2002).
    """

    estimator: Literal["covariance_intersection"] = "covariance_intersection"  # type: ignore[assignment]

    def hears(self, r: Witness) -> Belief:
        """Return the mixture of two beliefs of now."""
        own, other = r.belief.at(r.time, self.density), r.heard.at(r.time, self.density)
        return own.mixed(other, other.spread / (own.spread + other.spread))
