"""The native callbacks: MuJoCo calls them at every physics step, with no Python and no lock in between.

Both find everything from the model and data that MuJoCo hands them, so any number of models and threads
can be stepped at once; a model that is not ours is left alone at once.

They are compiled once for two axes, once for three and once for any more, each when a model first needs it:
where the compiler knows the number of axes, it unrolls the loops over them. Where models of several such
classes are stepped at once, a third pair stands before them and sends each model to its own.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from escort_mj.control.conflicts import weigh_tasks
from escort_mj.control.plan import axes_of
from escort_mj.kernels import DOUBLE, OPTIONS, compiling, pointer_at
from escort_mj.on_demand import fetch
from escort_mj.world.build import World
from escort_mj.world.library import library
from escort_mj.world.step import MODEL_NUMERIC, control, is_ours, look

MANY = 4  # the class of all numbers of axes from here on
ACCELERATION_STAGE = int(mujoco.mjtStage.mjSTAGE_ACC)

CONTROL = types.void(types.intp, types.intp)
SENSOR = types.void(types.intp, types.intp, types.int32)
_OPTIONS = {key: value for key, value in OPTIONS.items() if key != "nogil"}

_compiling = threading.Lock()  # threads that begin together compile once

Callbacks = tuple[Any, Any]
"""What to install as `mjcb_control`, and as `mjcb_sensor`."""


def callbacks(axes: int) -> Callbacks:
    """The callbacks for models of so many axes, compiled or read from the cache; others are left alone.

    `control` evaluates the law before MuJoCo solves for accelerations. `look` runs as a sensor after the
    solve: only then do contact forces belong to this step. The first time that a class of models is compiled
    on a machine, a second process compiles a part of it into the same cache.
    """
    known = min(axes, MANY)
    with _compiling, compiling():
        done = Path(numba.config.CACHE_DIR) / f"axes_{known}"
        helper = None if done.exists() else _second_process(known)
        control_callback = _control(known)
        if helper is not None:
            helper.wait()
        found = control_callback, _look(known)
        if helper is not None:
            done.parent.mkdir(parents=True, exist_ok=True)
            done.touch()
    return found


def _second_process(known: int) -> subprocess.Popen[bytes] | None:
    """Has `compile_ahead` run beside this process; without it, whoever needs its kernels compiles them."""
    if (os.cpu_count() or 1) < 2:
        return None
    program = f"from escort_mj.world.callback import compile_ahead; compile_ahead({known})"
    quiet = subprocess.DEVNULL
    try:
        return subprocess.Popen([sys.executable, "-c", program], stdin=quiet, stdout=quiet, stderr=quiet)
    except OSError:
        return None


def compile_ahead(known: int) -> None:
    """Compiles what a first run needs beside `control`: `look`, and what weighs the tasks at each sample."""
    with compiling():
        _look(known)
        fetch(weigh_tasks, known if known < MANY else None)


@cache
def _control(known: int) -> Any:
    """The first callback of a class of models; the compiler and its cache know the number of axes."""
    if known < MANY:

        @numba.cfunc(CONTROL, cache=True, **_OPTIONS)
        def control_callback(m, d):
            if is_ours(m) and axes_of(pointer_at(m + MODEL_NUMERIC)) == known:
                control(m, d, known)

        return control_callback

    @numba.cfunc(CONTROL, cache=True, **_OPTIONS)
    def control_callback_of_many(m, d):
        if is_ours(m):
            axes = axes_of(pointer_at(m + MODEL_NUMERIC))
            if axes >= known:
                control(m, d, axes)

    return control_callback_of_many


@cache
def _look(known: int) -> Any:
    """The second callback, likewise."""
    if known < MANY:

        @numba.cfunc(SENSOR, cache=True, **_OPTIONS)
        def sensor_callback(m, d, stage):
            if stage == ACCELERATION_STAGE and is_ours(m) and axes_of(pointer_at(m + MODEL_NUMERIC)) == known:
                look(m, d, known)

        return sensor_callback

    @numba.cfunc(SENSOR, cache=True, **_OPTIONS)
    def sensor_callback_of_many(m, d, stage):
        if stage == ACCELERATION_STAGE and is_ours(m):
            axes = axes_of(pointer_at(m + MODEL_NUMERIC))
            if axes >= known:
                look(m, d, axes)

    return sensor_callback_of_many


@intrinsic
def _call(context: Any, address: Any, arguments: Any) -> Any:
    """Calls the C function at an address with a tuple of arguments."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kinds = [context.get_value_type(kind) for kind in signature.args[1]]
        function = builder.inttoptr(values[0], ir.FunctionType(ir.VoidType(), kinds).as_pointer())
        builder.call(function, cgutils.unpack_tuple(builder, values[1], len(kinds)))
        return context.get_dummy_value()

    return types.void(types.intp, arguments), generate


