"""Everything that the controller is given of a mission, before it is packed for the compiled kernel."""

from __future__ import annotations

from dataclasses import dataclass

from escort_mj.behaviors import Behavior
from escort_mj.components.setup import MissionSetup
from escort_mj.control.outer_loops import Nsb, OuterLoop
from escort_mj.control.trigger import Trigger
from escort_mj.disturbances import Disturbance
from escort_mj.estimators import Estimator, Hold
from escort_mj.failures import Failure
from escort_mj.knowledge.sight import TargetSight
from escort_mj.laws import Law
from escort_mj.radios import Radio
from escort_mj.sensing.sensors import Sensors


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Setup(MissionSetup):
    """The controller's knowledge, and the disturbances and noise that the plant adds around it."""

    behaviors: tuple[Behavior, ...]
    law: Law
    laws: tuple[Law, ...] = ()
    team_laws: tuple[int, ...] = ()
    own_laws: tuple[int, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()
    outer: OuterLoop = Nsb.model_construct()
    trigger: Trigger | None = None
    failures: tuple[Failure, ...] = ()
    sensing: Sensors = Sensors()
    sight: TargetSight | None = None
    radio: Radio | None = None
    estimator: Estimator = Hold.model_construct()

    @property
    def field_of_view(self) -> float | None:
        """Opening angle of the cone in which robots see the target [rad]; None for all around."""
        return None if self.sight is None else self.sight.field_of_view

    @property
    def faces(self) -> bool:
        """Whether it matters which way robots look."""
        return self.sensing.heading is not None or self.field_of_view is not None
