"""Set-based avoidance: each body limits velocities to a half-space (Ames et al. 2017; Moe et al. 2016)."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.behaviors.behavior import Avoidance
from escort_mj.behaviors.bodies import obstacle_body, teammate_body
from escort_mj.behaviors.robots import Robots, robots_at
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.control.nsb import avoidance_of, stacked
from escort_mj.control.outer_loops.constraints import (
    MOST,
    Constraints,
    SpeedBounds,
    fastest_obstacle,
    find_constraints,
    team_motion,
    team_spread,
)
from escort_mj.control.outer_loops.detour import (
    detour_of,
    follow_boundary,
    keep_detour,
    next_detour,
)
from escort_mj.control.outer_loops.meeting import who_is_met
from escort_mj.control.outer_loops.nearest_velocity import (
    STIFFNESS,
    break_least,
    contradict,
    keep_limit,
    nearest_velocity,
    step_aside,
)
from escort_mj.control.outer_loops.outer_loop import OuterLoop, has_stack, slow_down
from escort_mj.control.outer_loops.passing import (
    OUTRUNS,
    Clearance,
    Rules,
    breadth_of,
    horizon_lanes,
    lead_of,
)
from escort_mj.knowledge.belief import target_speed
from escort_mj.knowledge.teammates import find_nearest_heard
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, stack_memory, vector_at
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    greatest,
    load,
    store,
    where,
)
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, set_numbers_at
from escort_mj.numerics.neighbors import seen_neighbors
from escort_mj.plan import Plan, State


class SetBased(OuterLoop):
    """Escort behaviors by priority, restricted to velocities that keep distances safe (Ames et al. 2017).

    The margin to a body (an obstacle, a teammate or the target) is the distance to it minus the safe distance
    of avoid_obstacles; it limits how fast the robot may approach. With u the velocity of the body and n the
    unit vector from the body to the robot, the robot's velocity v satisfies n . (v - u) >= -approach(margin),
    where approach is proportional to the margin and, farther out, the speed from which the robot can brake in
    time. Of these velocities, v is the one closest to that of the behaviors. If none within the speed limit
    satisfies all conditions, v minimizes the sum of the squared violations, weighted by how soon each body
    could be touched. Two robots, even of different teams, are each allowed half of the closing speed. With
    `patience`, a robot that is blocked follows the boundary of what blocks it.
    """

    title: ClassVar[str] = "set-based"
    avoids: ClassVar[bool] = True
    looks_far: ClassVar[bool] = True
    meets: ClassVar[bool] = True
    loop: Literal["set_based"] = "set_based"
    activation: Literal["smooth", "tangent_cone"] = "smooth"
    """When the condition on v applies: always, so that a robot slows down early (`smooth`), or only within
    the safe distance, from where a robot must move away (`tangent_cone`)."""
    rate: PositiveFloat = 4.0
    """Share of the margin that a robot may use up per second or, where the margin is negative, must recover
    [1/s]."""
    braking: PositiveFloat | None = None
    """Deceleration at which a robot can brake [m/s^2]; null: half the smallest ratio of force limit to mass
    in the team, or unlimited without a force limit."""
    target_distance: NonNegativeFloat | None = None
    """Safe distance to the target [m]; null: `safe_distance`, but at most half the gap between the target and
    robots at the mission's radius; 0: the target is not avoided."""
    patience: PositiveFloat | None = None
    """Time for which a robot is blocked before it follows the boundary of what blocks it [s]; null: it waits,
    which is best when escorting a moving target."""
    turn_back: PositiveFloat = 12.0
    """Time after which a robot turns back and follows the boundary the other way around [s];
    doubled after each turn."""

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return name and type of what kernels read; a null is what the mission gives, or 0."""
        return {
            "activation": int, "rate": float, "braking": float, "target_distance": float, "patience": float,
            "turn_back": float, "target_radius": float,
        }  # fmt: skip

    def packed(self, setup: MissionSetup | None = None) -> dict[str, float]:
        """Return the values of what kernels read."""
        assert setup is not None
        rules = self.rules(setup)
        return {
            "activation": rules.cone, "rate": rules.rate, "braking": rules.braking,
            "target_distance": rules.target_distance, "patience": self.patience or 0.0,
            "turn_back": self.turn_back, "target_radius": rules.target_radius,
        }  # fmt: skip

    def rules(self, setup: MissionSetup) -> Rules:
        """Return how fast a robot may approach at each margin, in a mission."""
        braking = self.braking
        if braking is None:
            with np.errstate(divide="ignore"):
                braking = 0.5 * float(np.min(setup.force_limit / setup.mass))
        radius = setup.target_radius
        distance = 0.0 if radius is None else self.target_distance
        if distance is None:
            gap = setup.radius - (radius or 0.0) - float(setup.robot_radius.max())
            distance = min([max(0.5 * gap, 0.0), *(each.safe_distance for each in setup.avoidance)])
        return Rules(
            self.rate, min(braking, UNLIMITED), float(self.activation == "tangent_cone"), 1.0, distance,
            radius or 0.0,
        )  # fmt: skip

    def target_margin(self, setup: MissionSetup) -> float:
        """Return the distance that it keeps to the target [m]."""
        return self.rules(setup).target_distance

    def velocity_lanes(self: Any, i: int, phase: int, plan: Plan, state: State) -> None:
        """Restrict `v_d`, what the escort behaviors want, to safe velocities, for robots i to i + 7.

        In kernels, `self` is the record that `numbers` declares.
        """
        first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
        r, n = robots_at(i, plan, state), state.q.shape[0]
        foresees = 1.0
        rules = Rules(
            self.rate, self.braking, self.activation, foresees, self.target_distance, self.target_radius
        )
        for level in range(first, first + levels):
            if plan.level_avoids[level] == 0.0:
                continue
            clearance = Clearance(level, avoidance_of(level, plan), rules)
            busy = _may_bind(clearance, r) + abs(load(state.detour, i))
            mine = stacked(i, phase, plan, state)  # held velocities, too: conditions are kept at every step
            store(state.detour_for, i, where(mine & (busy < 0.5), 0.0, load(state.detour_for, i)))
            if any_of(mine & (busy > 0.5)):
                store(state.detour_near, i, busy)
                for robot in range(i, min(i + WIDTH, n)):
                    if state.detour_near[robot] > 0.5 and has_stack(robot, phase, plan, state):
                        _filter_velocity(robot, self.patience, self.turn_back, clearance, plan, state)
                        slow_down(robot, plan, state)
            store(state.detour_time, i, where(mine, state.time[0], load(state.detour_time, i)))


@inlined
def _may_bind(clearance: Clearance, r: Robots) -> Lanes:
    """Return 1 for those of eight robots for which some constraint may bind, else 0: too many, never too few.

    A body counts if its margin is below that at which `approach` allows the closing speed.

    Args:
        clearance: What distances are kept.
        r: The robots.
    """
    plan, state, wanted = r.plan, r.state, r.at(r.state.v_d, 0)
    level, avoid, rules = clearance
    drift, from_target, max_speed = r.target_velocity, r.q - r.target, r.max_speed
    speed, relative, pace = norm(wanted), norm(wanted - drift), norm(drift)
    frame_speed = norm(wanted - r.vector(state.pace_frame))
    binds = _limits_bind(level, speed, r)
    if plan.team_radius.shape[0] > 0:
        relative = relative + (pace if plan.estimating else everywhere(team_spread(r.i, plan, state)))
    if rules.target_distance > 0.0:
        look = rules.target_distance + avoid.to_surface * (r.robot_radius + rules.target_radius)
        target_faster = pace > OUTRUNS * max_speed  # the target is faster than the robot
        look = look + where(target_faster, look * pace / max_speed, 0.0)
        look = look + horizon_lanes(where(target_faster, speed + pace, relative), rules)
        binds = where(dot(from_target, from_target) < look * look, 1.0, binds)
    fastest = fastest_obstacle(state)
    away, lead = horizon_lanes(speed + fastest, rules), lead_of(fastest, max_speed)
    for j in range(r.obstacles):
        body = obstacle_body(avoid, j, r)
        look = body.reach
        if lead > 0.0:
            look = look + lead * (look + breadth_of(plan.obstacle_extent[j]))
        look = look + away
        binds = where(dot(body.x, body.x) < look * look, 1.0, binds)
    mutual_speed = 2.0 * (relative if plan.target_feedforward else speed)
    far = horizon_lanes(greatest(mutual_speed, frame_speed + state.pace_most[0]), rules)
    listed = seen_neighbors(state).shape[0] > 0
    if avoid.teammate_distance > 0.0 and listed:
        binds = greatest(binds, who_is_met(r.i, mutual_speed, frame_speed, far, clearance, plan, state))
    if avoid.heard_distance > 0.0:
        find_nearest_heard(r.i, avoid.heard_distance, avoid.to_surface, plan, state)
        margin = horizon_lanes(greatest(mutual_speed, load(state.heard_pace, r.i)), rules)
        binds = where(load(state.heard_margin, r.i) < margin, 1.0, binds)
    failing = plan.failure.shape[0] > 0
    if failing or (avoid.teammate_distance > 0.0 and not listed):
        mates = _mates_near(False, wanted, mutual_speed, far, avoid, rules, r)
        if any_of(mates > 0.5):  # seldom: only then the speed of each is worth its time
            mates = _mates_near(True, wanted, mutual_speed, far, avoid, rules, r)
        binds = greatest(binds, mates)
    return binds


@inlined
def _limits_bind(level: int, speed: Lanes, r: Robots) -> Lanes:
    """Return 1 for those of eight robots whose velocity may break one of their inequalities, else 0.

    Args:
        level: One of their phase's levels.
        speed: Speed of each robot [m/s].
        r: The robots.
    """
    plan, state, binds = r.plan, r.state, everywhere(0.0)
    for f in range(plan.phase_first.shape[0]):
        first, last = int(plan.phase_first[f]), int(plan.phase_first[f] + plan.phase_levels[f])
        for phase_level in range(first, last):
            row = int(plan.level_limit_row[phase_level])
            if row >= 0 and first <= level < last:
                length = norm(r.at(state.limit_x, row))
                broken = load(state.limit_rate, row + r.i) >= -speed * length
                binds = where(broken, 1.0, binds)
    return binds


@inlined
def _mates_near(
    exactly: bool, wanted: Vec, mutual_speed: Lanes, far: Lanes, avoid: Avoidance, rules: Rules, r: Robots
) -> Lanes:
    """Return 1 for those of eight robots for which a teammate's constraint may bind, else 0.

    Args:
        exactly: Whether each teammate has its measured velocity, instead of the largest speed of all.
        wanted: What the robots want [m/s].
        mutual_speed: Closing speed where both keep to their half [m/s].
        far: Margin at which the largest speed of all matters [m].
        avoid: What distances are kept.
        rules: How fast robots may come nearer.
        r: The robots.
    """
    state, speed, binds = r.state, norm(wanted), everywhere(0.0)
    failing = r.plan.failure.shape[0] > 0
    for j in range(state.q.shape[0]):
        body, margin, stretch = teammate_body(avoid, j, r), far, 1.0
        if failing and state.lost[j] != 0.0:
            its_speed = norm(numbers_at(state, state.v_measured, j))
            margin, stretch = horizon_lanes(speed + its_speed, rules), 1.0 + lead_of(its_speed, r.max_speed)
        elif exactly:
            margin = horizon_lanes(
                greatest(mutual_speed, norm(r.vector(state.v_measured[j]) - wanted)), rules
            )
        if body.safe > 0.0:
            look = stretch * body.reach + margin
            binds = where((dot(body.x, body.x) < look * look) & body.counts, 1.0, binds)
    return binds


@inlined
def _filter_velocity(
    robot: int, patience: float, turn_back: float, clearance: Clearance, plan: Plan, state: State
) -> None:
    """Change a robot's velocity as little as safety requires, or lead it around what blocks it."""
    p, v, (_, avoid, rules) = state.q.shape[1], numbers_at(state, state.v_d, robot), clearance
    memory = stack_memory()
    rows, bounds = matrix_at(memory, MOST, p), vector_at(memory + DOUBLE * MOST * p, MOST)
    cooperation = vector_at(memory + DOUBLE * MOST * (p + 1), MOST)
    gaps = vector_at(stack_memory(), MOST)
    constraints = Constraints(rows, bounds, cooperation, gaps)
    wanted, nominal = v, v  # a detour follows a boundary in place of what is wanted
    # Bodies that cannot matter at these speeds are left out; if v comes out faster, once more with those.
    speed = assumed_speed = norm(v)
    drift = team_motion(robot, rules, plan, state)
    assumed_relative = norm(v - drift)
    side, decided = 0.0, patience == 0.0
    if not decided:  # a detour may turn v into any direction
        assumed_relative += 2.0 * norm(target_speed(robot, plan, state))
    while True:
        limits = SpeedBounds(assumed_speed, assumed_relative)
        count = find_constraints(robot, limits, clearance, plan, state, constraints)
        start = nominal
        if side == 0.0:
            start = step_aside(avoid.sidestep, rows, bounds, count, speed, nominal)
        moved, v = nearest_velocity(rows, bounds, count, STIFFNESS, start)
        moved = moved or side != 0.0
        now, relative = norm(v), norm(v - drift)
        if now > assumed_speed or relative > assumed_relative:
            assumed_speed, assumed_relative = max(assumed_speed, now), max(assumed_relative, relative)
            continue
        if not decided:
            decided = True
            square, static_blocker = max(speed * speed, 1e-300), 0.0
            share = dot(v, wanted) / square  # of what is wanted that is left
            advance = dot(numbers_at(state, state.v_measured, robot), wanted) / math.sqrt(square)
            for j in range(count):
                if bounds[j] >= -speed:
                    static_blocker = max(static_blocker, 1.0 - cooperation[j])
            detour = next_detour(
                detour_of(robot, state), state.time[0] - state.detour_time[robot], moved, share, advance,
                static_blocker, patience, turn_back,
            )  # fmt: skip
            keep_detour(robot, detour, state)
            side = detour.side
            if side != 0.0:
                nominal = follow_boundary(side, speed, rows, bounds, cooperation, count, wanted)
                continue
        feasible = not contradict(rows, bounds, count, start, v)
        if feasible:
            feasible, v = keep_limit(rows, bounds, count, plan.max_speed, v)
        if not feasible:
            v = break_least(rows, bounds, gaps, count, avoid.safe_distance, plan.max_speed, start)
        now, relative = norm(v), norm(v - drift)
        if not (now > assumed_speed or relative > assumed_relative):
            set_numbers_at(state.v_d, robot, v)
            state.avoidance_active[robot] = 1.0 if moved else 0.0
            return
        assumed_speed, assumed_relative = max(assumed_speed, now), max(assumed_relative, relative)
