"""Tables of opponents: bodies that want to reach the target."""

from typing import Annotated

from pydantic import Field, NonNegativeFloat

from escort_mj.components.parameters import Parameters, Radius, Vector
from escort_mj.policies.straight import Straight
from escort_mj.scenario.schema.fields import Policy
from escort_mj.scenario.schema.obstacle_tables import Drive, Name

MOST_OPPONENTS = 100


class Opponents(Parameters):
    """Opponents of one kind. Each is a sphere with a drive and a policy; it counts among the obstacles."""

    name: Name = "opponent"
    """Name in figures and verdicts, followed by _1, _2 and so on."""
    count: Annotated[int, Field(ge=1, le=MOST_OPPONENTS)] = 1
    """Number of opponents."""
    positions: tuple[Vector, ...] | None = None
    """Initial position of each [m]; null: at `distance`, in random directions, from the target's initial
    position or, with teams, from the middle of their targets."""
    distance: Radius = 10.0
    """Distance for random initial positions, see `positions` [m]."""
    radius: Radius = 0.2
    """Radius of the bodies [m]."""
    body: Drive = Drive.model_construct(mass=1.0, force_limit=20.0)
    """Mass and drive of the bodies."""
    policy: Policy = Straight.model_construct()
    """Policy of each opponent."""
    start: NonNegativeFloat = 0.0
    """Time at which the first opponent sets out [s]; until then, it rests."""
    interval: NonNegativeFloat = 0.0
    """Time between the starts of successive opponents [s]."""
    capture_distance: NonNegativeFloat = 0.3
    """Gap to a robot at which an opponent counts as intercepted [m]; it then returns to its start."""
    reach_distance: NonNegativeFloat = 0.1
    """Gap to the target at which an opponent counts as having reached it [m]; it then returns to its start.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(f"{self.name}_{number + 1}" for number in range(self.count))
