"""Stay on the circle or sphere around the target (paper eq. 5), whose radius may change."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, along, keep_distance
from escort_mj.components.obstacles import obstacles_seen
from escort_mj.components.setup import MissionSetup
from escort_mj.components.teams import radius_of
from escort_mj.native.fields import Array as Field
from escort_mj.native.fields import Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.on_demand import on_demand
from escort_mj.native.vectors import norm
from escort_mj.numerics.formation import widest_spacing
from escort_mj.numerics.program import evaluate_program
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]

SOFT = 0.25  # share of the mission's radius: once so much room is missing, it shrinks as the room does


class RadiusParameters(Fields):
    """Radii that change, of each behavior `surface` that has one of its own."""

    radius_functions: Annotated[Field, "radii", 2, Value("1", "first instruction and their number")]
    radius_fits: Annotated[Field, "radii", Value("1", "1 where it shrinks to the free space")]
    radius_least: Annotated[Field, "radii", Value("m", "to which it shrinks at most")]
    radius_margin: Annotated[Field, "radii", Value("m", "between the sphere and an obstacle")]
    radius_index: Annotated[
        Field, "phases", Value("1", "index of the one that a phase has; -1 for the mission's or the team's")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        own = [surface for _, surface in setup.numbered(Surface) if surface.changes]
        return {
            "radius_fits": [surface.fit for surface in own],
            "radius_least": [surface.least_radius(setup) for surface in own],
            "radius_margin": [_margin(setup)] * len(own),
            "radius_index": [
                max((each.radius_index(setup) for each in stack if isinstance(each, Surface)), default=-1)
                for stack in setup.stacks
            ],
        }


class RadiusState(Fields):
    """These radii now."""

    radius_now: Annotated[Field, "radii", 2, Value("m", "radius, and its rate [m/s]")]


class Surface(Behavior):
    """Keep each robot at the mission's radius from the target."""

    python_only: ClassVar[frozenset[str]] = frozenset({"behavior", "radius", "fit", "least"})

    behavior: Literal["surface"] = "surface"
    gain: PositiveFloat = 0.8
    """Gain of the task error [1/s] (paper: Lambda_3)."""
    radius: float | str | None = None
    """Distance to the target [m]: a number, or an expression in t; null: `mission.radius`."""
    fit: bool = False
    """Whether the radius shrinks where obstacles leave less room around the target, and grows again
    afterward."""
    least: PositiveFloat | None = None
    """Smallest radius to which the formation shrinks [m]; null: the smallest that bodies and safe distances
    allow."""

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return its parameters as kernels see them: the gain, and which of the radii that change is its."""
        return {"gain": float, "radius_index": int}

    def packed(self, setup: MissionSetup | None = None) -> dict[str, float]:
        """Return its parameters as numbers."""
        return {"gain": self.gain, "radius_index": -1.0 if setup is None else float(self.radius_index(setup))}

    @property
    def changes(self) -> bool:
        """Whether it has a radius of its own."""
        return self.fit or self.radius is not None

    def radius_index(self, setup: MissionSetup) -> int:
        """Return its index among the behaviors whose radius changes; -1 where it does not."""
        own = [surface for _, surface in setup.numbered(Surface) if surface.changes]
        return own.index(self) if self.changes else -1

    def least_radius(self, setup: MissionSetup) -> float:
        """Return the radius below which the team does not shrink [m]."""
        if self.least is not None:
            return self.least
        body = float(setup.robot_radius.max())
        teammates = [max(each.teammate_distance, each.heard_distance) for each in setup.avoidance]
        apart = 2.0 * body + max(teammates, default=0.0)
        return max(
            apart / widest_spacing(setup.count, setup.axes, 1.0),
            body + (setup.target_radius or 0.0) + setup.outer.target_margin(setup),
        )

    def task(self: Any, r: Robots) -> Task:
        """Return eq. 5: sigma = |q - c|^2 / 2 is to become radius^2 / 2, which may change."""
        x = r.q - r.target
        if self.radius_index < 0:
            return keep_distance(x, r.radius, self.gain)
        radius, rate = r.state.radius_now[self.radius_index, 0], r.state.radius_now[self.radius_index, 1]
        task = keep_distance(x, _ahead(radius, rate, self.gain), self.gain)
        return along(x, task.weight, task.velocity, task.active, abs(norm(x) - radius), task.value)


def _margin(setup: MissionSetup) -> float:
    radius = float(setup.robot_radius.max())
    return max((each.safe_distance + each.to_surface * radius for each in setup.avoidance), default=radius)


@inlined
def _ahead(radius: float, rate: float, gain: float) -> float:
    """Return the distance to keep for which the task's velocity contains the rate of the radius [m]."""
    return math.sqrt(max(radius * radius + 2.0 * radius * rate / gain, 0.0))


@inlined
def fitted(
    wanted: float, rate: float, room: float, opening: float, soft: float, least: float
) -> tuple[float, float]:
    """Return the radius that fits into a room, and its rate; it begins to shrink and ends growing gently.

    Args:
        wanted: Radius without obstacles [m].
        rate: Its rate [m/s].
        room: Largest radius that is free [m].
        opening: Its rate [m/s].
        soft: Missing room over which shrinking sets in [m].
        least: Smallest radius [m].
    """
    missing = wanted - room
    if missing <= -0.5 * soft:
        return wanted, rate
    share = min(missing / soft + 0.5, 1.0)
    radius = wanted - (0.5 * soft * share * share if share < 1.0 else missing)
    if radius < min(least, wanted):
        return min(least, wanted), rate if wanted < least else 0.0
    return radius, rate - share * (rate - opening)


@on_demand
def choose_radii(plan: Plan, state: State) -> None:
    """Write the radii that change, and their rates, and how far each robot is to stay from the target."""
    p, m, time = state.q.shape[1], plan.obstacle_radius.shape[0], state.time[0]
    position, room, opening = obstacles_seen(state.q.shape[0], plan, state), math.inf, 0.0
    for j in range(m):
        square, along_way = 0.0, 0.0
        for k in range(p):
            way = state.target_position_measured[k] - position[j, k]
            square += way * way
            along_way += way * (state.target_velocity_measured[k] - state.obstacle_velocity[j, k])
        apart = math.sqrt(square)
        if apart - plan.obstacle_radius[j] < room:
            room, opening = apart - plan.obstacle_radius[j], along_way / max(apart, 1e-300)
    for index in range(plan.radius_least.shape[0]):
        first, count = int(plan.radius_functions[index, 0]), int(plan.radius_functions[index, 1])
        radius, rate = evaluate_program(plan.code, first, count, plan.segments, time, state.operands)
        if plan.radius_fits[index] != 0.0 and room < radius + plan.sensing_obstacles:
            radius, rate = fitted(
                radius, rate, room - plan.radius_margin[index], opening, SOFT * plan.radius,
                plan.radius_least[index],
            )  # fmt: skip
        state.radius_now[index, 0], state.radius_now[index, 1] = radius, rate
    for i in range(state.kept_radius.shape[0]):
        index = int(plan.radius_index[int(state.phase[i])])
        state.kept_radius[i] = state.radius_now[index, 0] if index >= 0 else radius_of(i, plan, state)
