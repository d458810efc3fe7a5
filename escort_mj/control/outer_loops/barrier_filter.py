"""A control-barrier-function filter: the nearest velocity that keeps every distance safe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors import AvoidObstacles, Behavior
from escort_mj.behaviors.task import Situation
from escort_mj.components.obstacles import obstacles_seen
from escort_mj.control.nsb import AVOID_OBSTACLES, avoidance_of, outer_loop
from escort_mj.control.outer_loops.nearby import bearing, bodies_nearby, in_sight, reach_of
from escort_mj.control.outer_loops.outer_loop import OuterLoop, runs_now, slow_down, slowed, split
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, stack_memory, vector_at
from escort_mj.native.lanes import WIDTH
from escort_mj.sensing.measure import in_range

if TYPE_CHECKING:
    from escort_mj.control.setup import Setup
    from escort_mj.memory.layout import Plan, State

Mask = NDArray[np.bool_]

STIFFNESS = 1e4  # weight of a violated constraint against the change of velocity: violations of 1e-4 of it
MOST_STEPS = 60  # of the minimization; a handful is needed
HALVINGS = 40
CLOSE = 1e-13  # of the velocities involved: a step that changes nothing


class BarrierFilter(OuterLoop):
    """Escort behaviors by priority, with a safety filter instead of the avoidance task (Ames et al. 2017).

    With the margin h = d - d_0 to an obstacle and the safe distance d_0 of avoid_obstacles, the velocity is
    the one closest to that of the behaviors that satisfies h' >= -rate * h for each obstacle. Two teammates
    share this condition equally (Wang, Ames, Egerstedt 2017). If no velocity satisfies all conditions, the
    sum of the squared violations is minimal.
    """

    title: ClassVar[str] = "barrier filter"
    avoids: ClassVar[bool] = True
    looks_far: ClassVar[bool] = True
    loop: Literal["barrier_filter"] = "barrier_filter"
    rate: PositiveFloat = 1.0
    """Share of the remaining margin that a robot may use up per second, or of a missing margin that it
    recovers [1/s]."""

    def velocities(self, behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
        """Return the escort behaviors' velocities, changed by as little as safety takes, and whose are.

        Slowing down the result breaks no constraint unless a distance is too small already: rest keeps them.
        """
        escorting, avoiding = split(behaviors)
        active = np.zeros(len(now.q), dtype=bool)
        velocity, _ = outer_loop(escorting, now)
        for avoid in avoiding:
            velocity, active = filtered(self, avoid, velocity, now.q, now.setup, now.team.lost)
        return slowed(velocity, now.setup.max_speed), active

    def velocity_lanes(self, i: int, phase: int, plan: Plan, state: State) -> None:
        """The same for robots i to i + 7, compiled: what the escort behaviors want stands in `v_d`."""
        first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
        for robot in range(i, min(i + WIDTH, state.q.shape[0])):
            if not runs_now(robot, phase, plan, state):
                continue
            moved = False
            for level in range(first, first + levels):
                if plan.level_behavior[level] == AVOID_OBSTACLES:
                    moved = filter_velocity(
                        robot, state.q_measured, state.lost, obstacles_seen(robot, plan, state),
                        plan.obstacle_radius, plan.robot_radius, avoidance_of(level, plan),
                        plan.sensing_robots, plan.sensing_obstacles, self.rate, state.v_d[robot],
                    )  # fmt: skip
            state.avoidance_active[robot] = 1.0 if moved else 0.0
            slow_down(robot, plan, state)


@inlined
def filter_velocity(
    robot: int,
    q: Array,
    lost: Array,
    obstacle_position: Array,
    obstacle_radius: Array,
    robot_radius: Array,
    avoid: Any,
    sensing_robots: float,
    sensing_obstacles: float,
    rate: float,
    v: Array,
) -> bool:
    """Moves a velocity to the nearest one that keeps the distances safe.

    Minimizes |v - v_nominal|^2 / 2 + STIFFNESS / 2 sum_j max(0, b_j - r_j . v)^2, a quadratic program with
    one slack per constraint r . v >= b, where r leads away from a body and b = -rate (d - d_0), or half of
    it between teammates. The function is convex and piecewise quadratic: Newton's method with a line search
    ends after about as many steps as the set of violated constraints changes.

    Args:
        robot: Which robot, from 0.
        q: Measured positions, shape (n, p) [m].
        lost: 1 for robots that have failed, which do not do their half, shape (n,).
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        avoid: Parameters of avoid_obstacles.
        sensing_robots: How far robots see each other, surface to surface [m].
        sensing_obstacles: How far robots see obstacles, likewise [m].
        rate: See `BarrierFilter` [1/s].
        v: The nominal velocity, shape (p,) [m/s]; changed in place.

    Returns:
        Whether it had to move.
    """
    p = v.shape[0]
    memory = stack_memory()
    nominal = vector_at(memory, p)
    gradient = vector_at(memory + DOUBLE * p, p)
    step = vector_at(memory + DOUBLE * 2 * p, p)
    trial = vector_at(memory + DOUBLE * 3 * p, p)
    direction = vector_at(memory + DOUBLE * 4 * p, p)
    hessian = matrix_at(memory + DOUBLE * 5 * p, p, p)
    scale = 0.0
    for k in range(p):
        nominal[k] = v[k]
        scale += abs(v[k])
    moved = False
    for _ in range(MOST_STEPS):
        cost, violated = _cost(
            robot, q, lost, obstacle_position, obstacle_radius, robot_radius, avoid,
            sensing_robots, sensing_obstacles, rate,
            nominal, v, direction, gradient, hessian, True,
        )  # fmt: skip
        if not moved and violated == 0:
            return False
        moved = True
        largest, slope = 0.0, 0.0
        _solve(hessian, gradient, step)
        for k in range(p):
            largest = max(largest, abs(step[k]))
            slope -= gradient[k] * step[k]
            scale = max(scale, abs(v[k]))
        if largest <= CLOSE * scale:
            break
        share = 1.0
        for _halving in range(HALVINGS):
            for k in range(p):
                trial[k] = v[k] - share * step[k]
            better, violated = _cost(
                robot, q, lost, obstacle_position, obstacle_radius, robot_radius, avoid,
            sensing_robots, sensing_obstacles, rate,
                nominal, trial, direction, gradient, hessian, False,
            )  # fmt: skip
            if better <= cost + 1e-4 * share * slope + 1e-14 * cost:
                break
            share *= 0.5
        for k in range(p):
            v[k] = trial[k]
    return moved


@inlined
def _cost(
    robot: int,
    q: Array,
    lost: Array,
    obstacle_position: Array,
    obstacle_radius: Array,
    robot_radius: Array,
    avoid: Any,
    sensing_robots: float,
    sensing_obstacles: float,
    rate: float,
    nominal: Array,
    v: Array,
    direction: Array,
    gradient: Array,
    hessian: Array,
    differentiated: bool,
) -> tuple[float, int]:
    """What `filter_velocity` minimizes, its derivatives where asked for, and how many are violated."""
    p = v.shape[0]
    cost, violated = 0.0, 0
    for k in range(p):
        cost += 0.5 * (v[k] - nominal[k]) ** 2
        if differentiated:
            gradient[k] = v[k] - nominal[k]
            for column in range(p):
                hessian[k, column] = 1.0 if k == column else 0.0
    obstacles = obstacle_radius.shape[0]
    for other in range(obstacles + robot_radius.shape[0]):
        reach, _ = reach_of(robot, other, lost, obstacle_radius, robot_radius, avoid)
        if reach == 0.0:
            continue
        shared = other >= obstacles and lost[other - obstacles] == 0.0
        apart = bearing(robot, other, q, obstacle_position, direction)
        if not in_sight(
            robot, other, apart, obstacle_radius, robot_radius, sensing_robots, sensing_obstacles
        ):
            continue
        missing = rate * (reach - apart)
        missing *= 0.5 if shared else 1.0
        for k in range(p):
            missing -= direction[k] * v[k]
        if missing <= 0.0:
            continue
        violated += 1
        cost += 0.5 * STIFFNESS * missing * missing
        if differentiated:
            for k in range(p):
                gradient[k] -= STIFFNESS * missing * direction[k]
                for column in range(p):
                    hessian[k, column] += STIFFNESS * direction[k] * direction[column]
    return cost, violated


@inlined
def _solve(a: Array, b: Array, x: Array) -> None:
    """Solves a x = b for a symmetric positive definite matrix, which is used up; shape (p, p)."""
    p = b.shape[0]
    for k in range(p):
        x[k] = b[k]
    for k in range(p):
        for i in range(k + 1, p):
            factor = a[i, k] / a[k, k]
            x[i] -= factor * x[k]
            for j in range(k, p):
                a[i, j] -= factor * a[k, j]
    for back in range(p):
        k = p - 1 - back
        for j in range(k + 1, p):
            x[k] -= a[k, j] * x[j]
        x[k] /= a[k, k]


# The same in plain NumPy.


def filtered(
    barrier: BarrierFilter, avoid: AvoidObstacles, nominal: Array, q: Array, setup: Setup, lost: Mask
) -> tuple[Array, Mask]:
    """Each robot's velocity behind the filter, shape (n, p) [m/s], and whose it changed, shape (n,)."""
    away, distance, safe = bodies_nearby(avoid, q, setup, lost)
    share = np.where(lost, 1.0, 0.5)
    radii = np.concatenate([setup.obstacle_radius, setup.robot_radius])
    gaps = distance if avoid.measure == "surface" else distance - setup.robot_radius[:, None] - radii
    obstacles = len(setup.obstacle_radius)
    known = np.hstack(
        [
            in_range(gaps[:, :obstacles], setup.sensing.obstacles),
            in_range(gaps[:, obstacles:], setup.sensing.robots),
        ]
    )
    bound = -barrier.rate * (distance - safe) * np.concatenate([np.ones(len(setup.obstacle_radius)), share])
    velocities, changed = nominal.copy(), np.zeros(len(q), dtype=bool)
    for i, own in enumerate((safe > 0.0) & np.isfinite(known)):
        missing = bound[i, own] - away[i, own] @ nominal[i]
        if np.any(missing > 0.0):
            velocities[i] += least_change(away[i, own], missing)
            changed[i] = True
    return velocities, changed


def least_change(rows: Array, missing: Array) -> Array:
    """The change x of a velocity with slacks s, rows x + s >= missing, of least |x|^2 + STIFFNESS |s|^2.

    Lawson and Hanson's least-distance programming: with z = (x, sqrt(STIFFNESS) s) it is the shortest z in a
    polyhedron G z >= h, which the residual of a non-negative least-squares problem gives.

    Args:
        rows: Shape (k, p).
        missing: Shape (k,) [m/s].
    """
    from scipy.optimize import nnls

    weights = np.hstack([rows, np.eye(len(rows)) / np.sqrt(STIFFNESS)])
    system = np.vstack([weights.T, missing])
    goal = np.zeros(len(system))
    goal[-1] = 1.0
    multipliers, _ = nnls(system, goal)
    residual = goal - system @ multipliers
    return -residual[: rows.shape[1]] / residual[-1]
