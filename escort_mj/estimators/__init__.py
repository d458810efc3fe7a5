"""Estimators, one file each: what robots make of what they see and hear. Any file that has one is found."""

from escort_mj.components.found import found_in
from escort_mj.estimators.belief import Belief, Witness
from escort_mj.estimators.consensus import Consensus
from escort_mj.estimators.covariance_intersection import CovarianceIntersection
from escort_mj.estimators.estimator import Estimator
from escort_mj.estimators.hold import Hold
from escort_mj.estimators.kalman import Kalman
from escort_mj.estimators.predict import Predict

ESTIMATORS: tuple[type[Estimator], ...] = found_in(__name__, __path__, Estimator)

__all__ = [
    "Belief",
    "ESTIMATORS",
    "Consensus",
    "CovarianceIntersection",
    "Estimator",
    "Hold",
    "Kalman",
    "Predict",
    "Witness",
]
