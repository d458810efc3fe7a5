"""Super-twisting: a second-order sliding mode, continuous where first-order ones switch."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.laws.sliding import SlidingModeLaw, switching
from escort_mj.native.lanes import root
from escort_mj.native.values import Values


class SuperTwisting(SlidingModeLaw):
    """The law of Levant (1993): tau = k_1 |s|^(1/2) sgn(s) + w, w' = k_2 sgn(s); the signal `rho_hat` is w.

    With the exact sign, s reaches 0 in finite time and stays there, provided that the unknown force changes
    by less than k_2 per second and k_1^2 is large compared with mass times k_2. The unknown force includes
    the term mass * slope * s, which the term with k_1 must dominate for every s that occurs. The default of
    `slope` is therefore smaller than that of the other laws.
    """

    own_keys: ClassVar[frozenset[str]] = frozenset({"slope", "smoothing", "boundary_layer"})

    title: ClassVar[str] = "super-twisting"
    law: Literal["super_twisting"] = "super_twisting"
    slope: PositiveFloat = 2.0
    """Slope of s = e_dot + slope * e [1/s]."""
    smoothing: Literal["tanh", "saturation", "sign"] = "sign"
    """Approximation of sgn(s); `sign` already gives a continuous force."""
    root_gain: NonNegativeFloat = 6.0
    """Gain of the square root of |s| [N (s/m)^(1/2)] (k_1)."""
    integral_gain: NonNegativeFloat = 4.0
    """Rate of the integral term [N/s] (k_2)."""

    def force(self, r: Values) -> Any:
        """Return tau = k_1 |s|^(1/2) sgn(s) + w, with w in `rho_hat`."""
        return r.rho_hat + self.root_gain * root(abs(r.s)) * switching(self, r.s)

    def rho_hat_rate(self, r: Values) -> Any:
        """Return w' = k_2 sgn(s)."""
        return self.integral_gain * switching(self, r.s)
