"""How contacts of many robots are simulated, where the scenario leaves it open.

One iteration of Newton's method factorizes all that touch at once; conjugate gradients do not, and a contact
without friction is one equation where one with friction is four.
"""

from __future__ import annotations

from typing import NamedTuple

from escort_mj.scenario.geometry.placement import robot_count
from escort_mj.scenario.schema.scenario import Scenario

CROWD = 100


class ContactPhysics(NamedTuple):
    """How contacts are simulated.

    Attributes:
        solver: MuJoCo's constraint solver, as the scenario calls it.
        friction: Whether bodies that touch rub on each other.
        chosen: Which of these the scenario left open, and a crowd decided.
    """

    solver: str
    friction: bool
    chosen: tuple[str, ...]

    def __str__(self) -> str:
        words = f"solver {self.solver}, contacts {'with' if self.friction else 'without'} friction"
        return f"{words} ({' and '.join(self.chosen)} for a crowd)" if self.chosen else words


def contact_physics(scenario: Scenario) -> ContactPhysics:
    """Solver and friction of a scenario: as told, or as suits the number of robots."""
    physics, crowd = scenario.physics, robot_count(scenario) >= CROWD
    chosen = [key for key in ("solver", "friction") if crowd and getattr(physics, key) is None]
    return ContactPhysics(
        physics.solver or ("cg" if crowd else "newton"),
        not crowd if physics.friction is None else physics.friction,
        tuple(chosen),
    )
