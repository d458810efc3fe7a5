"""Base of laws: what force each robot is to have, so that it follows the reference of the outer loop."""

from collections.abc import Callable
from typing import Any, ClassVar

from pydantic import PositiveFloat

from escort_mj.components.equations import Equations
from escort_mj.components.memory import RATE
from escort_mj.components.views import LAW_OUTPUTS, LawView
from escort_mj.native.memory import layout_with
from escort_mj.native.values import Names, Values

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


def law_view(plan: int, state: int, axes: int) -> LawView:
    """View what laws see at the addresses of a plan and a state; nothing is copied or owned."""
    view: LawView = layout_with(LawView).read(LawView, plan, state)
    return view
