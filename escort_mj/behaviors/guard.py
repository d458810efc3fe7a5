"""Stand between an opponent and the target."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.wish import Wish, square_of
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.components.teams import radius_rows
from escort_mj.knowledge.belief import target_rows, target_velocity_rows
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    Lanes,
    everywhere,
    greatest,
    load,
    load_rows,
    root,
    row_of,
    set_row,
    stack_rows,
    there,
    where,
)
from escort_mj.plan import Plan, State

NEAR = 1e-9  # m


class Guard(Behavior):
    """Place a robot between each opponent and the target.

    Each approaching opponent is assigned one robot, the most urgent opponent first; the other robots follow
    behaviors of lower priority. With y the vector from
    the target to the opponent and w the opponent's velocity relative to the target, the robot goes to the
    point at `distance` * y / abs(y) from the target and moves with this point, whose velocity relative to the
    target is `distance` * (I - y y^T / abs(y)^2) w / abs(y).
    """

    frame: ClassVar[Literal["target", "world"]] = "world"

    behavior: Literal["guard"] = "guard"
    distance: PositiveFloat | None = None
    """Distance from the target at which robots take up position [m]; null: `mission.radius`, or the radius of
    their team."""
    alert: PositiveFloat | None = None
    """Distance of an opponent from the target within which robots guard against it [m]; null: any."""
    gain: PositiveFloat = 2.0
    """Gain of the remaining distance [1/s]."""

    @property
    def guards(self) -> bool:
        """Whether it sends robots against opponents."""
        return True

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return its parameters as kernels see them."""
        return {"distance": float, "alert": float, "gain": float}

    def packed(self, setup: MissionSetup | None = None) -> dict[str, float]:
        """Return its parameters as numbers."""
        return {"distance": self.distance or 0.0, "alert": self.alert or UNLIMITED, "gain": self.gain}

    def wish_lanes(self: Any, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return the task sigma = q of the robots that guard, which takes all directions."""
        n, p = state.q.shape
        here, center, drift, y, w = stack_rows(p), stack_rows(p), stack_rows(p), stack_rows(p), stack_rows(p)
        load_rows(state.q_measured, i, here)
        target_rows(i, plan, state, center)
        target_velocity_rows(i, plan, state, drift)
        load_rows(state.threat_position, i, y)
        load_rows(state.threat_velocity, i, w)
        active = guarding_lanes(self.alert, i, plan, state) > 0.5
        along = everywhere(0.0)
        for k in range(p):
            set_row(y, k, where(active, row_of(y, k) - row_of(center, k), 0.0))
            set_row(w, k, where(active, row_of(w, k) - row_of(drift, k), 0.0))
            along = along + row_of(y, k) * row_of(w, k)
        far = greatest(root(square_of(y, 0, p)), NEAR)
        scale, left = self.distance / far, everywhere(0.0)
        if self.distance == 0.0:
            scale = radius_rows(i, plan, state) / far
        for k in range(p):
            way = row_of(center, k) + scale * row_of(y, k) - row_of(here, k)
            aside = row_of(w, k) - row_of(y, k) * along / (far * far)
            left = left + where(active, way * way, 0.0)
            set_row(x, k, everywhere(0.0))
            set_row(wish, at + k, where(active, self.gain * way + row_of(drift, k) + scale * aside, 0.0))
        on = where(active, 1.0, everywhere(0.0))
        return Wish(1, everywhere(0.0), everywhere(0.0), on, on, root(left))


@inlined
def guarding_lanes(alert: float, i: int, plan: Plan, state: State) -> Lanes:
    """1 for those of robots i to i + 7 that guard against an opponent near enough to the target, else 0."""
    n, p = state.q.shape
    center, threat = stack_rows(p), stack_rows(p)
    target_rows(i, plan, state, center)
    load_rows(state.threat_position, i, threat)
    square = everywhere(0.0)
    for k in range(p):
        way = row_of(threat, k) - row_of(center, k)
        square = square + way * way
    near: Any = where(square > alert * alert, 0.0, everywhere(1.0))
    found: Lanes = where(there(n - i), where(load(state.threat, i) > 0.5, near, 0.0), 0.0)
    return found
