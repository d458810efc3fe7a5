"""A filter with fixed gains: no covariance, two numbers to choose."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.estimators.belief import Belief, Witness
from escort_mj.estimators.estimator import Estimator


class FixedGain(Estimator):
    """Correct position and velocity by fixed shares of the error (alpha-beta filter).

    Between two looks the target keeps its velocity. For a steady rate of looks, a Kalman filter of a constant
    velocity comes to such shares (Kalata 1984). What is heard and newer replaces the belief.
    """

    needs: ClassVar[tuple[tuple[str, ...], ...]] = (("position",),)
    has_covariance: ClassVar[bool] = False
    estimator: Literal["fixed_gain"] = "fixed_gain"
    alpha: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    """Share of the error by which a look corrects the position [1]."""
    beta: Annotated[float, Field(gt=0.0, le=1.0)] = 0.005
    """Share of the error, per time between two looks, by which it corrects the velocity [1]."""

    def sees(self, r: Witness) -> Belief:
        """Return the belief, moved on and corrected by what is seen."""
        elapsed = r.time - r.belief.time
        ahead = r.belief.position + elapsed * r.belief.velocity
        error = r.seen_position - ahead
        faster = self.beta / elapsed * error if elapsed > 0.0 else 0.0 * error
        return r.believe(ahead + self.alpha * error, r.belief.velocity + faster)
