"""Base of estimators: what a robot makes of what it sees and hears of the target."""

import math
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple, Self

from pydantic import model_validator

from escort_mj.components.component import Component
from escort_mj.knowledge.sight import MEASURES
from escort_mj.native.fields import Array
from escort_mj.native.memory import layout_with


class EstimatorView(NamedTuple):
    """What an estimator sees of all robots, and what it writes: the belief of one; n robots, p axes.

    A belief has k numbers: the target's position, its velocity and, for an estimator of it, acceleration.
    """

    timestep: float  # [s]
    way_variance: float  # of the way to the target, per axis; for a bearing, over the squared range [m^2]
    time: Annotated[Array, 1]  # [s]
    message: Annotated[Array, 1]  # row of `sent_...` that the robot hears; -1 while it sees the target
    q_measured: Annotated[Array, "n", "p"]  # measured position [m]
    v_measured: Annotated[Array, "n", "p"]  # measured velocity [m/s]
    seen_position: Annotated[Array, "informed", "p"]  # measured position of the target [m]
    seen_velocity: Annotated[Array, "informed", "p"]  # likewise [m/s]
    seen_range: Annotated[Array, "informed"]  # likewise: distance of the centers [m]
    seen_bearing: Annotated[Array, "informed", "p"]  # likewise: direction, a unit vector
    sight_variance: Annotated[Array, 4]  # of these four, per axis; -1 for what is not measured
    sent_belief: Annotated[Array, "hearing*depth", "believed"]  # of the sender, when it sent the message
    sent_covariance: Annotated[Array, "hearing*depth", "believed*believed"]
    sent_belief_time: Annotated[Array, "hearing*depth"]  # at which that held [s]
    sent_fix: Annotated[Array, "hearing*depth"]  # time of the newest measurement in it [s]
    belief: Annotated[Array, "informed", "believed"]  # written [m, m/s, m/s^2]
    belief_covariance: Annotated[Array, "informed", "believed*believed"]  # written: of these, row by row
    belief_time: Annotated[Array, "informed"]  # written: at which they hold [s]
    belief_fix: Annotated[Array, "informed"]  # written: time of the newest measurement in it [s]
    belief_work: Annotated[Array, 3, "believed*believed"]  # scratch


class Estimator(Component):
    """What a robot makes of what it sees and hears of the target.

    A subclass has a key `estimator` with its name, parameters, and its method `update`. That is
    called for a robot when it sees the target, and when it hears a teammate; it writes the robot's rows
    of the arrays `belief...`.
    """

    method: ClassVar[str] = "update"
    view: ClassVar[type] = EstimatorView
    outputs: ClassVar[tuple[str, ...]] = ("belief", "belief_covariance", "belief_time", "belief_fix")
    scratch: ClassVar[tuple[str, ...]] = ("belief_work",)
    answers: ClassVar[str | None] = ""
    gives: ClassVar[str] = "robot {} a belief"
    predicts: ClassVar[bool] = True
    """Whether the estimate moves on with the velocity between two measurements."""
    needs: ClassVar[tuple[tuple[str, ...], ...]] = tuple((name,) for name in MEASURES if name != "velocity")
    """Sets of quantities of which one has to be measured."""
    has_covariance: ClassVar[bool] = True
    """Whether it says how sure it is."""

    estimator: str

    @model_validator(mode="after")
    def _has_a_belief(self) -> Self:
        if self.orders not in (2, 3) or not 0.0 <= self.density < math.inf:
            words = f"found orders = {self.orders!r} and density = {self.density!r}"
            raise ValueError(f"{words}; expected 2 or 3 orders and a density of at least 0")
        return self

    @property
    def orders(self) -> int:
        """How many derivatives of the position a belief has, the position among them: 2 or 3."""
        return 2

    @property
    def density(self) -> float:
        """Spectral density of the noise that changes the last of them."""
        return 0.0

    if TYPE_CHECKING:

        def update(self, view: EstimatorView, robot: int) -> None:
            """Change the belief of a robot by what it sees or hears.

            Args:
                view: What it sees or hears, and what it believes.
                robot: Its number, from 0.
            """


def estimator_view(plan: int, state: int, axes: int) -> EstimatorView:
    """View what estimators see at the addresses of a plan and a state; nothing is copied or owned."""
    view: EstimatorView = layout_with(EstimatorView).read(EstimatorView, plan, state)
    return view
