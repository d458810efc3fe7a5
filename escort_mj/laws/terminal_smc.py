"""Nonsingular fast terminal sliding mode: the error is gone in finite time, without a singularity."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.laws.sliding import SlidingModeLaw, switching
from escort_mj.native.lanes import copysign, root
from escort_mj.native.values import Values


class TerminalSmc(SlidingModeLaw):
    """The law of Yang and Yang (2011), on the surface z = e + a |e|^2 sgn(e) + b |e_dot|^(3/2) sgn(e_dot).

    On z = 0, the error vanishes in finite time: the squared error speeds up convergence at large errors, the
    power 3/2 of the velocity error at small ones. The equivalent part m |e_dot|^(1/2) sgn(e_dot) (1 + 2 a
    |e|) / (3/2 b) contains no negative power and is not singular at e = 0. m is an assumed mass; the reaching
    terms, those with z and sgn(z), compensate for the error in m. The recorded `s`, which anti-windup uses,
    remains e_dot + slope * e.

    Yang, L.; Yang, J. Nonsingular fast terminal sliding-mode control for nonlinear dynamical systems. Int. J.
    Robust Nonlinear Control 2011, 21, 1865-1879, doi 10.1002/rnc.1666.
    """

    own_keys: ClassVar[frozenset[str]] = frozenset({"switching_gain", "boundary_layer"})

    title: ClassVar[str] = "terminal sliding mode"
    law: Literal["terminal_smc"] = "terminal_smc"
    boundary_layer: PositiveFloat = 0.05
    """Half-width of the zone around z = 0 in which sgn(z) is smoothed [m]."""
    far_gain: NonNegativeFloat = 1.0
    """Weight a of the squared error in z [1/m]."""
    near_gain: PositiveFloat = 0.5
    """Weight b of the velocity error in z [s^(3/2) / m^(1/2)]."""
    nominal_mass: PositiveFloat = 1.0
    """Mass m that the law assumes [kg]."""
    reaching_gain: NonNegativeFloat = 60.0
    """Gain of z [N/m]."""
    switching_gain: NonNegativeFloat = 6.0
    """Gain of the approximation of sgn(z) [N]."""

    def force(self, r: Values) -> Any:
        """Return tau = m |e'|^(1/2) sgn(e') (1 + 2 a |e|) / (3/2 b) + k z + k_s sgn(z)."""
        size, speed = abs(r.e), root(abs(r.e_dot))
        z = r.e + self.far_gain * size * r.e + self.near_gain * speed * r.e_dot
        equivalent = copysign(speed, r.e_dot) * (1.0 + 2.0 * self.far_gain * size) / (1.5 * self.near_gain)
        tau = self.nominal_mass * equivalent + self.reaching_gain * z
        return tau + self.switching_gain * switching(self, z)
