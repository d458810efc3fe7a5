"""The steps of the native loop that belong to plugins: compiled when a mission first has one."""

from __future__ import annotations

import math
from typing import Annotated

from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import ACTIVE, DIRECTIONS, ERROR, TRAITS, Task, kept_task
from escort_mj.components.component import block_at
from escort_mj.control.custom.native import NONE, WRONG, note_failure, table_address
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import (
    DOUBLE,
    call_function,
    data_address,
    double_at,
    inlined,
    merged,
    pointer_at,
    view_addresses,
)
from escort_mj.native.lanes import WIDTH
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.radios.radio import SENDS

NEVER = 1e300


class CustomState(Fields):
    """What plugins' components write, and what is kept for them."""

    asked_velocity: Annotated[Array, "n", "p", Value("m/s", "what a behavior asks of robots")]
    asked_x: Annotated[Array, "n", "p", Value("1", "gradient of its task function")]
    asked_other: Annotated[Array, "n", "p", Value("1", "of a second one")]
    asked: Annotated[Array, "n", TRAITS, Value("1", "all else of the task, see `behaviors.task`")]
    wished_direction: Annotated[Array, "n", "p", Value("1", "ways away from what is heard: scratch")]


@merged
def _function(block: int) -> int:
    """Address of the function whose parameters stand at an address; 0 where it is unknown."""
    table, number = table_address(), int(double_at(block))
    for k in range(pointer_at(table)):
        if pointer_at(table + DOUBLE * (1 + 2 * k)) == number:
            return pointer_at(table + DOUBLE * (2 + 2 * k))
    return 0


@merged
def _fails(block: int, state: State) -> bool:
    """Calls a plugin's component for all robots; whether that failed, which is noted."""
    (plan_at, state_at), function, status = view_addresses(state), _function(block), 1
    if function != 0:
        status, _ = call_function(function, (block, block, plan_at, state_at))
    if status == 0 or status == NONE:
        return False
    note_failure(block, plan_at, state_at, -1)
    return True


@merged
def _asked(block: int, number: int, state: State) -> tuple[bool, int]:
    """Calls a plugin's component for a robot, body or question; whether that failed, and what it returned."""
    (plan_at, state_at), function, status, found = view_addresses(state), _function(block), 1, 0
    if function != 0:
        status, found = call_function(function, (block, block, plan_at, state_at, number))
    if status == 0 or status == NONE:
        return False, found
    note_failure(block, plan_at, state_at, number)
    return True, found


@merged
def _note_wrong(block: int, robot: int, state: State) -> None:
    """Notes that a component gave a robot or body what cannot be used, see `Component.wrong`."""
    plan_at, state_at = view_addresses(state)
    note_failure(block, plan_at, state_at, WRONG - robot)


@inlined
def _sum_of(numbers: Array) -> float:
    """Return the sum of a row of numbers: it is finite where all of them are."""
    total = 0.0
    for k in range(numbers.shape[0]):
        total += numbers[k]
    return total


@merged
def custom_law(plan: Plan, state: State) -> None:
    """Has a plugin's law write forces and rates; where it fails, no force is a number any more."""
    n = state.q.shape[0]
    for i in range(n):
        state.tau[i] = 0.0
        state.rho_hat_rate[i] = 0.0
    block = data_address(plan.parameters)
    if _fails(block, state):
        for i in range(n):
            state.tau[i] = math.nan
        return
    for i in range(n):
        if not math.isfinite(_sum_of(state.tau[i])):
            _note_wrong(block, i, state)


@on_demand
def custom_policy(block: int, b: int, plan: Plan, state: State) -> int:
    """Asks a plugin's policy for what body b wants; where it fails, its wish is not a number.

    Returns:
        What the policy returned.
    """
    failed, acts = _asked(block, b, state)
    if failed:
        state.mover_wish[b] = math.nan
    elif not math.isfinite(_sum_of(state.mover_wish[b])):
        _note_wrong(block, b, state)
    return acts


@on_demand
def custom_estimator(block: int, i: int, plan: Plan, state: State) -> None:
    """Has a plugin's estimator change the belief of robot i; where it fails, that is not a number."""
    failed, _ = _asked(block, i, state)
    total = state.belief_time[i] + state.belief_fix[i]
    total += _sum_of(state.belief[i]) + _sum_of(state.belief_covariance[i])
    if not failed and not math.isfinite(total):
        _note_wrong(block, i, state)
    if failed or not math.isfinite(total):
        state.belief[i] = math.nan


