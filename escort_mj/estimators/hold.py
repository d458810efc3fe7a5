"""The newest measurement that a robot has made or heard of, as it was."""

from typing import Any, ClassVar, Literal

from escort_mj.estimators.estimator import Estimator, EstimatorView


class Hold(Estimator):
    """Use the newest measurement that a robot has made or heard, unchanged."""

    predicts: ClassVar[bool] = False
    needs: ClassVar[tuple[tuple[str, ...], ...]] = (("position", "velocity"),)
    has_covariance: ClassVar[bool] = False
    estimator: Literal["hold"] = "hold"

    def update(self: Any, view: EstimatorView, robot: int) -> None:
        """Take over what is measured, or heard and newer."""
        heard, p = int(view.message[0]), view.q_measured.shape[1]
        if heard < 0:
            for k in range(p):
                view.belief[robot, k] = view.seen_position[robot, k]
                view.belief[robot, p + k] = view.seen_velocity[robot, k]
            view.belief_time[robot] = view.belief_fix[robot] = view.time[0]
        elif view.sent_fix[heard] > view.belief_fix[robot]:
            for k in range(view.belief.shape[1]):
                view.belief[robot, k] = view.sent_belief[heard, k]
            view.belief_time[robot] = view.sent_belief_time[heard]
            view.belief_fix[robot] = view.sent_fix[heard]
