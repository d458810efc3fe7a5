"""Base of laws: what force each robot is to have, so that it follows the reference of the outer loop."""

from typing import ClassVar

from pydantic import PositiveFloat

from escort_mj.components.component import Component
from escort_mj.components.views import LAW_OUTPUTS, LawView


class Law(Component):
    """What force each robot is to have, so that it follows its reference.

    A subclass has a key `law` with its name and parameters. `force` or `force_kernel` or both are called with
    itself (in the compiled form: with its parameters' numbers) and a `LawView`. Laws that ship have
    `force_lanes` in place of `force_kernel`: eight axes at once, of all robots in a row.
    """

    method: ClassVar[str] = "force"
    view: ClassVar[type] = LawView
    outputs: ClassVar[tuple[str, ...]] = LAW_OUTPUTS
    memories: ClassVar[int] = 0
    """How many numbers of its own are integrated for every robot and axis: `law_memory`."""
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

    @classmethod
    def title_of(cls) -> str:
        """Return what tables and figures call the law."""
        return cls.title or str(cls.model_fields["law"].default)

    @property
    def estimate_at_start(self) -> float:
        """What the loop integrates begins at `initial_estimate`, where the law has such a parameter [N]."""
        return float(getattr(self, "initial_estimate", 0.0))

    @property
    def filter_time(self) -> float:
        """Return the time constant of the filter of the differentiated v_d, where the law has one [s]."""
        return float(getattr(self, "acceleration_filter", 0.0))
