"""The native callbacks: MuJoCo calls them at every physics step, with no Python and no lock in between.

Both find everything from the model and data that MuJoCo hands them, so any number of models and threads
can be stepped at once; a model that is not ours is left alone at once.

`control` runs before MuJoCo solves for accelerations: it evaluates the law and sets forces. `watch` runs
as a sensor after the solve: only then do contact forces belong to this step.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numba
from numba import types

from escort_mj.control.controller import evaluate
from escort_mj.control.plan import MAGIC, axes_of, unpack_plan, unpack_state
from escort_mj.kernels import DOUBLE, OPTIONS, double_at, inlined, int_at, pointer_at, vector_at
from escort_mj.world.layout import offset, structure
from escort_mj.world.mass import INT, mass_block
from escort_mj.world.truth import observe
from escort_mj.world.watch import watch
from escort_mj.world.wiring import wiring_behind


@cache
def callbacks() -> tuple[Any, Any]:
    """Compiles the two callbacks for the MuJoCo that is installed.

    Field offsets are variables of this closure: numba keys its cache by them, as it would not by globals.
    """
    m_numbers = offset("mjModel", "nnumericdata")
    m_numeric = offset("mjModel", "numeric_data")
    m_cone = offset("mjModel", "opt.cone")
    d_time, d_userdata = offset("mjData", "time"), offset("mjData", "userdata")
    d_qpos, d_qvel, d_ctrl = offset("mjData", "qpos"), offset("mjData", "qvel"), offset("mjData", "ctrl")
    d_applied, d_mocap = offset("mjData", "qfrc_applied"), offset("mjData", "mocap_pos")
    d_mass, d_bias = offset("mjData", "M"), offset("mjData", "qfrc_bias")
    d_acceleration = offset("mjData", "qacc")
    m_row_sizes, m_row_starts = offset("mjModel", "M_rownnz"), offset("mjModel", "M_rowadr")
    m_columns = offset("mjModel", "M_colind")
    d_force, d_efc_force = offset("mjData", "actuator_force"), offset("mjData", "efc_force")
    d_ncon, d_contact = offset("mjData", "ncon"), offset("mjData", "contact")
    c_size = ctypes.sizeof(structure("mjContact"))
    c_dim, c_geoms = offset("mjContact", "dim"), offset("mjContact", "geom")
    c_efc = offset("mjContact", "efc_address")
    pyramidal = int(mujoco.mjtCone.mjCONE_PYRAMIDAL)
    acceleration_stage = int(mujoco.mjtStage.mjSTAGE_ACC)

    @inlined
    def is_ours(m: int) -> bool:
        """Whether a model carries a plan of ours."""
        return int_at(m + m_numbers) > 0 and double_at(pointer_at(m + m_numeric)) == MAGIC

    @inlined
    def wiring_of(m: int) -> Any:
        """The wiring that a model carries behind its plan."""
        return wiring_behind(pointer_at(m + m_numeric))

    @inlined
    def tell_model(m: int, d: int, wiring: Any, state: Any) -> None:
        """Shows the law MuJoCo's own mass matrix and bias force, which are those of the present state."""
        n, p = state.q.shape
        for i in range(n):
            first = int(wiring.dof_address[i])
            mass_block(
                pointer_at(d + d_mass), pointer_at(m + m_row_sizes), pointer_at(m + m_row_starts),
                pointer_at(m + m_columns), first, p, state.model_mass[i],
            )  # fmt: skip
            bias = vector_at(pointer_at(d + d_bias) + DOUBLE * first, p)
            for k in range(p):
                state.model_bias[i, k] = bias[k]

    @inlined
    def control(m: int, d: int, axes: int) -> None:
        """Evaluates the law for the present state and applies its forces."""
        numbers = pointer_at(m + m_numeric)
        plan = unpack_plan(numbers, axes)
        state = unpack_state(numbers, pointer_at(d + d_userdata), axes)
        wiring = wiring_of(m)
        n, p = state.q.shape
        nq = state.qpos.shape[0]
        qpos = vector_at(pointer_at(d + d_qpos), nq)
        qvel = vector_at(pointer_at(d + d_qvel), nq)
        state.time[0] = double_at(d + d_time)
        for c in range(nq):
            state.qpos[c] = qpos[c]
        for i in range(n):
            for k in range(p):
                state.q[i, k] = qpos[int(wiring.qpos_address[i]) + k]
                state.v[i, k] = qvel[int(wiring.dof_address[i]) + k]
        if state.model_bias.shape[0] > 0:
            tell_model(m, d, wiring, state)
        evaluate(plan, state)
        ctrl = vector_at(pointer_at(d + d_ctrl), n * p)
        applied = vector_at(pointer_at(d + d_applied), nq)
        for i in range(n):
            for k in range(p):
                ctrl[i * p + k] = state.command[i, k]
                applied[int(wiring.dof_address[i]) + k] = state.disturbance[i, k]
        target = vector_at(pointer_at(d + d_mocap), p)
        for k in range(p):  # where it will be when MuJoCo next looks
            target[k] = state.target_position[k] + plan.timestep * state.target_velocity[k]

    @inlined
    def look(m: int, d: int, axes: int) -> None:
        """Records what the solved step brought."""
        numbers = pointer_at(m + m_numeric)
        plan = unpack_plan(numbers, axes)
        state = unpack_state(numbers, pointer_at(d + d_userdata), axes)
        n, p = state.q.shape
        applied = vector_at(pointer_at(d + d_force), n * p)
        for i in range(n):
            for k in range(p):
                state.force[i, k] = applied[i * p + k]
        if plan.truth:
            observe(
                numbers,
                pointer_at(d + d_userdata),
                axes,
                pointer_at(d + d_mass),
                pointer_at(m + m_row_sizes),
                pointer_at(m + m_row_starts),
                pointer_at(m + m_columns),
                pointer_at(d + d_bias),
                pointer_at(d + d_acceleration),
            )
        touching, largest = 0, 0.0
        count = int_at(d + d_ncon)
        if count > 0:
            group = wiring_of(m).geom_group
            first = pointer_at(d + d_contact)
            forces = pointer_at(d + d_efc_force)
            for c in range(count):
                contact = first + c * c_size
                efc = int_at(contact + c_efc)
                geom1, geom2 = int_at(contact + c_geoms), int_at(contact + c_geoms + INT)
                if efc < 0 or geom1 < 0 or geom2 < 0 or group[geom1] == 0.0 or group[geom2] == 0.0:
                    continue
                if touching < state.touching.shape[1]:
                    state.touching[1, touching] = geom1 * group.shape[0] + geom2
                touching += 1
                dim = int_at(contact + c_dim)
                rows = 2 * (dim - 1) if int_at(m + m_cone) == pyramidal and dim > 1 else 1
                normal = 0.0
                for row in range(rows):
                    normal += double_at(forces + DOUBLE * (efc + row))
                largest = max(largest, normal)
        watch(plan, state, touching, largest)

    options = {key: value for key, value in OPTIONS.items() if key != "nogil"}

    @numba.cfunc(types.void(types.intp, types.intp), cache=True, **options)
    def control_callback(m, d):
        if is_ours(m):  # literal axes: the compiler makes one version for each
            if axes_of(pointer_at(m + m_numeric)) == 2:
                control(m, d, 2)
            else:
                control(m, d, 3)

    @numba.cfunc(types.void(types.intp, types.intp, types.int32), cache=True, **options)
    def sensor_callback(m, d, stage):
        if stage == acceleration_stage and is_ours(m):
            if axes_of(pointer_at(m + m_numeric)) == 2:
                look(m, d, 2)
            else:
                look(m, d, 3)

    return control_callback, sensor_callback


