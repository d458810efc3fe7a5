"""How the equations of a law become forces and rates: for eight axes in kernels, for all in Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from escort_mj.components.memory import RATE, keep_rate
from escort_mj.components.views import LawView
from escort_mj.laws.law import Law
from escort_mj.native.lanes import WIDTH, Lanes, everywhere, lane_numbers, least, pick, store
from escort_mj.native.values import Arrays, reader_of
from escort_mj.numerics import numpy_forms  # noqa: F401 (equations may use them)
from escort_mj.numerics.elementary import whole

Call = Callable[..., Any]


def evaluation_by(law: type[Law], made: Callable[[Call], Call], equations: Mapping[str, Call]) -> Call:
    """Return what gives force and rate of the estimate of eight axes: `(parameters, view, at)`.

    Args:
        law: The law.
        made: Makes a function callable in kernels.
        equations: What `law.equations()` returns, made so.
    """
    axes_at, force, rate = reader_of(law.names()), equations["force"], equations["rho_hat" + RATE]
    if "acceleration" not in equations:

        def evaluate(parameters: Any, view: Any, at: int) -> tuple[Lanes, Lanes]:
            r = axes_at(view, at)
            return everywhere(force(parameters, r)), everywhere(rate(parameters, r))

        return made(evaluate)
    acceleration = equations["acceleration"]

    def evaluate_with_mass(parameters: Any, view: Any, at: int) -> tuple[Lanes, Lanes]:
        r, (n, p) = axes_at(view, at), view.e.shape
        tau = everywhere(force(parameters, r))
        row = least(lane_numbers() + float(at), float(n * p - 1))  # past the last robot, its last axis again
        first = float(p) * whole((row - 0.5 * float(p - 1)) / float(p))  # of the robot's own axes
        for k in range(p):
            a = acceleration(parameters, axes_at(view, first + float(k)))
            tau = tau + pick(view.model_mass, row * float(p) + float(k)) * a
        return tau, everywhere(rate(parameters, r))

    return made(evaluate_with_mass)


def memory_by(law: type[Law], made: Callable[[Call], Call], equations: Mapping[str, Call]) -> Call:
    """Return what writes the rates of a law's own memory, for all robots: `(parameters, view)`.

    Arguments are those of `evaluation_by`.
    """
    axes_at = reader_of(law.names())

    def nothing(parameters: Any, view: Any) -> None:
        return

    def after(before: Call, row: int, rate: Call) -> Call:
        def write(parameters: Any, view: Any) -> None:
            before(parameters, view)
            for at in range(0, view.e.shape[0] * view.e.shape[1], WIDTH):
                store(view.rate_found, at, rate(parameters, axes_at(view, at)))
            keep_rate(view, row)

        return made(write)

    write = made(nothing)
    for row, name in enumerate(law.memories()):
        write = after(write, row, equations[name + RATE])
    return write


def array_evaluation(law: Law, view: LawView) -> Callable[[], None]:
    """Return what writes forces and rates of all robots, by the law's methods as Python.

    It raises a `TypeError` if a method returns no values.
    """
    r, tau, n, p = Arrays(view, law.names()), view.tau, *view.e.shape
    force, acceleration = law.force, law.acceleration
    has_mass = type(law).acceleration is not Law.acceleration
    rates = []
    if type(law).rho_hat_rate is not Law.rho_hat_rate:  # else whoever calls has written 0
        rates.append(("rho_hat" + RATE, law.rho_hat_rate, view.rho_hat_rate))
    for row, name in enumerate(law.memories()):
        written = view.component_rate[law.names().first_row(view) + row]
        rates.append((name + RATE, getattr(law, name + RATE), written))

    def evaluate() -> None:
        found = force(r)
        if found is None:
            raise TypeError("force returned None; expected values, such as those of r.e")
        np.copyto(tau, found)  # complex numbers are an error, which an assignment would take
        if has_mass:
            a = np.broadcast_to(acceleration(r), (n, p))
            tau[:] += np.einsum("iab,ib->ia", view.model_mass.reshape(n, p, p), a)
        for name, rate, written in rates:
            found = rate(r)
            if found is None:
                raise TypeError(f"{name} returned None; expected values, such as those of r.e")
            np.copyto(written, found)

    return evaluate
