"""PD with gravity compensation from the model: the plainest baseline."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.control.laws.tracking import Gains, TrackingLaw


class Pd(TrackingLaw):
    """PD and the model's bias force: tau = k_p e + k_d e_dot + g (Takegaki and Arimoto 1981).

    The bias force is MuJoCo's own, exact: gravity and what velocities add (Coriolis, centrifugal). Nothing
    in the law knows of disturbances, so a constant push leaves an error of push / k_p.
    """

    needs_model: ClassVar[bool] = True

    law: Literal["pd"] = "pd"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m]."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m]."""

    def gains(self) -> Gains:
        """k_p and k_d."""
        return Gains(self.proportional_gain, self.derivative_gain, 0.0, 0.0, 0.0)
