"""PD with gravity compensation from the model: the plainest baseline."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.laws.law import Law
from escort_mj.native.values import Values


class Pd(Law):
    """PD control plus the model's bias force g: tau = k_p e + k_d e_dot + g (Takegaki and Arimoto 1981).

    The bias force is exact: MuJoCo's gravity, Coriolis and centrifugal forces. The law does not compensate
    for disturbances: a constant force leaves an error of force / k_p.
    """

    needs_model: ClassVar[bool] = True

    title: ClassVar[str] = "PD, gravity compensated"
    law: Literal["pd"] = "pd"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain k_p of the position error [N/m]."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain k_d of the velocity error [N s/m]."""

    def force(self, r: Values) -> Any:
        """Return tau = k_p e + k_d e_dot + bias."""
        return self.proportional_gain * r.e + self.derivative_gain * r.e_dot + r.bias
