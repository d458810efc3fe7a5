"""The newest measurement that a robot has made or heard of, moved on with its velocity."""

from typing import ClassVar, Literal

from escort_mj.estimators.hold import Hold


class Predict(Hold):
    """Use the newest measurement that a robot has made or heard, extrapolated at the measured velocity."""

    predicts: ClassVar[bool] = True
    estimator: Literal["predict"] = "predict"  # type: ignore[assignment]
