"""Stay on the circle or sphere around the target (paper eq. 5), whose radius may change."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, along, keep_distance
from escort_mj.components.component import OfMission
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.obstacles import obstacles_seen
from escort_mj.components.parameters import Distance, OfTime
from escort_mj.components.setup import MissionSetup
from escort_mj.components.teams import radius_of
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.on_demand import on_demand
from escort_mj.native.vectors import dot, norm, numbers_at, numbers_from
from escort_mj.numerics.formation import widest_spacing
from escort_mj.numerics.program import evaluate_program
from escort_mj.plan import Plan, State

SOFT = (
    0.25  # width of the transition from the wanted radius to the one that fits, share of the mission's radius
)


class RadiusParameters(Fields):
    """Radii of each behavior `surface` that has one of its own; all programs are packed together."""

    radius_functions: Annotated[Array, "radii", 2, Value("1", "first instruction and their number")]
    radius_fits: Annotated[Array, "radii", Value("1", "1 where it shrinks to the free space")]
    radius_least: Annotated[Array, "radii", Value("m", "smallest radius to which it shrinks")]
    radius_clearance: Annotated[Array, "radii", Value("m", "safe distance of an obstacle from the sphere")]
    radius_index: Annotated[
        Array, "phases", Value("1", "index of the radius of a phase; -1 for the mission's or the team's")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        own = [surface for _, surface in setup.numbered(Surface) if surface.has_own_radius]
        return {
            "radius_fits": [surface.fit for surface in own],
            "radius_least": [surface.least_radius(setup) for surface in own],
            "radius_clearance": [_obstacle_clearance(setup)] * len(own),
            "radius_index": [
                max((own.index(each) for each in stack if each in own), default=-1) for stack in setup.stacks
            ],
        }


class RadiusState(Fields):
    """Current values of these radii."""

    radius_now: Annotated[Array, "radii", 2, Value("m", "radius, and its rate [m/s]")]


class Surface(Behavior):
    """Keep each robot at the mission's radius from the target, or at one of its own, which may change."""

    python_only: ClassVar[frozenset[str]] = frozenset({"radius", "fit", "least"})

    behavior: Literal["surface"] = "surface"
    gain: PositiveFloat = 0.8
    """Gain of the task error [1/s] (paper: Lambda_3)."""
    radius: OfTime | None = None
    """Distance to the target [m]: a number, or an expression in t; null: `mission.radius`."""
    fit: bool = False
    """Whether the radius shrinks where obstacles leave less room around the target, and grows again
    afterward."""
    least: Distance | None = None
    """Smallest radius to which the formation shrinks [m]; null: the smallest that bodies and safe distances
    allow."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a radius that the mission leaves no choice of, and those inside bodies."""
        shrinks = "shrinks for the room around the target"
        if mission.teams and (self.has_own_radius or self.least is not None):
            words = "has a radius of its own; with teams, each team has its radius"
            yield Misfit(words, "", (("teams",),))
        if self.fit and mission.known_by and not mission.teams:
            words = f"{shrinks}, which each robot knows by itself; expected no fit"
            yield Misfit(words, "fit", ((mission.known_by,),))
        if self.fit and mission.lidar:
            words = f"{shrinks}, which a lidar does not show; expected no fit"
            yield Misfit(words, "fit", (("sensing", "lidar"),))
        if self.least is not None and not self.fit:
            yield Misfit("found a smallest radius without fit: true", "least")
        body = mission.target_radius + mission.robot_radius
        for name, value in (("radius", self.radius), ("least", self.least)):
            if isinstance(value, float) and value <= body:
                words = f"found {value:g} m, inside the target's body; expected more than {body:g} m"
                yield Misfit(words, name, (("target", "radius"), ("robots", "radius")))
        whole = mission.radius if self.radius is None else self.radius
        if self.least is not None and isinstance(whole, float) and not mission.teams and self.least > whole:
            words = f"found {self.least:g} m; expected at most the radius, {whole:g} m"
            yield Misfit(words, "least", (("mission", "radius"),))

    @property
    def has_own_radius(self) -> bool:
        """Whether its radius is not simply the mission's: it is given here, or fits the free space."""
        return self.fit or self.radius is not None

    @OfMission
    def radius_index(self, setup: MissionSetup) -> float:
        """Index among the behaviors with a radius of their own; -1 without one."""
        own = [surface for _, surface in setup.numbered(Surface) if surface.has_own_radius]
        return own.index(self) if self.has_own_radius else -1

    def least_radius(self, setup: MissionSetup) -> float:
        """Return the radius below which the team does not shrink [m]."""
        if self.least is not None:
            return self.least
        body = float(setup.robot_radius.max())
        teammates = [max(each.teammate_distance, each.heard_distance) for each in setup.avoidance]
        spacing = 2.0 * body + max(teammates, default=0.0)
        return max(
            spacing / widest_spacing(setup.count, setup.axes, 1.0),
            body + (setup.target_radius or 0.0) + setup.outer.target_margin(setup),
        )

    def task(self: Any, r: Robots) -> Task:
        """Return eq. 5: sigma = |q - c|^2 / 2 is to become radius^2 / 2, which may change."""
        x = r.q - r.target
        if self.radius_index < 0:
            return keep_distance(x, r.radius, self.gain)
        index = int(self.radius_index)
        radius, rate = r.state.radius_now[index, 0], r.state.radius_now[index, 1]
        task = keep_distance(x, _lead_radius(radius, rate, self.gain), self.gain)
        # The velocity leads by the rate of the radius; the error is that from the radius itself.
        return along(x, task.weight, task.velocity, task.active, abs(norm(x) - radius), task.value)


