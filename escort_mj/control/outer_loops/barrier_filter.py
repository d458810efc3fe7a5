"""A control-barrier-function filter: the nearest velocity that keeps every distance safe."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.nsb import avoidance_of
from escort_mj.control.outer_loops.constraints import MOST, Constraints, SpeedBounds, find_constraints
from escort_mj.control.outer_loops.nearest_velocity import STIFFNESS, nearest_velocity
from escort_mj.control.outer_loops.outer_loop import OuterLoop, has_stack, slow_down
from escort_mj.control.outer_loops.passing import Clearance, Rules
from escort_mj.native.kernels import DOUBLE, matrix_at, stack_memory, vector_at
from escort_mj.native.lanes import WIDTH
from escort_mj.native.vectors import norm, numbers_at, set_numbers_at
from escort_mj.plan import Plan, State


class BarrierFilter(OuterLoop):
    """Escort behaviors by priority, with a safety filter instead of the avoidance task (Ames et al. 2017).

    With the margin h = d - d_0 to an obstacle and the safe distance d_0 of avoid_obstacles, the velocity is
    the one closest to that of the behaviors among those with h' >= -rate * h for each obstacle. Two teammates
    share this condition equally (Wang, Ames, Egerstedt 2017). If no velocity satisfies all conditions, the
    loop takes the one that minimizes the sum of the squared violations.
    """

    title: ClassVar[str] = "barrier filter"
    avoids: ClassVar[bool] = True
    looks_far: ClassVar[bool] = True
    loop: Literal["barrier_filter"] = "barrier_filter"
    rate: PositiveFloat = 1.0
    """Share of the margin that a robot may use up per second or, where the margin is negative, must recover
    [1/s]."""

    def velocity_lanes(self, i: int, phase: int, plan: Plan, state: State) -> None:
        """The same for robots i to i + 7, compiled: what the escort behaviors want stands in `v_d`."""
        first, levels, p = int(plan.phase_first[phase]), int(plan.phase_levels[phase]), state.q.shape[1]
        memory, rules = stack_memory(), Rules(self.rate, UNLIMITED, 0.0, 0.0, 0.0, 0.0)
        rows, bounds = matrix_at(memory, MOST, p), vector_at(memory + DOUBLE * MOST * p, MOST)
        cooperation = vector_at(memory + DOUBLE * MOST * (p + 1), MOST)
        gaps = vector_at(stack_memory(), MOST)
        constraints = Constraints(rows, bounds, cooperation, gaps)
        for robot in range(i, min(i + WIDTH, state.q.shape[0])):
            if not has_stack(robot, phase, plan, state):
                continue
            moved, v = False, numbers_at(state, state.v_d, robot)
            for level in range(first, first + levels):
                if plan.level_avoids[level] != 0.0:
                    clearance = Clearance(level, avoidance_of(level, plan), rules)
                    wanted = v
                    while True:
                        speed = norm(v)
                        limits = SpeedBounds(speed, speed)
                        count = find_constraints(robot, limits, clearance, plan, state, constraints)
                        moved, v = nearest_velocity(rows, bounds, count, STIFFNESS, wanted)
                        if not norm(v) > speed:
                            break
            set_numbers_at(state.v_d, robot, v)
            state.avoidance_active[robot] = 1.0 if moved else 0.0
            slow_down(robot, plan, state)
