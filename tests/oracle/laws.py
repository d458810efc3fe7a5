"""The laws as equations between arrays (eqs. 9, 10, 17)."""

from __future__ import annotations

from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.views import LawView
from escort_mj.laws.apd_smc import ApdSmc
from escort_mj.laws.asmc import Asmc
from escort_mj.laws.computed_torque import ComputedTorque
from escort_mj.laws.disturbance_observer import DisturbanceObserver
from escort_mj.laws.law import Law
from escort_mj.laws.pd import Pd
from escort_mj.laws.pd_smc import PdSmc
from escort_mj.laws.sliding import SlidingModeLaw
from escort_mj.laws.super_twisting import SuperTwisting
from escort_mj.laws.terminal_smc import TerminalSmc

Array = NDArray[np.float64]


@singledispatch
def force(law: Law, robots: LawView) -> None:
    """Write the force of a law, and the rates of what it integrates."""
    law.force(robots)  # type: ignore[attr-defined]


@force.register
def _force_of_disturbance_observer(law: DisturbanceObserver, robots: LawView) -> None:
    """Write PD less z + p of the step before, and z' = -L (z + p + tau), p = L m v (Chen et al. 2000)."""
    estimate, z = robots.component_memory
    p = law.bandwidth * law.mass * robots.v_measured
    robots.tau[:] = law.proportional_gain * robots.e + law.derivative_gain * robots.e_dot - estimate
    limits = np.reshape(robots.force_limits, (len(z), -1))
    given = np.clip(robots.tau, -limits, limits)
    robots.component_rate[0] = (z + p - estimate) / robots.timestep
    robots.component_rate[1] = -law.bandwidth * (z + p + given)


def switching(law: SlidingModeLaw, s: Array) -> Array:
    """Return what stands for sgn(s) in eq. 9: tanh (eq. 17), a clipped line, or the sign itself."""
    if law.smoothing == "sign":
        return np.sign(s)
    x = s / law.boundary_layer
    return np.tanh(x) if law.smoothing == "tanh" else np.clip(x, -1.0, 1.0)


@force.register
def _force_of_apd_smc(law: ApdSmc, robots: LawView) -> None:
    """Write eq. 9, tau = rho_hat + k_p e + k_d e_dot + k sgn(s), and eq. 10, d rho_hat/dt = mu s."""
    pd = law.proportional_gain * robots.e + law.derivative_gain * robots.e_dot
    robots.tau[:] = robots.rho_hat + pd + law.switching_gain * switching(law, robots.s)
    robots.rho_hat_rate[:] = law.adaptation_rate * robots.s


@force.register
def _force_of_asmc(law: Asmc, robots: LawView) -> None:
    """Write tau = rho_hat + k_a sgn(s), d rho_hat/dt = mu s: eq. 9 without its PD part."""
    robots.tau[:] = robots.rho_hat + law.switching_gain * switching(law, robots.s)
    robots.rho_hat_rate[:] = law.adaptation_rate * robots.s


@force.register
def _force_of_computed_torque(law: ComputedTorque, robots: LawView) -> None:
    """Write tau = M (a_d + k_v e_dot + k_p e) + bias."""
    n, p = robots.e.shape
    wanted = robots.v_d_rate + law.velocity_gain * robots.e_dot + law.position_gain * robots.e
    mass = robots.model_mass.reshape(n, p, p)
    robots.tau[:] = np.einsum("iab,ib->ia", mass, wanted) + robots.model_bias


@force.register
def _force_of_pd(law: Pd, robots: LawView) -> None:
    """Write tau = k_p e + k_d e_dot + bias."""
    robots.tau[:] = law.proportional_gain * robots.e + law.derivative_gain * robots.e_dot
    robots.tau[:] += robots.model_bias


@force.register
def _force_of_pd_smc(law: PdSmc, robots: LawView) -> None:
    """Write tau = k_p e + k_d e_dot + k sgn(s): eq. 9 with the estimate held at 0."""
    pd = law.proportional_gain * robots.e + law.derivative_gain * robots.e_dot
    robots.tau[:] = pd + law.switching_gain * switching(law, robots.s)


@force.register
def _force_of_super_twisting(law: SuperTwisting, robots: LawView) -> None:
    """Write tau = k_1 |s|^(1/2) sgn(s) + w and w' = k_2 sgn(s), with w in `rho_hat`."""
    sign = switching(law, robots.s)
    robots.tau[:] = law.root_gain * np.sqrt(np.abs(robots.s)) * sign + robots.rho_hat
    robots.rho_hat_rate[:] = law.integral_gain * sign


@force.register
def _force_of_terminal_smc(law: TerminalSmc, robots: LawView) -> None:
    """Write tau = m |e'|^(1/2) sgn(e') (1 + 2 a |e|) / (3/2 b) + k z + k_s sgn(z)."""
    e, e_dot = robots.e, robots.e_dot
    size, speed = np.abs(e), np.sqrt(np.abs(e_dot))
    z = e + law.far_gain * size * e + law.near_gain * speed * e_dot
    equivalent = np.sign(e_dot) * speed * (1.0 + 2.0 * law.far_gain * size) / (1.5 * law.near_gain)
    robots.tau[:] = law.nominal_mass * equivalent + law.reaching_gain * z
    robots.tau[:] += law.switching_gain * switching(law, z)
