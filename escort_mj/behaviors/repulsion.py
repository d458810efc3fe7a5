"""Spread by repulsion (Coulomb, as in the Thomson problem of remark 1), seen from the target."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.wish import Wish, across, look_at_target, square_of
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.teams import radius_of
from escort_mj.knowledge.belief import target_place
from escort_mj.knowledge.teammates import mate_at, places_of, teammate_place
from escort_mj.native.lanes import (
    WIDTH,
    everywhere,
    greatest,
    lane_numbers,
    load,
    load_rows,
    root,
    row_of,
    set_row,
    stack_rows,
    store_rows,
    there,
    where,
)
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]

SAME = 1e-24  # squared distance of two directions that differ by rounding only: neither way leads apart


class Repulsion(Behavior):
    """Spread the robots evenly: seen from the target, the others' directions repel that of each robot."""

    spreads: ClassVar[bool] = True

    behavior: Literal["repulsion"] = "repulsion"
    gain: PositiveFloat = 0.8
    """Gain of the repulsion [1/s]; the speed is at most gain times radius."""

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return the task across the way to the target: down the Coulomb energy of the directions."""
        if plan.apart:
            _repel_apart(i, self.gain, plan, state)
        else:
            _repel(i, self.gain, plan, state)
        p = state.q.shape[1]
        look_at_target(i, plan, state, x)
        square, rows = square_of(x, 0, p), stack_rows(p)
        load_rows(state.wished_velocity, i, rows)
        for k in range(p):
            set_row(wish, at + k, row_of(rows, k))
        return across(where(square > 0.0, 1.0 / square, 0.0), root(square_of(wish, at, p)) / self.gain)


@on_demand
def _repel_apart(i: int, gain: float, plan: Plan, state: State) -> None:
    """The same where robots i to i + 7 know teammates and the target each by itself."""
    n, p = state.q.shape
    heard = state.link_from.shape[0] > 0
    for robot in range(i, min(i + WIDTH, n)):
        center, push, here = (
            target_place(robot, plan, state),
            state.wished_velocity[robot],
            state.q_measured[robot],
        )
        team, own, inward, speed = 1.0, 0.0, 0.0, 0.0
        for k in range(p):
            push[k] = 0.0
            own += (here[k] - center[k]) ** 2
        if own == 0.0:
            continue
        for place in range(places_of(state)):
            mate, age = mate_at(robot, place, plan, state)
            if mate < 0:
                continue
            away, gap, apart = 0.0, 0.0, 0.0
            for k in range(p):
                there = teammate_place(robot, place, age, k, state)
                away += (there - center[k]) ** 2
                gap += (there - here[k]) ** 2
            near = math.sqrt(gap) - plan.robot_radius[robot] - plan.robot_radius[mate] <= plan.sensing_robots
            if not heard and not near:
                continue
            team += 1.0
            if away == 0.0:
                continue
            for k in range(p):
                unit = (here[k] - center[k]) / math.sqrt(own)
                there = teammate_place(robot, place, age, k, state) - center[k]
                apart += (unit - there / math.sqrt(away)) ** 2
            if apart <= SAME:
                continue
            for k in range(p):
                unit = (here[k] - center[k]) / math.sqrt(own)
                way = unit - (teammate_place(robot, place, age, k, state) - center[k]) / math.sqrt(away)
                push[k] += way / (apart * math.sqrt(apart))
        for k in range(p):
            inward += push[k] * (here[k] - center[k]) / own
        for k in range(p):
            push[k] = (push[k] - inward * (here[k] - center[k])) / team
            speed += push[k] * push[k]
        limit = gain * radius_of(robot, plan, state) / max(math.sqrt(speed), 1.0)
        for k in range(p):
            push[k] *= limit


@on_demand
def _repel(i: int, gain: float, plan: Plan, state: State) -> None:
    """Write the wished velocities of robots i to i + 7; those lost or out of sight repel none."""
    n, p = state.q.shape
    q, center, radius = state.q_measured, state.target_position_measured, plan.robot_radius
    x, here, other, push = stack_rows(p), stack_rows(p), stack_rows(p), stack_rows(p)
    load_rows(q, i, here)
    look_at_target(i, plan, state, x)
    square = square_of(x, 0, p)
    weight, team = where(square > 0.0, 1.0 / square, 0.0), everywhere(0.0)
    inverse = root(weight)
    for k in range(p):
        set_row(push, k, everywhere(0.0))
    for j in range(n):
        if state.lost[j] != 0.0:
            continue
        itself = abs(lane_numbers() + float(i - j)) < 0.5
        seen = there(n - i)
        if plan.sensing_robots < UNLIMITED:
            apart = everywhere(0.0)
            for k in range(p):
                way = row_of(here, k) - q[j, k]
                apart = apart + way * way
            gap = where(itself, 0.0, root(apart) - (load(radius, i) + radius[j]))
            seen = seen & (where(gap > plan.sensing_robots, 0.0, 1.0) > 0.5)
        team = team + where(seen, 1.0, everywhere(0.0))
        away = 0.0
        for k in range(p):
            away += (q[j, k] - center[k]) ** 2
        if away == 0.0:
            continue
        scale, apart = 1.0 / math.sqrt(away), everywhere(0.0)
        for k in range(p):
            set_row(other, k, row_of(x, k) * inverse - (q[j, k] - center[k]) * scale)
            apart = apart + row_of(other, k) * row_of(other, k)
        apart = where(itself, 0.0, apart)
        strength = where((apart > SAME) & seen, 1.0 / (apart * root(apart)), 0.0)
        for k in range(p):
            set_row(push, k, row_of(push, k) + strength * row_of(other, k))
    inward, speed = everywhere(0.0), everywhere(0.0)
    for k in range(p):
        inward = inward + row_of(push, k) * row_of(x, k)
    inward = inward * weight
    for k in range(p):
        set_row(push, k, (row_of(push, k) - inward * row_of(x, k)) / team)
        speed = speed + row_of(push, k) * row_of(push, k)
    limit = where(square > 0.0, gain * plan.radius / greatest(root(speed), 1.0), 0.0)
    for k in range(p):
        set_row(push, k, where(limit > 0.0, limit * row_of(push, k), 0.0))
    store_rows(state.wished_velocity, i, push)
