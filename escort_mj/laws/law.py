"""Base of laws: what force each robot is to have, so that it follows the reference of the outer loop."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import PositiveFloat

from escort_mj.components.dispatch import in_turn
from escort_mj.components.equations import NUMBER, Call, Equations
from escort_mj.components.memory import RATE, keep_rate
from escort_mj.components.views import LAW_OUTPUTS, LawView
from escort_mj.native.lanes import WIDTH, Lanes, everywhere, lane_numbers, least, pick, store
from escort_mj.native.values import Arrays, Names, Values, reader_of
from escort_mj.numerics import numpy_forms  # noqa: F401 (equations may use them)
from escort_mj.numerics.elementary import whole

NAMES = (
    *((name, name) for name in ("timestep", "time", "q_measured", "v_measured", "q_d", "v_d")),
    *((name, name) for name in ("e", "e_dot", "s", "v_d_rate", "rho_hat")),
    *(("force_limit", "force_limits"), ("bias", "model_bias")),
)
"""What a law can read, and the fields of `LawView` that have it."""


class Law(Equations):
    """What force each robot is to have, so that it follows its reference.

    A subclass has a key `law` with its name, parameters, and equations between values, each of one axis of
    one robot: `force(self, r)` returns the force [N], `rho_hat_rate(self, r)` the rate of the estimate [N/s].
    Kernels evaluate them for eight axes at once; in Python, values are arrays of shape (n, p).

    What else a law integrates, it declares, as in `d_hat: ClassVar[Memory] = Memory("N", "disturbance")`,
    with the rate as `d_hat_rate(self, r)`; the value is `r.d_hat`.
    """

    plural: ClassVar[str] = "laws"
    named_by: ClassVar[str] = "law"
    default_name: ClassVar[str | None] = "apd_smc"
    method: ClassVar[str] = "force"
    view: ClassVar[type] = LawView
    outputs: ClassVar[tuple[str, ...]] = LAW_OUTPUTS
    scratch: ClassVar[tuple[str, ...]] = ("rate_found",)
    asks: ClassVar[tuple[str, ...]] = ("force", "rho_hat" + RATE)
    moves: ClassVar[str] = RATE
    reads: ClassVar[tuple[tuple[str, str], ...]] = NAMES
    keeps: ClassVar[str] = "component_memory"
    first: ClassVar[str] = "memory_row"
    needs_model: ClassVar[bool] = False
    """Whether it is given mass matrix and bias force."""
    has_lyapunov: ClassVar[bool] = False
    """Whether the proof's Lyapunov function V1 is this law's."""
    differentiates: ClassVar[bool] = False
    """Whether it is given the filtered derivative of v_d: it has a parameter `acceleration_filter`."""
    largest: ClassVar[float] = math.inf  # a run tells of a force that is not finite
    title: ClassVar[str] = ""
    """What tables and figures call it; by default its name."""
    own_keys: ClassVar[frozenset[str]] = frozenset()
    """Keys that mean another thing than in other laws."""

    slope: PositiveFloat = 20.0
    """Slope of s = e_dot + slope * e [1/s] (paper: gamma); anti-windup and the avoidance gain also use it."""
    anti_windup: bool = True
    """Whether to hold the estimate and move the reference with the robot while a motor is saturated and the
    law drives it further into saturation."""
    law: str

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield an acceleration that no mass matrix is there for."""
        if cls.acceleration is not Law.acceleration and not cls.needs_model:
            yield "acceleration", "the line  needs_model: ClassVar[bool] = True"

    def force(self, r: Values) -> Any:
        """Return the force [N].

        Args:
            r: What is measured, wanted and integrated: `e`, `e_dot`, `s`, `rho_hat` and more, see `NAMES`.
        """
        raise NotImplementedError

    def rho_hat_rate(self, r: Values) -> Any:
        """Return the rate of the estimate [N/s]; by default 0."""
        return 0.0

    def acceleration(self, r: Values) -> Any:
        """Return what the mass matrix is multiplied by and added to the force, if the law has it [m/s^2]."""
        raise NotImplementedError

    @classmethod
    def title_of(cls) -> str:
        """Return what tables and figures call the law."""
        return cls.title or str(cls.own_name())

    @classmethod
    def names(cls) -> Names:
        """Return by what names it reads values: those that it is given."""
        given, found = {"bias": cls.needs_model, "v_d_rate": cls.differentiates}, super().names()
        return found._replace(fields=tuple(pair for pair in found.fields if given.get(pair[0], True)))

    @classmethod
    def equations(cls) -> dict[str, Callable[..., Any]]:
        """Return its methods of values: the force, the rates, and the acceleration if it has one."""
        found = super().equations()
        if cls.acceleration is not Law.acceleration:
            found["acceleration"] = cls.acceleration
        return found

    @property
    def estimate_at_start(self) -> float:
        """What the loop integrates begins at `initial_estimate`, where the law has such a parameter [N]."""
        return float(getattr(self, "initial_estimate", 0.0))

    @property
    def filter_time(self) -> float:
        """Return the time constant of the filter of the differentiated v_d, where the law has one [s]."""
        return float(getattr(self, "acceleration_filter", 0.0))

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes forces and rates of all robots: `(parameters, view)`."""
        evaluate, write_memory = (by(cls, made, equations) for by in (evaluation_by, memory_by))

        def run(parameters: Any, view: Any) -> None:
            for at in range(0, view.e.shape[0] * view.e.shape[1], WIDTH):
                tau, rate = evaluate(parameters, view, at)
                store(view.tau, at, tau)
                store(view.rho_hat_rate, at, rate)
            write_memory(parameters, view)

        return run

    def over_arrays(self, view: LawView) -> Callable[[], None]:
        """Return what writes forces and rates of all robots, by the law's methods as Python.

        It raises a `TypeError` if a method returns no values.
        """
        r, tau, n, p = Arrays(view, self.names()), view.tau, *view.e.shape
        force, acceleration = self.force, self.acceleration
        has_mass = type(self).acceleration is not Law.acceleration
        rates = []
        if type(self).rho_hat_rate is not Law.rho_hat_rate:  # else whoever calls has written 0
            rates.append(("rho_hat" + RATE, self.rho_hat_rate, view.rho_hat_rate))
        for row, name in enumerate(self.memories()):
            written = view.component_rate[self.names().first_row(view) + row]
            rates.append((name + RATE, getattr(self, name + RATE), written))

        def evaluate() -> None:
            tau[:] = values(force(r), "force")
            if has_mass:
                a = np.broadcast_to(values(acceleration(r), "acceleration"), (n, p))
                tau[:] += np.einsum("iab,ib->ia", view.model_mass.reshape(n, p, p), a)
            for name, rate, written in rates:
                written[:] = values(rate(r), name)

        def values(found: Any, name: str) -> Any:
            shape = getattr(found, "shape", ())
            real = type(found) is np.ndarray and found.dtype.kind in "biuf"
            if shape in ((), (n, p)) and (real or isinstance(found, NUMBER[0])):
                return found
            said = f"{found!r:.80}" if shape in ((), (n, p)) else f"values of shape {shape}"
            raise TypeError(f"{name} returned {said}; expected values, such as those of r.e, or a number")

        return evaluate


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

    def writer(row: int, rate: Call) -> Call:
        def write(parameters: Any, view: Any) -> None:
            for at in range(0, view.e.shape[0] * view.e.shape[1], WIDTH):
                store(view.rate_found, at, rate(parameters, axes_at(view, at)))
            keep_rate(view, row, 0, view.q_d.shape[0])

        return made(write)

    return in_turn(made, (writer(row, equations[name + RATE]) for row, name in enumerate(law.memories())))