@on_demand
def custom_radio(block: int, question: int, plan: Plan, state: State) -> None:
    """Asks a plugin's radio about a message; where it fails, none is sent any more.

    Each message is sent later than the one before, is lost or not, and takes no negative time.
    """
    sender = int(state.message_sender[0])
    state.message_due[0] = state.message_lost[0] = state.message_delay[0] = 0.0
    failed, _ = _asked(block, question, state)
    total, lost = state.message_due[0] + state.message_delay[0], state.message_lost[0]
    total += _sum_of(state.link_memory)
    good = math.isfinite(total) and state.message_delay[0] >= 0.0 and (lost == 0.0 or lost == 1.0)
    if question == SENDS and state.message_due[0] <= state.next_message[sender]:
        good = False
    if not failed and not good:
        _note_wrong(block, sender, state)
    if failed or not good:
        state.message_due[0], state.message_lost[0] = NEVER, 1.0
        state.message_delay[0] = 0.0


@on_demand
def custom_disturbance(block: int, plan: Plan, state: State) -> None:
    """Has a plugin's disturbance write its forces; where it fails, they are no numbers."""
    failed = _fails(block, state)
    for i in range(state.q.shape[0]):
        if failed:
            state.disturbance_force[i] = math.nan
        elif not math.isfinite(_sum_of(state.disturbance_force[i])):
            _note_wrong(block, i, state)


@on_demand
def custom_failure(block: int, i: int, plan: Plan, state: State) -> None:
    """Has a plugin's failure command the motors of robot i; where it fails, their forces are no numbers."""
    failed, _ = _asked(block, i, state)
    if failed:
        state.failure_command[i] = math.nan
    elif not math.isfinite(_sum_of(state.failure_command[i])):
        _note_wrong(block, i, state)


@on_demand
def custom_rule(phase: int, plan: Plan, state: State) -> None:
    """Asks a plugin's rule of all robots what it compares; where it fails, that is no number."""
    block, n = block_at(int(plan.phase_rule_place[phase]), plan), state.q.shape[0]
    state.memory_row[0] = plan.phase_rule_row[phase]
    for i in range(0, n, WIDTH):
        failed, _ = _asked(block, i, state)
        for robot in range(i, min(i + WIDTH, n)):
            if failed:
                state.compared[robot] = math.nan
            elif not math.isfinite(state.compared[robot]):
                _note_wrong(block, robot, state)


@on_demand
def custom_sensor(block: int, question: int, plan: Plan, state: State) -> None:
    """Asks a plugin's sensor along one axis; where it fails, what it shows is not a number."""
    failed, _ = _asked(block, question, state)
    for i in range(state.q.shape[0]):
        total = state.sensor_shown[i]
        for j in range(state.sensor_memory.shape[0]):
            total += state.sensor_memory[j, i]
        if failed:
            state.sensor_shown[i] = math.nan
        elif not math.isfinite(total):
            _note_wrong(block, i, state)


@inlined
def custom_task(level: int, r: Robots) -> Task:
    """Return what a plugin's behavior asks of robots.

    Args:
        level: The behavior's level, of all phases' levels.
        r: The robots.
    """
    _ask_plugin(level, r.i, r.plan, r.state)
    return kept_task(r.state, r.i)


@on_demand
def _ask_plugin(level: int, i: int, plan: Plan, state: State) -> None:
    """Has a plugin's behavior keep its task for robots i to i + 7; where it fails, it asks for no numbers."""
    block = block_at(int(plan.level_place[level]), plan)
    state.memory_row[0] = plan.level_memory[level]
    failed, _ = _asked(block, i, state)
    for robot in range(i, min(i + WIDTH, state.q.shape[0])):
        total = state.asked[robot, ERROR] + _sum_of(state.asked_velocity[robot])
        if failed:
            state.asked_velocity[robot] = math.nan
            state.asked[robot, DIRECTIONS] = state.asked[robot, ACTIVE] = 1.0
        elif state.asked[robot, ACTIVE] != 0.0 and not math.isfinite(total):
            _note_wrong(block, robot, state)
