"""What MuJoCo calls in a physics step, and what that does with the memory of MuJoCo's own structures.

Offsets into them are constants of this module; machine code lies in a folder named by MuJoCo's version, among
others (`native.cache.cache_key`).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_int

import mujoco

from escort_mj.control.controller import evaluate
from escort_mj.memory.layout import MAGIC, axes_of, unpack_plan, unpack_state
from escort_mj.monitor.clearances import is_noted, note_step
from escort_mj.monitor.contacts import begin, settle, touch, touch_overlaps, touch_what_stands
from escort_mj.monitor.mass import INT, kinetic_energy, mass_block
from escort_mj.monitor.sampling import keep
from escort_mj.monitor.truth import observe_truth
from escort_mj.native.kernels import (
    DOUBLE,
    call_at,
    double_at,
    inlined,
    int_at,
    merged,
    place,
    pointer_at,
    vector_at,
)
from escort_mj.native.lanes import copy_in, copy_numbers
from escort_mj.native.on_demand import CLASSES, callback, on_demand
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses
from escort_mj.world.loop.addresses import behind, unpack_addresses
from escort_mj.world.loop.drives import read_forces, read_headings, read_points
from escort_mj.world.loop.layout import offset, size
from escort_mj.world.loop.motors import command_motors
from escort_mj.world.loop.nearest import find_nearest
from escort_mj.world.loop.parts import watch_parts
from escort_mj.world.loop.water import float_vessels
from escort_mj.world.stages import IN_SPACE

MODEL_NUMBERS = offset("mjModel", "nnumericdata")
MODEL_NUMERIC = offset("mjModel", "numeric_data")
MODEL_CONE, MODEL_FREEDOMS = offset("mjModel", "opt.cone"), offset("mjModel", "nv")
DATA_TIME, DATA_USERDATA = offset("mjData", "time"), offset("mjData", "userdata")
DATA_QPOS, DATA_QVEL, DATA_CTRL = offset("mjData", "qpos"), offset("mjData", "qvel"), offset("mjData", "ctrl")
DATA_APPLIED, DATA_MOCAP = offset("mjData", "qfrc_applied"), offset("mjData", "mocap_pos")
DATA_ACTIVATION = offset("mjData", "act")
DATA_MASS, DATA_BIAS = offset("mjData", "M"), offset("mjData", "qfrc_bias")
DATA_ACCELERATION = offset("mjData", "qacc")
MODEL_ROW_SIZES, MODEL_ROW_STARTS = offset("mjModel", "M_rownnz"), offset("mjModel", "M_rowadr")
MODEL_ENTRIES = offset("mjModel", "nC")
MODEL_COLUMNS = offset("mjModel", "M_colind")
DATA_FORCE, DATA_EFC_FORCE = offset("mjData", "qfrc_actuator"), offset("mjData", "efc_force")
DATA_EFC_VELOCITY = offset("mjData", "efc_vel")
DATA_NCON, DATA_CONTACT = offset("mjData", "ncon"), offset("mjData", "contact")
CONTACT_SIZE = size("mjContact")
CONTACT_DIM, CONTACT_GEOMS = offset("mjContact", "dim"), offset("mjContact", "geom")
CONTACT_EFC, CONTACT_DISTANCE = offset("mjContact", "efc_address"), offset("mjContact", "dist")
CONTACT_NORMAL = offset("mjContact", "frame")
MANY = 4  # the class of all numbers of axes from here on
ACCELERATION_STAGE = int(mujoco.mjtStage.mjSTAGE_ACC)
PYRAMIDAL = int(mujoco.mjtCone.mjCONE_PYRAMIDAL)


@inlined
def is_ours(m: int) -> bool:
    """Whether a model carries a plan of ours."""
    return int_at(m + MODEL_NUMBERS()) > 0 and double_at(pointer_at(m + MODEL_NUMERIC())) == MAGIC


@on_demand
def tell_model(m: int, d: int, addresses: Addresses, state: State) -> None:
    """Shows the law MuJoCo's own mass matrix and bias force, which are those of the present state."""
    n, p = state.q.shape
    for i in range(n):
        first = int(addresses.dof_address[i])
        mass_block(
            pointer_at(d + DATA_MASS()), pointer_at(m + MODEL_ROW_SIZES()),
            pointer_at(m + MODEL_ROW_STARTS()), pointer_at(m + MODEL_COLUMNS()), first, p,
            state.model_mass[i],
        )  # fmt: skip
        bias = vector_at(pointer_at(d + DATA_BIAS()) + DOUBLE * first, p)
        for k in range(p):
            state.model_bias[i, k] = bias[k] - addresses.lift[i, k]


@inlined
def is_led(addresses: Addresses) -> bool:
    """Whether the target is put where it is to be: MuJoCo lets it touch nothing that stands."""
    return addresses.target_address[0] >= 0.0


