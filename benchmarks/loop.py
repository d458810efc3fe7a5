"""The controlled, recorded, watched loop against bare `mj_step` of the same model from the same state.

Three loops take turns, round by round, so that a machine whose speed drifts treats them alike:
`native` is what a run does; `bare` steps a copy of its state with the callbacks uninstalled, forces held;
`twin` calls the law in plain NumPy from a Python callback.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from escort_mj.api import load_scenario
from escort_mj.control.reference import ReferenceController
from escort_mj.world.build import World, build
from escort_mj.world.callback import native_loop
from escort_mj.world.library import library
from escort_mj.world.plant import Plant

WARM_UP = 2000  # steps: the mission is under way
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def seconds(function: Callable[[], None]) -> float:
    """Wall time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


@contextmanager
def no_timer() -> Iterator[None]:
    """Takes away the clock that the bindings install, as the native loop does."""
    timer = ctypes.c_void_p.in_dll(library(), "mjcb_time")
    before, timer.value = timer.value, None
    try:
        yield
    finally:
        timer.value = before


def copy_state(world: World, source: mujoco.MjData, target: mujoco.MjData) -> None:
    """Gives one data the physical state, the forces and the controls of another."""
    state = np.empty(mujoco.mj_stateSize(world.model, STATE))
    mujoco.mj_getState(world.model, source, state, STATE)
    mujoco.mj_setState(world.model, target, state, STATE)
    target.ctrl[:] = source.ctrl


def measure(scenario: str, overrides: list[str], rounds: int = 31, steps: int = 1000) -> dict[str, float]:
    """Times the three loops on one scenario.

    Returns:
        Medians over rounds: time a step [us] of `bare`, `native`, `twin`, and the paired ratios to bare.
    """
    world = build(load_scenario(scenario, overrides))
    plant = Plant(world)
    bare, slow = mujoco.MjData(world.model), mujoco.MjData(world.model)
    twin = ReferenceController(world.setup, world.stride)
    n, p = world.sizes["robot"], world.sizes["axis"]

    def control(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        signals = twin.evaluate(data.time, data.qpos.reshape(n, p), data.qvel.reshape(n, p))
        data.ctrl[:] = signals.tau.ravel()
        data.qfrc_applied[:] = signals.disturbance.ravel()

    with native_loop(world):
        plant.step(WARM_UP)
    times: dict[str, list[float]] = {"bare": [], "native": [], "twin": []}
    few = max(steps // 50, 1)
    for _ in range(rounds):
        copy_state(world, plant.data, bare)
        with native_loop(world):
            times["native"].append(seconds(lambda: plant.step(steps)) / steps)
        with no_timer():
            times["bare"].append(seconds(lambda: mujoco.mj_step(world.model, bare, nstep=steps)) / steps)
        copy_state(world, plant.data, slow)
        slow.qfrc_applied[:] = 0.0
        twin.reset(slow.qpos.reshape(n, p))
        mujoco.set_mjcb_control(control)
        with no_timer():
            times["twin"].append(seconds(lambda: mujoco.mj_step(world.model, slow, nstep=few)) / few)
        mujoco.set_mjcb_control(None)
    found = {name: 1e6 * float(np.median(values)) for name, values in times.items()}
    found |= {
        f"{name}/bare": float(np.median(np.array(times[name]) / np.array(times["bare"])))
        for name in ("native", "twin")
    }
    return found