def _obstacle_clearance(setup: MissionSetup) -> float:
    """Return the largest safe distance of a robot's center from an obstacle's surface [m]."""
    radius = float(setup.robot_radius.max())
    return max((each.safe_distance + each.to_surface * radius for each in setup.avoidance), default=radius)


@inlined
def _lead_radius(radius: float, rate: float, gain: float) -> float:
    """Return the distance to keep with which robots at the radius move at its rate [m]."""
    return math.sqrt(max(radius * radius + 2.0 * radius * rate / gain, 0.0))


@inlined
def fitted(
    desired: float, rate: float, free: float, free_rate: float, soft: float, least: float
) -> tuple[float, float]:
    """Return the radius that fits into free space, and its rate, smooth where it begins to shrink.

    Args:
        desired: Radius without obstacles [m].
        rate: Its rate [m/s].
        free: Largest radius without an obstacle [m].
        free_rate: Its rate, negative where the obstacle comes nearer [m/s].
        soft: Width of the transition, which has its center where no space is missing [m].
        least: Smallest radius [m].
    """
    missing = desired - free
    if missing <= -0.5 * soft:
        return desired, rate
    blend = min(missing / soft + 0.5, 1.0)
    radius = desired - (0.5 * soft * blend * blend if blend < 1.0 else missing)
    if radius < min(least, desired):
        return min(least, desired), rate if desired < least else 0.0
    return radius, rate - blend * (rate - free_rate)


@on_demand
def choose_radii(plan: Plan, state: State) -> None:
    """Write the behaviors' own radii, their rates, and the distance that each robot is to keep."""
    m, time = plan.obstacle_radius.shape[0], state.time[0]
    target = numbers_from(state, state.target_position_measured, 0)
    target_velocity = numbers_from(state, state.target_velocity_measured, 0)
    of_target = state.q.shape[0]
    position = obstacles_seen(of_target, plan, state)
    nearest, nearest_rate = math.inf, 0.0
    for j in range(m):
        relative = target - numbers_at(state, position, j)
        distance = norm(relative)
        if distance - plan.obstacle_radius[j] < nearest:
            nearest = distance - plan.obstacle_radius[j]
            opening = dot(relative, target_velocity - numbers_at(state, state.obstacle_velocity, j))
            nearest_rate = opening / max(distance, 1e-300)
    for index in range(plan.radius_least.shape[0]):
        first, count = int(plan.radius_functions[index, 0]), int(plan.radius_functions[index, 1])
        radius, rate = evaluate_program(plan.code, first, count, plan.segments, time, state.operands)
        if plan.radius_fits[index] != 0.0 and nearest < radius + plan.sensing_obstacles:
            radius, rate = fitted(
                radius, rate, nearest - plan.radius_clearance[index], nearest_rate, SOFT * plan.radius,
                plan.radius_least[index],
            )  # fmt: skip
        state.radius_now[index, 0], state.radius_now[index, 1] = radius, rate
    for i in range(state.kept_radius.shape[0]):
        index = int(plan.radius_index[int(state.phase[i])])
        state.kept_radius[i] = state.radius_now[index, 0] if index >= 0 else radius_of(i, plan, state)