@merged
def control(m: int, d: int, axes: int) -> None:
    """Evaluates the law for the present state and applies its forces."""
    numbers = pointer_at(m + MODEL_NUMERIC())
    plan = unpack_plan(numbers, axes)
    state = unpack_state(numbers, pointer_at(d + DATA_USERDATA()), axes)
    addresses = unpack_addresses(behind(numbers), axes)
    n, p = state.q.shape
    nq = state.qpos.shape[0]
    qpos = vector_at(pointer_at(d + DATA_QPOS()), nq)
    qvel = vector_at(pointer_at(d + DATA_QVEL()), nq)  # of which there are no more
    state.time[0] = double_at(d + DATA_TIME())
    copy_in(qpos, state.qpos, nq)
    if addresses.in_row:
        copy_in(qpos, state.q, n * p)
        copy_in(qvel, state.v, n * p)
    else:
        for i in range(n):
            for k in range(p):
                state.q[i, k] = qpos[int(addresses.qpos_address[i]) + k]
                state.v[i, k] = qvel[int(addresses.dof_address[i]) + k]
        if addresses.drives.shape[0] > 0:
            read_points(d, state, addresses)
    for b in range(state.mover_position.shape[0]):
        here = vector_at(pointer_at(d + DATA_QPOS()) + DOUBLE * int(addresses.mover_qpos[b]), p)
        speed = vector_at(pointer_at(d + DATA_QVEL()) + DOUBLE * int(addresses.mover_dof[b]), p)
        for k in range(p):
            state.mover_position[b, k], state.mover_velocity[b, k] = here[k], speed[k]
    if addresses.vessels.shape[0] > 0:
        float_vessels(m, d, addresses)
    if state.model_bias.shape[0] > 0:
        tell_model(m, d, addresses, state)
    if state.heading.shape[0] > 0:
        read_headings(d, state, addresses)
    if plan.shaped:
        find_nearest(m, d, plan, state, addresses)
    evaluate(plan, state)
    for b in range(state.mover_force.shape[0]):
        force = vector_at(pointer_at(d + DATA_APPLIED()) + DOUBLE * int(addresses.mover_dof[b]), p)
        for k in range(p):
            force[k] = state.mover_force[b, k]
    applied = vector_at(pointer_at(d + DATA_APPLIED()), nq)
    if addresses.in_row:
        copy_numbers(state.command, vector_at(pointer_at(d + DATA_CTRL()), n * p), n * p)
        copy_numbers(state.disturbance, applied, n * p)
    else:
        controls, activations = pointer_at(d + DATA_CTRL()), pointer_at(d + DATA_ACTIVATION())
        command_motors(d, controls, activations, qpos, qvel, plan, state, addresses)
        for i in range(n):
            if addresses.drive[i] < 0.0:
                for k in range(p):
                    applied[int(addresses.dof_address[i]) + k] = state.disturbance[i, k]
    if is_led(addresses):
        mocap = pointer_at(d + DATA_MOCAP())
        for k in range(p):  # where it will be when MuJoCo next looks
            target = vector_at(mocap + DOUBLE * int(addresses.target_address[k]), 1)
            target[0] = addresses.target_offset[k] + state.next_target_position[k]


@merged
def monitor(m: int, d: int, axes: int) -> None:
    """Records what the solved step brought."""
    numbers = pointer_at(m + MODEL_NUMERIC())
    plan = unpack_plan(numbers, axes)
    state = unpack_state(numbers, pointer_at(d + DATA_USERDATA()), axes)
    addresses = unpack_addresses(behind(numbers), axes)
    n, p = state.q.shape
    applied = vector_at(pointer_at(d + DATA_FORCE()), state.qpos.shape[0])
    if addresses.in_row:
        copy_in(applied, state.force, n * p)
    else:
        for i in range(n):
            for k in range(p):
                state.force[i, k] = applied[int(addresses.dof_address[i]) + k] - addresses.lift[i, k]
        if addresses.drives.shape[0] > 0:
            read_forces(d, state, addresses)
    if plan.truth:
        observe_truth(
            plan,
            state,
            addresses,
            pointer_at(d + DATA_MASS()),
            pointer_at(m + MODEL_ROW_SIZES()),
            pointer_at(m + MODEL_ROW_STARTS()),
            pointer_at(m + MODEL_COLUMNS()),
            pointer_at(d + DATA_BIAS()),
            pointer_at(d + DATA_ACCELERATION()),
        )
    if is_noted(state):
        return
    energy = kinetic_energy(
        pointer_at(d + DATA_MASS()), pointer_at(m + MODEL_ROW_SIZES()), pointer_at(m + MODEL_ROW_STARTS()),
        pointer_at(m + MODEL_COLUMNS()), pointer_at(d + DATA_QVEL()), int_at(m + MODEL_FREEDOMS()),
        int_at(m + MODEL_ENTRIES()),
    )  # fmt: skip
    overlaps = note_step(plan, state, addresses.target_radius, energy)
    if addresses.parts.shape[0] > 0:
        watch_parts(m, d, plan, state, addresses)
    if axes > IN_SPACE:
        touch_overlaps(plan, state, addresses.target_radius)
    elif int_at(d + DATA_NCON()) > 0 or state.under_way[0] > 0.0 or (overlaps and is_led(addresses)):
        monitor_contacts(m, d, plan, state, addresses)
    keep(pointer_at(d + DATA_USERDATA()), plan, state)


