"""The controller of the paper's figure 1, one evaluation at a time: measure, outer loop, inner loop.

`evaluate` is what the physics callback calls at every step. It may be called again at the same time
(MuJoCo does in `mj_forward`): the state advances only when time has.
"""

from __future__ import annotations

from typing import Annotated

from escort_mj.behaviors.formation import place_formations
from escort_mj.behaviors.goal import choose_goals
from escort_mj.behaviors.learned import evaluate_networks
from escort_mj.behaviors.surface import choose_radii
from escort_mj.behaviors.vertices import turn_figures
from escort_mj.components.memory import integrate_memory
from escort_mj.components.movers import drive, place_movers
from escort_mj.control.conflicts import weigh_tasks
from escort_mj.control.deciding import decide
from escort_mj.control.disturbing import disturb
from escort_mj.control.failure import command_failing_motors, notice_losses
from escort_mj.control.harmonics import follow
from escort_mj.control.inner import inner_loop, law_in
from escort_mj.control.knowing import know
from escort_mj.control.opponents import assign_guards, judge_opponents
from escort_mj.control.outer_loops.meeting import bound_velocities
from escort_mj.control.reading import read_sensors
from escort_mj.control.supervisor import supervise
from escort_mj.control.teams import form_teams
from escort_mj.control.trigger import refresh
from escort_mj.control.velocity import reference_velocities
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import (
    WIDTH,
    copy_lanes,
    copy_numbers,
    load,
    store,
)
from escort_mj.native.on_demand import on_demand, on_demand_unrolled
from escort_mj.native.vectors import numbers_at, one_row, set_numbers_at, set_rows
from escort_mj.numerics.neighbors import keep_all_neighbors
from escort_mj.numerics.program import evaluate_program, value_of
from escort_mj.plan import Plan, State
from escort_mj.sensing.lidar import scan
from escort_mj.sensing.measure import measure_all


class ControllerParameters(Fields):
    """When samples are taken, and functions of time."""

    stride: Annotated[int, Value("1", "every so many physics steps a sample is taken")]
    extra: Annotated[Array, "extra", Value("1", "physics steps of further samples, ascending")]
    target: Annotated[Array, "p", 2, Value("1", "first instruction and their number, axis by axis")]
    disturbance: Annotated[Array, "p", 2, Value("1", "likewise")]


class ControllerState(Fields):
    """Where in time the controller is, and what it has worked out for the next step."""

    started: Annotated[Array, 1, Value("1", "whether the law has been evaluated")]
    last_time: Annotated[Array, 1, Value("s", "of the last evaluation")]
    evaluated: Annotated[Array, 1, Value("1", "steps evaluated before the present one")]
    step: Annotated[Array, 1, Value("1", "number of the present step")]
    sampled: Annotated[Array, 1, Value("1", "whether a sample is taken in the present step")]
    next_known: Annotated[Array, 1, Value("1", "whether what follows is known")]
    next_time: Annotated[Array, 1, Value("s", "of the next step")]
    next_target_position: Annotated[Array, "p", Value("m", "at that time")]
    next_target_velocity: Annotated[Array, "p", Value("m/s", "likewise")]
    next_disturbance: Annotated[Array, "p", Value("N", "likewise, on every robot")]


@on_demand_unrolled
def evaluate(plan: Plan, state: State) -> None:
    """One evaluation of the law: reads `time`, `q`, `v` of the state, writes all its control signals.

    Args:
        plan: What the controller is given.
        state: Its state; `tau` is the force demanded, `command` the command of the motors, `disturbance` the
            force that the plant is to add.
    """
    state.step[0] = round(state.time[0] / plan.timestep)
    moved = advance(plan, state)
    follow_time(plan, state)
    if plan.disturbance_kind.shape[0] > 0:
        disturb(plan, state)
    if plan.mover_mass.shape[0] > 0:
        place_movers(plan, state)
        if moved and plan.willed:
            if plan.opponent_obstacle.shape[0] > 0:
                judge_opponents(plan, state)
            decide(plan, state)
        drive(plan, state)
    measure_all(plan, state)
    if plan.own_sensor.shape[0] > 0:
        read_sensors(moved, plan, state)
    if moved and plan.lidar_rays.shape[0] > 0:
        scan(plan, state)
    state.sampled[0] = is_sampled(int(state.step[0]), plan)
    if moved and plan.apart:
        if plan.team_radius.shape[0] > 0:
            form_teams(plan, state)
        if plan.estimating:
            know(plan, state)
    if state.neighbors.shape[0] > 0:
        keep_all_neighbors(plan, state)
    n, p = state.q.shape
    for at in range(0, n * p, WIDTH):
        store(state.e, at, load(state.q_d, at) - load(state.q_measured, at))
    failing = plan.failure.shape[0] > 0
    if failing:
        notice_losses(plan, state)
    if moved and plan.opponent_obstacle.shape[0] > 0:
        assign_guards(plan, state)
    if plan.phase_first.shape[0] > 1:
        supervise(plan, state)
    if moved and plan.goal_phase.shape[0] > 0:
        choose_goals(plan, state)
    if moved and plan.formation_phase.shape[0] > 0:
        place_formations(plan, state)
    if moved and plan.learned_phase.shape[0] > 0:
        evaluate_networks(plan, state)
    if plan.radius_least.shape[0] > 0:
        choose_radii(plan, state)
    someone = plan.alike or refresh(plan, state)
    if someone and moved and plan.vertices.shape[0] > 0:
        turn_figures(plan, state)
    if plan.outer_meets:
        bound_velocities(plan, state)
    for i in range(0, n, WIDTH):
        reference_velocities(i, plan, state, moved)
    if state.sampled[0] != 0.0:
        for i in range(0, n, WIDTH):
            weigh_tasks(i, plan, state)
    inner_loop(plan, state)
    copy_lanes(state.tau, state.command, n * p)
    if failing:
        command_failing_motors(plan, state)