_table = (ctypes.c_void_p * (2 * (MANY + 1)))()  # addresses by class: control, sensor


@cache
def _dispatcher() -> Callbacks:
    """Callbacks that look up a model's class in `_table`; not cached, for its address is in them."""
    table = ctypes.addressof(_table)
    last = MANY

    @numba.cfunc(CONTROL, **_OPTIONS)
    def control_callback(m, d):
        if is_ours(m):
            axes = axes_of(pointer_at(m + MODEL_NUMERIC))
            callback = pointer_at(table + DOUBLE * 2 * min(axes, last))
            if callback != 0:
                _call(callback, (m, d))

    @numba.cfunc(SENSOR, **_OPTIONS)
    def sensor_callback(m, d, stage):
        if stage == ACCELERATION_STAGE and is_ours(m):
            callback = pointer_at(
                table + 2 * DOUBLE * min(axes_of(pointer_at(m + MODEL_NUMERIC)), last) + DOUBLE
            )
            if callback != 0:
                _call(callback, (m, d, stage))

    return control_callback, sensor_callback


@cache
def _silence() -> Any:
    """A warning handler that prints and writes nothing; MuJoCo still counts warnings in `MjData`."""
    return ctypes.CFUNCTYPE(None, ctypes.c_char_p)(lambda message: None)


_lock = threading.Lock()
_needed: Counter[int] = Counter()  # classes of models in the loops that are under way
_before: tuple[Any, ...] = ()


@contextmanager
def native_loop(world: World, *others: World) -> Iterator[None]:
    """Installs the callbacks that worlds need while inside; nests, and may be entered by several threads.

    MuJoCo's callbacks are global to the process: what was installed before comes back at the end. So does
    the clock that the bindings install, which costs a fifth of a small step and that nobody reads here.

    Args:
        world: What is stepped inside.
        others: What else is. Models of another class of axes, or of somebody else, are left alone.
    """
    global _before
    classes = Counter({min(each.setup.axes, MANY) for each in (world, *others)})
    for axes in classes:
        _table[2 * axes : 2 * axes + 2] = [
            ctypes.cast(callback.ctypes, ctypes.c_void_p).value for callback in callbacks(axes)
        ]
    timer = ctypes.c_void_p.in_dll(library(), "mjcb_time")
    warning = ctypes.c_void_p.in_dll(library(), "mju_user_warning")
    with _lock:
        if not _needed:
            _before = (mujoco.get_mjcb_control(), mujoco.get_mjcb_sensor(), timer.value, warning.value)
            timer.value = None
            warning.value = ctypes.cast(_silence(), ctypes.c_void_p).value
        _needed.update(classes)
        _install()
    try:
        yield
    finally:
        with _lock:
            _needed.subtract(classes)
            for axes in classes:
                if not _needed[axes]:
                    del _needed[axes]
            if _needed:
                _install()
            else:
                mujoco.set_mjcb_control(_before[0])
                mujoco.set_mjcb_sensor(_before[1])
                timer.value, warning.value = _before[2], _before[3]


def _install() -> None:
    """Hands MuJoCo the callbacks of the one class that is needed, or those that tell classes apart."""
    control, sensor = callbacks(next(iter(_needed))) if len(_needed) == 1 else _dispatcher()
    mujoco.set_mjcb_control(control.ctypes)
    mujoco.set_mjcb_sensor(sensor.ctypes)
