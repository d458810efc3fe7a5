"""A filter with fixed gains: no covariance, two numbers to choose."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.estimators.estimator import Estimator, EstimatorView


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

    def update(self: Any, view: EstimatorView, robot: int) -> None:
        """Correct the belief by what is seen, or take over what is heard and newer."""
        heard, p, belief = int(view.message[0]), view.q_measured.shape[1], view.belief[robot]
        if heard >= 0:
            if view.sent_fix[heard] > view.belief_fix[robot]:
                for k in range(2 * p):
                    belief[k] = view.sent_belief[heard, k]
                view.belief_time[robot] = view.sent_belief_time[heard]
                view.belief_fix[robot] = view.sent_fix[heard]
            return
        elapsed = view.time[0] - view.belief_time[robot]
        for k in range(p):
            ahead = belief[k] + elapsed * belief[p + k]
            error = view.seen_position[robot, k] - ahead
            belief[k] = ahead + self.alpha * error
            if elapsed > 0.0:
                belief[p + k] += self.beta / elapsed * error
        view.belief_time[robot] = view.belief_fix[robot] = view.time[0]