@inlined
def is_sampled(step: int, plan: Plan) -> bool:
    """Whether a sample is taken in a physics step."""
    low, high = 0, plan.extra.shape[0]
    while low < high:
        middle = (low + high) // 2
        if plan.extra[middle] < step:
            low = middle + 1
        else:
            high = middle
    return step % plan.stride == 0 or (low < plan.extra.shape[0] and plan.extra[low] == step)


@merged
def advance(plan: Plan, state: State) -> bool:
    """Integrates reference, estimate and components' own memory since the last evaluation (eqs. 2, 10).

    Returns:
        Whether this is the first evaluation at the present time.
    """
    n, p = state.q.shape
    time = state.time[0]
    moved = False
    if state.started[0] == 0.0:
        moved = True
        for i in range(n):
            state.slopes[i] = plan.slope_at_start[i]
            state.rho_hat[i] = plan.estimate_at_start[i]
            if plan.laws.shape[0] > 0:
                team = int(plan.team_start[i]) - 1 if plan.team_start.shape[0] > 0 else 0
                state.law_of[i] = law_in(i, team, plan)
        copy_numbers(state.q, state.q_d, n * p)
        for i in range(state.rotation.shape[0]):
            for a in range(p):
                for b in range(p):
                    state.rotation[i, a, b] = 1.0 if a == b else 0.0
        copy_numbers(plan.vertices, state.vertices, plan.vertices.shape[0] * p)
        for c in range(plan.predecessors.shape[0]):
            for i in range(n):
                state.predecessors[c, i] = plan.predecessors[c, i]
        state.chord_length[0] = plan.chord_length
        copy_numbers(plan.obstacle_position, state.obstacle_position, plan.obstacle_radius.shape[0] * p)
        state.started[0] = 1.0
    elif time > state.last_time[0]:
        moved = True
        state.evaluated[0] += 1.0
        for at in range(0, n * p, WIDTH):
            store(state.q_d, at, load(state.q_d, at) + plan.timestep * load(state.q_d_rate, at))
            store(state.rho_hat, at, load(state.rho_hat, at) + plan.timestep * load(state.rho_hat_rate, at))
        for i in range(state.v_d_rate.shape[0]):
            filtered = numbers_at(state, state.v_d_filtered, i)
            rate = numbers_at(state, state.v_d_rate, i)
            set_numbers_at(state.v_d_filtered, i, filtered + plan.timestep * rate)
        if state.component_memory.shape[0] > 0:
            integrate_memory(plan, state)
    state.last_time[0] = time
    return moved


@on_demand
def follow_time(plan: Plan, state: State) -> None:
    """Target and disturbance at the present time, and at the next step, for which they are kept."""
    n, p = state.q.shape
    position, velocity = state.next_target_position, state.next_target_velocity
    push = state.next_disturbance
    for later in range(2):
        time = state.time[0] + later * plan.timestep
        if later == 1 or state.next_known[0] == 0.0 or state.next_time[0] != time:
            follow(plan, time, position, velocity, push)
            for k in range(p):
                if plan.target[k, 1] > 0.0:
                    position[k], velocity[k] = evaluate_program(
                        plan.code, int(plan.target[k, 0]), int(plan.target[k, 1]), plan.segments, time,
                        state.operands,
                    )  # fmt: skip
                first, count = int(plan.disturbance[k, 0]), int(plan.disturbance[k, 1])
                if count > 0:
                    push[k] = value_of(plan.code, first, count, plan.segments, time, state.operands)
            state.next_known[0], state.next_time[0] = 1.0, time
        if later == 0:
            copy_numbers(position, state.target_position, p)
            copy_numbers(velocity, state.target_velocity, p)
            for i in range(0, n, WIDTH):
                set_rows(state.disturbance, i, one_row(state, push))
