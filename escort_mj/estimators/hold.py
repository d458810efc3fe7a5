"""The newest measurement that a robot has made or heard of, as it was."""

from typing import ClassVar, Literal

from escort_mj.estimators.belief import Belief, Witness
from escort_mj.estimators.estimator import Estimator


class Hold(Estimator):
    """Use the newest measurement that a robot has made or heard, unchanged."""

    predicts: ClassVar[bool] = False
    needs: ClassVar[tuple[tuple[str, ...], ...]] = (("position", "velocity"),)
    has_covariance: ClassVar[bool] = False
    estimator: Literal["hold"] = "hold"

    def sees(self, r: Witness) -> Belief:
        """Return what is measured."""
        return r.believe(r.seen_position, r.seen_velocity)
