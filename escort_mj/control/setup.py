"""Everything that the controller is given of a mission, before it is packed for the compiled kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass

from escort_mj.behaviors import Behavior
from escort_mj.components.setup import MissionSetup
from escort_mj.control.outer_loops import Nsb, OuterLoop
from escort_mj.control.trigger import Trigger
from escort_mj.disturbances import Disturbance
from escort_mj.estimators import Estimator, Hold
from escort_mj.failures import Failure
from escort_mj.knowledge.sight import Sight
from escort_mj.laws import Law
from escort_mj.radios import Radio
from escort_mj.sensing.sensors import Sensors


@dataclass(frozen=True, kw_only=True)
class Setup(MissionSetup):
    """The controller's knowledge, and the disturbances and noise that the plant adds around it."""

    behaviors: tuple[Behavior, ...]
    law: Law
    laws: tuple[Law, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()
    outer: OuterLoop = Nsb()
    trigger: Trigger | None = None
    failures: tuple[Failure, ...] = ()
    sensing: Sensors = Sensors()
    sight: Sight | None = None
    radio: Radio | None = None
    estimator: Estimator = Hold()

    @property
    def faces(self) -> bool:
        """Whether it matters which way robots look."""
        return self.sensing.heading is not None or (self.sight is not None and self.sight.field < math.inf)