@on_demand
def monitor_contacts(m: int, d: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Notes MuJoCo's contacts of the solved step, each with its pair of bodies, and what it cannot see.

    A touch is where surfaces meet, whether or not a gap keeps the force away, and where a contact has a
    force, even if a margin brings it about before surfaces meet.
    The rows of a contact in the solver give its normal force (their sum, as `mj_contactForce` has it) and
    its normal velocity (their mean: in a pyramid's rows what is tangential cancels). A target that is
    led moves without a velocity of MuJoCo's: its own is added. What stands it meets by geometry.
    """
    target, p = state.q.shape[0], state.q.shape[1]
    led = is_led(addresses)
    body = addresses.geom_body
    first = pointer_at(d + DATA_CONTACT())
    forces, velocities = pointer_at(d + DATA_EFC_FORCE()), pointer_at(d + DATA_EFC_VELOCITY())
    pyramidal = int_at(m + MODEL_CONE()) == PYRAMIDAL
    begin(state)
    for c in range(int_at(d + DATA_NCON())):
        contact = first + c * CONTACT_SIZE()
        efc, distance = int_at(contact + CONTACT_EFC()), double_at(contact + CONTACT_DISTANCE())
        geom1, geom2 = int_at(contact + CONTACT_GEOMS()), int_at(contact + CONTACT_GEOMS() + INT)
        if geom1 < 0 or geom2 < 0 or (efc < 0 and distance >= 0.0):
            continue
        body1, body2 = int(body[geom1]), int(body[geom2])
        if body1 < 0 or body2 < 0 or body1 == body2:
            continue
        dim = int_at(contact + CONTACT_DIM())
        rows = 0 if efc < 0 else 2 * (dim - 1) if pyramidal and dim > 1 else 1
        force, opening = 0.0, 0.0
        for row in range(efc, efc + rows):
            force += double_at(forces + DOUBLE * row)
            opening += double_at(velocities + DOUBLE * row) / rows
        if distance > 0.0 and force <= 0.0:
            continue
        if led and (body1 == target or body2 == target):
            for k in range(p):
                moved = state.target_velocity[k] * double_at(contact + CONTACT_NORMAL() + DOUBLE * k)
                opening += moved if body2 == target else -moved
        touch(state, state.time[0], body1, body2, force, -distance, -opening)
    if led and addresses.target_radius > 0.0:
        touch_what_stands(plan, state, addresses.target_radius)
    settle(state, state.time[0], plan.timestep)


# What makes the callbacks of a class of models. All find everything from the model and data that MuJoCo hands
# them, so any number of models and threads can be stepped at once; other models are left alone at once.


@callback(*CLASSES)
def control_callback(axes: int | None) -> Callable[..., None]:
    """Before MuJoCo solves for accelerations: evaluates the law."""
    if axes is None:

        def of_many(m: int, d: int) -> None:
            if is_ours(m):
                axes = axes_of(pointer_at(m + MODEL_NUMERIC()))
                if axes >= MANY:
                    control(m, d, axes)

        return of_many

    def of_few(m: int, d: int) -> None:
        if is_ours(m) and axes_of(pointer_at(m + MODEL_NUMERIC())) == axes:
            control(m, d, axes)

    return of_few


@callback(*CLASSES)
def sensor_callback(axes: int | None) -> Callable[..., None]:
    """A sensor after the solve: only then do contact forces belong to this step."""
    if axes is None:

        def of_many(m: int, d: int, stage: c_int) -> None:
            if stage == ACCELERATION_STAGE and is_ours(m):
                axes = axes_of(pointer_at(m + MODEL_NUMERIC()))
                if axes >= MANY:
                    monitor(m, d, axes)

        return of_many

    def of_few(m: int, d: int, stage: c_int) -> None:
        if stage == ACCELERATION_STAGE and is_ours(m) and axes_of(pointer_at(m + MODEL_NUMERIC())) == axes:
            monitor(m, d, axes)

    return of_few


table = (ctypes.c_void_p * (2 * (MANY + 1)))()
"""Addresses of both callbacks of each class of models, zero where they are not loaded."""
_table = place("escort_mj.world.loop.step.table", ctypes.addressof(table))


@callback(None)
def any_control_callback(axes: int | None) -> Callable[..., None]:
    """Where models of several classes are stepped: sends each to the callback of its own."""

    def of_any(m: int, d: int) -> None:
        if is_ours(m):
            found = pointer_at(_table() + 2 * DOUBLE * min(axes_of(pointer_at(m + MODEL_NUMERIC())), MANY))
            if found != 0:
                call_at(found, (m, d))

    return of_any


@callback(None)
def any_sensor_callback(axes: int | None) -> Callable[..., None]:
    """Likewise."""

    def of_any(m: int, d: int, stage: c_int) -> None:
        if stage == ACCELERATION_STAGE and is_ours(m):
            at = 2 * min(axes_of(pointer_at(m + MODEL_NUMERIC())), MANY) + 1
            found = pointer_at(_table() + DOUBLE * at)
            if found != 0:
                call_at(found, (m, d, stage))

    return of_any
