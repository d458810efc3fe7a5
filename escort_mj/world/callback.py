"""The native callbacks: MuJoCo calls them at every physics step, with no Python and no lock in between.

They are compiled once for two axes, once for three and once for any more, each when a model first needs it:
where the compiler knows the number of axes, it unrolls the loops over them. Where models of several such
classes are stepped at once, another pair stands before them and sends each model to its own.
"""

from __future__ import annotations

import ctypes
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import mujoco

from escort_mj.memory.evaluation import law_pieces
from escort_mj.native import artifacts
from escort_mj.native.artifacts import Artifact
from escort_mj.native.kernels import interpreted
from escort_mj.native.on_demand import piece_of
from escort_mj.world.loop.library import library
from escort_mj.world.loop.step import (
    MANY,
    any_control_callback,
    any_sensor_callback,
    control_callback,
    sensor_callback,
    table,
)
from escort_mj.world.model.build import World

CONTROL = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
SENSOR = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)

Callbacks = tuple[Any, Any]
"""What to install as `mjcb_control`, and as `mjcb_sensor`."""


def callbacks(axes: int) -> Callbacks:
    """The callbacks for models of so many axes, compiled or read from the cache; others are left alone.

    `control` evaluates the law before MuJoCo solves for accelerations. `monitor` runs as a sensor after the
    solve: only then do contact forces belong to this step.
    """
    return _of_class(min(axes, MANY))


@cache
def _of_class(known: int) -> Callbacks:
    """The callbacks of a class of models, and what they call as soon as they run."""
    control, sensor, *others = class_pieces(known if known < MANY else None)
    artifacts.have([control, sensor, *others])
    addresses = artifacts.address(control), artifacts.address(sensor)
    table[2 * known : 2 * known + 2] = list(addresses)
    return CONTROL(addresses[0]), SENSOR(addresses[1])


def class_pieces(axes: int | None) -> list[Artifact]:
    """The control callback and the sensor callback of a class, then what they call as soon as they run.

    Args:
        axes: Number of axes; None for any more.
    """
    return [piece_of(control_callback, axes), piece_of(sensor_callback, axes), *law_pieces(axes)]


@cache
def _of_any_class() -> Callbacks:
    """Callbacks that look up a model's class."""
    pieces = [piece_of(any_control_callback, None), piece_of(any_sensor_callback, None)]
    artifacts.have(pieces)
    return CONTROL(artifacts.address(pieces[0])), SENSOR(artifacts.address(pieces[1]))


_silence = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(lambda message: None)
"""A warning handler that prints and writes nothing; MuJoCo still counts warnings in `MjData`."""
_silent = ctypes.cast(_silence, ctypes.c_void_p).value
_timer = ctypes.c_void_p.in_dll(library(), "mjcb_time")
_warning = ctypes.c_void_p.in_dll(library(), "mju_user_warning")


@cache
def _interpreted() -> Callbacks:
    """Callbacks that run as plain Python, for models of any number of axes."""
    classes = [axes if axes < MANY else None for axes in range(2, MANY + 1)]
    control = [interpreted(control_callback(axes)) for axes in classes]
    sensor = [interpreted(sensor_callback(axes)) for axes in classes]

    def every_control(model: Any, data: Any) -> None:
        for each in control:  # of which one finds the model its own
            each(model._address, data._address)

    def every_sensor(model: Any, data: Any, stage: int) -> None:
        for each in sensor:
            each(model._address, data._address, int(stage))

    return every_control, every_sensor


_lock = threading.Lock()
_needed: Counter[int] = Counter()  # classes of models in the loops that are under way
_by_python = 0  # loops among them that are interpreted
_before: tuple[Any, ...] = ()


@contextmanager
def native_loop(world: World, *others: World, interpret: bool = False) -> Iterator[None]:
    """Install the callbacks that worlds need while inside; nests, and may be entered by several threads.

    MuJoCo's callbacks are global to the process: what was installed before comes back at the end. So does
    the clock that the bindings install, which costs a fifth of a small step and that is not read here.

    Args:
        world: What is stepped inside.
        others: What else is. Models of another class of axes, or of another program, are left alone.
        interpret: Whether kernels run as plain Python, where a debugger can stop: a thousand times slower. As
            long as one loop asks for it, all loops of the process do.
    """
    global _before, _by_python
    classes = {min(each.setup.axes, MANY) for each in (world, *others)}
    for axes in () if interpret else classes:
        callbacks(axes)
    with _lock:
        if not _needed:
            _before = (mujoco.get_mjcb_control(), mujoco.get_mjcb_sensor(), _timer.value, _warning.value)
            _timer.value, _warning.value = None, _silent
        _needed.update(classes)
        _by_python += interpret
        _install()
    try:
        yield
    finally:
        with _lock:
            _needed.subtract(classes)
            _by_python -= interpret
            for axes in classes:
                if not _needed[axes]:
                    del _needed[axes]
            if _needed:
                _install()
            else:
                mujoco.set_mjcb_control(_before[0])
                mujoco.set_mjcb_sensor(_before[1])
                _timer.value, _warning.value = _before[2], _before[3]


def _install() -> None:
    """Hands MuJoCo the callbacks of the one class that is needed, or those that tell classes apart."""
    if _by_python:
        control, sensor = _interpreted()
    else:
        control, sensor = callbacks(next(iter(_needed))) if len(_needed) == 1 else _of_any_class()
    mujoco.set_mjcb_control(control)
    mujoco.set_mjcb_sensor(sensor)
