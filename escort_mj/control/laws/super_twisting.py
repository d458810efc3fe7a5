"""Super-twisting: a second-order sliding mode, continuous where first-order ones switch."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.control.laws.sliding import SlidingModeLaw
from escort_mj.control.laws.tracking import Gains
from escort_mj.kernels import inlined


class SuperTwisting(SlidingModeLaw):
    """The law of Levant (1993): tau = k_1 |s|^(1/2) sgn(s) + w, w' = k_2 sgn(s); `rho_hat` is w.

    With the sign itself s comes to 0 in finite time and stays there if the force that the law does not know
    changes by less than k_2 per second and k_1^2 is large against mass times k_2. That force holds the term
    mass * slope * s, so `slope` is smaller here than in the other laws: k_1 must outgrow it wherever s gets.
    """

    own_keys: ClassVar[frozenset[str]] = frozenset({"slope", "smoothing", "boundary_layer"})

    law: Literal["super_twisting"] = "super_twisting"
    slope: PositiveFloat = 2.0
    """Slope of s = e_dot + slope * e [1/s]."""
    smoothing: Literal["tanh", "saturation", "sign"] = "sign"
    """What stands for sgn(s); the sign itself already gives a continuous force."""
    root_gain: NonNegativeFloat = 6.0
    """Gain of the root of s [N (s/m)^(1/2)] (k_1)."""
    integral_gain: NonNegativeFloat = 4.0
    """Rate of the integral term [N/s] (k_2)."""

    def gains(self) -> Gains:
        """k_1 stands for the switching gain, k_2 for the rate of the estimate."""
        return Gains(0.0, 0.0, self.root_gain, self.integral_gain, 0.0)


@inlined
def twist(s: float, switched: float, k1: float) -> float:
    """The continuous term k_1 |s|^(1/2) sgn(s), given what stands for sgn(s) [N]."""
    return k1 * math.sqrt(abs(s)) * switched
