"""Base of estimators: what a robot makes of what it sees and hears of the target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from escort_mj.components.component import Component
from escort_mj.knowledge.belief import Belief
from escort_mj.knowledge.sight import MEASURES, Look

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


class Estimator(Component):
    """What a robot makes of what it sees and hears of the target.

    A subclass has a key `estimator` with its name, parameters, and two equations: what a measurement does to
    a belief (`seen`), and what the belief of a teammate does (`heard`). Each stands beside its compiled form,
    which changes the rows `belief...` of one robot.
    """

    predicts: ClassVar[bool] = True
    """Whether the estimate moves on with the velocity between two measurements."""
    needs: ClassVar[tuple[tuple[str, ...], ...]] = tuple((name,) for name in MEASURES if name != "velocity")
    """Sets of quantities of which one has to be measured."""
    has_covariance: ClassVar[bool] = True
    """Whether it says how sure it is."""

    estimator: str

    @property
    def orders(self) -> int:
        """How many derivatives of the position a belief has, the position among them: 2 or 3."""
        return 2

    @property
    def density(self) -> float:
        """Spectral density of the noise that changes the last of them."""
        return 0.0

    def seen(self, belief: Belief, look: Look, time: float) -> Belief:
        """Return the belief after a measurement.

        Args:
            belief: Before it.
            look: What the robot measures.
            time: Now [s].
        """
        raise NotImplementedError

    def heard(self, belief: Belief, said: Belief, time: float) -> Belief:
        """Return the belief after a teammate has been heard.

        Args:
            belief: Before that.
            said: What the teammate believed when it sent the message.
            time: Now [s].
        """
        raise NotImplementedError

    def see_kernel(self: Any, i: int, plan: Plan, state: State) -> None:
        """Change the belief of robot i by what it has measured, compiled."""
        raise NotImplementedError

    def hear_kernel(self: Any, i: int, message: int, plan: Plan, state: State) -> None:
        """Change the belief of robot i by a message, a row of `sent_...`, compiled."""
        raise NotImplementedError
