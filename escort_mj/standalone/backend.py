"""What evaluates the law without a simulator: the kernels of missions, compiled or interpreted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import MissionSignals
from escort_mj.components.obstacles import ObstacleSignals
from escort_mj.components.setup import COMMANDED, Outside
from escort_mj.control import signals as control
from escort_mj.control.custom import native
from escort_mj.control.setup import Setup
from escort_mj.errors import EscortError, UsageError
from escort_mj.memory import layout
from escort_mj.memory.evaluation import evaluation_of, interpreted_evaluation
from escort_mj.memory.layout import state_size, unpack_plan, unpack_state
from escort_mj.memory.packing import pack
from escort_mj.memory.sampling import Sampling
from escort_mj.native.fields import declared
from escort_mj.plan import Plan, State
from escort_mj.scenario.findings import did_you_mean, shown
from escort_mj.sensing.sensors import SensorSignals
from escort_mj.signals import SIGNALS, Signal
from escort_mj.standalone.knowledge import Knowledge
from escort_mj.standalone.lost import Figures, regrouped

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_KINDS = (
    *(MissionSignals, ObstacleSignals, SensorSignals, control.SupervisorSignals, control.FailureSignals),
    *(control.OuterLoopSignals, control.TaskSignals, control.InnerLoopSignals),
)
_NAMES = {name for kind in _KINDS for name in declared(kind)} - {"qpos"}
CONTROL_SIGNALS: dict[str, Signal] = {signal.name: signal for signal in SIGNALS if signal.name in _NAMES}
"""What can be read after each call: everything that a trace has of the controller."""


class Signals(dict[str, Any]):
    """Values of signals by their names in the trace."""

    def __missing__(self, name: object) -> Any:
        raise UsageError(f"{shown(name)} is not a signal of the controller{did_you_mean(str(name), self)}")


class Backend:
    """Evaluates the law of missions on memory of its own, which is all its state.

    Args:
        setup: What the controller is given.
        interpret: Whether kernels run as plain Python instead of as machine code.
    """

    def __init__(self, setup: Setup, interpret: bool = False) -> None:
        self._evaluate = interpreted_evaluation(setup.axes) if interpret else evaluation_of(setup.axes)
        self._setup = setup
        self._packed = pack(setup, Sampling())
        self._memory = np.zeros(state_size(self._packed))
        self._places = self._packed.ctypes.data, self._memory.ctypes.data
        native.forget(self._places[1])
        self._plan: Plan = unpack_plan(self._places[0], setup.axes)
        self._state: State = unpack_state(*self._places, setup.axes)
        self._most, self._least = setup.force_limit[:, None], -setup.force_limit[:, None]

    def evaluate(self, now: Knowledge) -> None:
        """Evaluate the law; its state moves on by a timestep if the time is later than at the last call."""
        state = self._state
        state.time[0], state.q[:], state.v[:] = now.time, now.q, now.v
        if now.target is not None:  # in place of what was worked out for this time
            state.next_known[0], state.next_time[0] = 1.0, now.time
            state.next_target_position[:], state.next_target_velocity[:] = now.target
            if self._setup.disturbance is not None:
                state.next_disturbance[:] = self._setup.disturbance.position(now.time)
        if now.obstacles is not None:
            self._plan.obstacle_position[:] = state.obstacle_position[:] = now.obstacles
            state.obstacle_velocity[:] = now.motion
        if now.points is not None:
            state.obstacle_point[:] = now.points.reshape(state.obstacle_point.shape)
        if now.mass is not None:
            state.model_mass[:] = now.mass.reshape(state.model_mass.shape)
            state.model_bias[:] = now.bias
        self._evaluate(*self._places)
        if failure := native.failure(self._places[1]):
            raise EscortError(f"a plugin raised an error at {failure.time:g} s: {failure.message}")
        np.minimum(state.command, self._most, out=state.force)
        np.maximum(state.force, self._least, out=state.force)
        state.force_before[:] = state.force

    def command(self, kind: Outside, values: Array) -> None:
        """Write what a controller is commanded, shape (n, p), see `COMMANDED`."""
        getattr(self._state, COMMANDED[kind][0])[:] = values

    def regroup(self, now: Knowledge, lost: Mask, returned: Mask) -> None:
        """Let the robots that are left close ranks, and take up the state of those that come back.

        Args:
            now: What is known now.
            lost: Who is out, shape (n,).
            returned: Who comes back now, shape (n,): their reference is where they are, their estimate begins
                again.
        """
        state, setup = self._state, self._setup
        members = state.member_of.astype(int) - 1 if setup.teams else np.zeros(setup.count, dtype=int)
        centers = state.team_center if setup.teams else _target_of(now, setup)[None]
        figures = Figures(state.predecessors, float(state.chord_length[0]), state.vertices)
        found, moved = regrouped(setup, figures, now.q, centers, members, state.lost > 0.0, lost)
        state.lost[:] = lost
        state.predecessors[:], state.chord_length[0], state.vertices[:] = found
        if setup.apart:
            state.rotation[moved] = np.eye(setup.axes)
        elif moved.any():
            state.rotation[:] = np.eye(setup.axes)
        if setup.teams:
            state.missed[returned] = 0.0
        state.q_d[returned] = now.q[returned]
        state.rho_hat[returned] = self._plan.estimate_at_start[returned, None]
        for array in (state.q_d_rate, state.rho_hat_rate):
            array[returned] = 0.0
        for array in (state.component_memory, state.component_rate):
            array[:, returned] = 0.0

    def apply(self, force: Array) -> None:
        """Take over the forces that robots really get, shape (n, p) [N]."""
        self._state.force[:] = self._state.force_before[:] = force

    def value(self, name: str) -> Any:
        """Return a signal of the last evaluation; not a copy."""
        return getattr(self._state, name)

    def save(self) -> dict[str, Any]:
        """Return copies of everything that later evaluations depend on: every field of the state."""
        return {name: getattr(self._state, name).copy() for name in declared(layout.State)}

    def load(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `save` returned."""
        fields = {name: getattr(self._state, name) for name in declared(layout.State)}
        if wrong := [name for name, field in fields.items() if np.shape(saved.get(name, 0)) != field.shape]:
            raise UsageError(f"state: {wrong[0]} is missing or of another shape: not of this mission")
        for name, field in fields.items():
            field[:] = saved[name]
        native.forget(self._places[1])


def _target_of(now: Knowledge, setup: Setup) -> Array:
    """Return where the target is, shape (p,) [m]."""
    return setup.target.position(now.time) if now.target is None else now.target[0]
