"""Base of estimators: what a robot makes of what it sees and hears of the target."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

from pydantic import model_validator

from escort_mj.components.component import Derived
from escort_mj.components.equations import Answer, Call, Equations
from escort_mj.estimators.belief import Belief, EstimatorView, Witness, witness_of
from escort_mj.knowledge.sight import MEASURES
from escort_mj.native.lanes import copy_numbers
from escort_mj.native.values import names_of


class Estimator(Equations):
    """What a robot makes of what it sees and hears of the target.

    A subclass has a key `estimator` with its name, parameters, and the equations `sees(self, r)` and
    `hears(self, r)`, which return what the robot believes from now on: when it has seen the target, and when
    it hears a teammate.
    """

    plural: ClassVar[str] = "estimators"
    named_by: ClassVar[str] = "estimator"
    default_name: ClassVar[str | None] = "predict"
    method: ClassVar[str] = "sees"
    view: ClassVar[type] = EstimatorView
    outputs: ClassVar[tuple[str, ...]] = ("belief", "belief_covariance", "belief_time", "belief_fix")
    scratch: ClassVar[tuple[str, ...]] = ("belief_made", "covariance_made", "beliefs_made", "belief_work")
    answers: ClassVar[str | None] = ""
    gives: ClassVar[str] = "robot {} a belief"
    asks: ClassVar[tuple[str, ...]] = ("sees", "hears")
    reads: ClassVar[tuple[tuple[str, str], ...]] = tuple((name, name) for name in names_of(Witness))
    keeps: ClassVar[str] = ""
    predicts: ClassVar[bool] = True
    """Whether the estimate moves on with the velocity between two measurements."""
    needs: ClassVar[tuple[tuple[str, ...], ...]] = tuple((name,) for name in MEASURES if name != "velocity")
    """Sets of quantities of which one has to be measured."""
    has_covariance: ClassVar[bool] = True
    """Whether it says how sure it is."""

    estimator: str

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield which measurements it needs, if these are unknown."""
        sets: Any = cls.needs
        known = sets if isinstance(sets, tuple) else ()
        if not known or not all(isinstance(each, tuple) and {*each} <= {*MEASURES} for each in known):
            yield "needs", f'sets of {", ".join(MEASURES)}, as in (("position",),)'

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

    @Derived
    def density(self) -> float:
        """Return the spectral density of the noise that changes the last of them."""
        return 0.0

    def sees(self, r: Witness) -> Belief:
        """Return what the robot believes now that it has seen the target.

        Args:
            r: The robot: `belief`, `seen_position`, `time` and more.
        """
        raise NotImplementedError

    def hears(self, r: Witness) -> Belief:
        """Return what it believes now that it hears a teammate; by default the newer of both beliefs.

        Args:
            r: The robot: `belief`, `heard` and more.
        """
        return r.heard if r.heard.fix > r.belief.fix else r.belief

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what changes the belief of a robot: `(parameters, view, robot)`."""
        sees, hears, matrices = equations["sees"], equations["hears"], int(cls.has_covariance)

        def update(parameters: Any, view: Any, robot: int) -> None:
            view.beliefs_made[0] = 0.0
            r = witness_of(robot, view)
            found = sees(parameters, r) if view.message[0] < 0.0 else hears(parameters, r)
            copy_numbers(found.x, view.belief[robot], view.belief.shape[1])
            size = matrices * view.belief_covariance.shape[1]
            copy_numbers(found.covariance, view.belief_covariance[robot], size)
            view.belief_time[robot], view.belief_fix[robot] = found.time, found.fix

        return update

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return."""
        return (Belief,), "a belief, such as r.believe(...) returns"