@cache
def _library() -> ctypes.CDLL:
    """The MuJoCo library that the bindings have loaded."""
    folder = Path(mujoco.__file__).parent
    (path,) = [*folder.glob("libmujoco.so*"), *folder.glob("libmujoco*.dylib"), *folder.glob("mujoco.dll")][
        :1
    ]
    return ctypes.CDLL(str(path))


@cache
def _silence() -> Any:
    """A warning handler that prints and writes nothing; MuJoCo still counts warnings in `MjData`."""
    return ctypes.CFUNCTYPE(None, ctypes.c_char_p)(lambda message: None)


_lock = threading.Lock()
_installed = 0
_before: tuple[Any, ...] = ()


@contextmanager
def native_loop() -> Iterator[None]:
    """Installs the callbacks while inside; nests, and may be entered by several threads.

    MuJoCo's callbacks are global to the process: what was installed before comes back at the end. So does
    the clock that the bindings install, which costs a fifth of a small step and that nobody reads here.
    """
    global _installed, _before
    control, sensor = callbacks()
    timer = ctypes.c_void_p.in_dll(_library(), "mjcb_time")
    warning = ctypes.c_void_p.in_dll(_library(), "mju_user_warning")
    with _lock:
        if _installed == 0:
            _before = (mujoco.get_mjcb_control(), mujoco.get_mjcb_sensor(), timer.value, warning.value)
            mujoco.set_mjcb_control(control.ctypes)
            mujoco.set_mjcb_sensor(sensor.ctypes)
            timer.value = None
            warning.value = ctypes.cast(_silence(), ctypes.c_void_p).value
        _installed += 1
    try:
        yield
    finally:
        with _lock:
            _installed -= 1
            if _installed == 0:
                mujoco.set_mjcb_control(_before[0])
                mujoco.set_mjcb_sensor(_before[1])
                timer.value, warning.value = _before[2], _before[3]
