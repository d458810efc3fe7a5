"""A stand on which components are called by hand: the controller's memory without a simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.behavior import Behavior
from escort_mj.components.component import Component
from escort_mj.control.custom import native
from escort_mj.control.outer_loops import OuterLoop
from escort_mj.disturbances import Disturbance
from escort_mj.estimators import Estimator
from escort_mj.failures import Failure
from escort_mj.knowledge.sight import MEASURES
from escort_mj.laws.law import Law
from escort_mj.memory.layout import LAYOUT, State, state_size, unpack_plan, unpack_state
from escort_mj.memory.packing import pack
from escort_mj.memory.sampling import Sampling
from escort_mj.native.kernels import DOUBLE
from escort_mj.policies import Policy
from escort_mj.radios import Radio
from escort_mj.rules import Rule
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensors import Sensor

Array = NDArray[np.float64]

SEED = 4144
ROUNDING = 1e-9  # relative difference of two ways to compute the same
IN_SPACE = 3  # axes
PLACES: dict[type[Component], str] = {
    Behavior: "level_place",
    Policy: "mover_place",
    Estimator: "estimator_place",
    Radio: "radio_place",
    Disturbance: "disturbance_place",
    Sensor: "own_sensor_place",
    Failure: "failure_place",
    Rule: "phase_rule_place",
}
"""Fields of the plan that say where parameters begin; those of a law come first."""
HEARING = 0.5  # share of the draws in which a robot hears a message
SIZES = ((5, 2), (1, 2), (4, 3), (3, 5))  # robots and axes


listeners: list[Callable[[str, str], None]] = []
"""Called with a member's name and what is about to be tried with it, in words."""


def trying(member: type[Any], words: str) -> None:
    """Say what is about to be tried, in case that it ends the process."""
    for listener in listeners:
        listener(member.__name__, words)


class CheckResult(NamedTuple):
    """What one check found: its name, whether it holds, and words."""

    name: str
    held: bool
    words: str


class BrokenError(Exception):
    """A check that cannot go on.

    Attributes:
        name: Of the check.
    """

    def __init__(self, name: str, words: str) -> None:
        super().__init__(words)
        self.name = name


class Stand:
    """Memory of a mission in which a law or behavior is called.

    Attributes:
        own: What is called.
        state: Its memory.
        timestep: Physics step [s].
    """

    def __init__(self, own: Any, kind: type[Scenario], robots: int, axes: int) -> None:
        """Lays out the memory.

        Args:
            own: A law or behavior.
            kind: A type of scenarios that knows it.
            robots: n.
            axes: p.
        """
        self.own = own
        trying(type(own), f"with {robots} robots in {axes} axes")
        table: dict[str, Any] = {"axes": axes}
        obstacles = [{"position": (8.0 + 3.0 * j,) + (0.5,) * (axes - 1), "radius": 0.5} for j in range(2)]
        table["obstacles"] = tuple(obstacles)
        table |= table_with(type(own), own.model_dump(), axes, MEASURES)
        table["robots"] = {**table.get("robots", {}), "count": robots}
        setup = Mission(kind.model_validate(table)).setup
        self.plan = pack(setup, Sampling(coordinates=robots * axes))
        self.memory = np.zeros(state_size(self.plan))
        self.state: State = unpack_state(self._plan, self._memory, axes)
        self.state.obstacle_position[:] = setup.obstacle_position
        native.forget(self._memory)
        self._number = native.ready(type(own), axes)
        plan = unpack_plan(self._plan, axes)
        name = next((name for base, name in PLACES.items() if isinstance(own, base)), None)
        place = 0 if name is None else int(np.max(getattr(plan, name)))
        if isinstance(own, Estimator):
            self.sight_variance = plan.sight_variance
        self.timestep = plan.timestep
        self._block = plan.parameters.ctypes.data + DOUBLE * place

    @property
    def _plan(self) -> int:
        return int(self.plan.ctypes.data)

    @property
    def _memory(self) -> int:
        return int(self.memory.ctypes.data)

    def fill(self, random: np.random.Generator, scale: float = 1.0) -> None:
        """Draw what the law or behavior sees.

        Args:
            random: Where numbers come from.
            scale: Size of errors and velocities [m, m/s].
        """
        state = self.state
        state.time[0] = random.uniform(0.0, 100.0)
        for name in ("e", "e_dot", "v_d", "v_measured", "rho_hat", "component_memory"):
            values = getattr(state, name)
            values[:] = scale * random.standard_normal(values.shape)
        state.q_measured[:] = 5.0 * random.standard_normal(state.q_measured.shape)
        state.q_d[:] = state.q_measured + state.e
        slope = float(getattr(self.own, "slope", 1.0))
        state.s[:] = state.e_dot + slope * state.e
        state.target_position_measured[:] = random.standard_normal(state.target_position_measured.shape)
        state.target_velocity_measured[:] = random.standard_normal(state.target_velocity_measured.shape)
        for i in range(len(state.model_mass)):
            state.model_mass[i] = np.eye(state.q.shape[1]).ravel() * random.uniform(0.5, 2.0)
        state.model_bias[:] = random.standard_normal(state.model_bias.shape)
        for values in (state.noise, state.common_noise):
            values[:] = random.standard_normal(values.shape)
        for values in (state.q, state.v, state.mover_position, state.mover_velocity, state.policy_memory):
            values[:] = random.standard_normal(values.shape)
        if isinstance(self.own, Estimator):
            self._inform(random)
        if isinstance(self.own, Radio):
            state.message_sender[0], state.message_receiver[0] = random.integers(0, len(state.q), 2)
            state.message_number[0], state.message_distance[0] = random.integers(0, 1000), random.random()
            state.message_draws[:] = random.random(2)
            state.link_memory[:] = random.integers(0, 2, len(state.link_memory))
        if isinstance(self.own, Failure):
            for values in (state.failure_age, state.failure_draw, state.tau, state.force_before):
                values[:] = random.uniform(-1.0, 1.0, values.shape)
        if isinstance(self.own, Sensor):
            for name in ("sensor_truth", "sensor_normals", "sensor_memory"):
                getattr(state, name)[:] = scale * random.standard_normal(getattr(state, name).shape)
            state.sensor_draw[:] = random.random(state.sensor_draw.shape)

    def _inform(self, random: np.random.Generator) -> None:
        """Draw what robots believe, see and hear: one of the messages, or none."""
        state, rows = self.state, len(self.state.sent_belief)
        for name in ("belief", "sent_belief", "seen_position", "seen_velocity", "seen_bearing"):
            getattr(state, name)[:] = random.standard_normal(getattr(state, name).shape)
        state.seen_range[:] = random.uniform(0.5, 5.0, state.seen_range.shape)
        state.seen_bearing /= np.linalg.norm(state.seen_bearing, axis=1, keepdims=True)
        for times in (state.belief_time, state.belief_fix, state.sent_belief_time, state.sent_fix):
            times[:] = state.time[0] - random.uniform(0.0, 1.0, times.shape)
        for rows_of in (state.belief_covariance, state.sent_covariance):
            for row in rows_of:
                root = random.standard_normal((state.belief.shape[1],) * 2)
                row[:] = (root @ root.T + 0.1 * np.eye(len(root))).ravel()
        state.message[0] = random.integers(-1, rows) if random.random() < HEARING else -1.0

    def call(self, robot: int | None = None) -> int:
        """Call the law, or the behavior for one robot.

        Returns:
            What a behavior returned.

        Raises:
            BrokenError: If it raised an error.
        """
        for name in () if isinstance(self.own, Estimator) else type(self.own).outputs:
            getattr(self.state, name)[...] = 0.0
        native.forget(self._memory)
        returned = native.invoke(self._number, self._block, self._plan, self._memory, robot)
        if returned is None:
            found = native.failure(self._memory)
            raise BrokenError("runs", found.message if found else "failed")
        return returned

    @property
    def numbers(self) -> int:
        """How many robots, or bodies with a policy, the method can be called for."""
        if isinstance(self.own, Behavior | Rule):
            return 1  # eight robots at once
        if isinstance(self.own, Radio | Sensor):
            return 2  # questions
        return len(self.state.mover_position) if isinstance(self.own, Policy) else len(self.state.q)

    def outputs(self) -> Array:
        """All that was written, in a row."""
        written = [getattr(self.state, name).ravel() for name in type(self.own).outputs]
        return np.concatenate(written).copy()

    def inputs(self) -> bytes:
        """The bits of all that is not to be written."""
        own = type(self.own)
        names = set(LAYOUT.fields[own.view]) - {*own.outputs, *own.scratch}
        kept = [getattr(self.state, name) for name in sorted(names) if name in LAYOUT.fields[State]]
        return b"".join(np.asarray(each).tobytes() for each in kept) + self.plan.tobytes()


def stands(member: type[Component], kind: type[Scenario]) -> Iterator[Stand]:
    """A stand of each size; bodies with a policy move in two or three axes."""
    for robots, axes in SIZES:
        if axes <= IN_SPACE or not issubclass(member, Policy):
            yield Stand(member.model_validate(table_of(member, axes)), kind, robots, axes)


def table_of(member: type[Any], axes: int) -> dict[str, Any]:
    """The table of a member as a scenario gives it: its name, and what it has to be given in so many axes."""
    vectors = member.vectors() if issubclass(member, Component) else ()
    vector = tuple(1.0 / (1.0 + axis) for axis in range(axes))
    table = {member.named_by: member.own_name(), **dict.fromkeys(vectors, vector)}
    if issubclass(member, Failure):
        return {**table, "robot": 1, "at": 0.5}
    return {**table, "below": 1.0} if issubclass(member, Rule) else table


def table_with(
    member: type[Any], own: dict[str, Any], axes: int, measures: Sequence[str] = ()
) -> dict[str, Any]:  # fmt: skip
    """Return tables of a scenario in which a component takes part.

    Robots with an estimator measure with errors, and some messages are lost; with a radio, one robot sees the
    target; with a sensor, they measure all that it can.

    Args:
        member: The component.
        own: Its table.
        axes: Of the mission.
        measures: What robots with an estimator measure; empty for what it needs.
    """
    if issubclass(member, Law):
        return {"controller": own}
    if issubclass(member, Behavior):
        return {"mission": {"behaviors": (own,)}}
    if issubclass(member, OuterLoop):
        return {"mission": {"outer": own}}
    if issubclass(member, Policy):
        return {"target": {"position": (0.0,) * axes, "policy": own}}
    if issubclass(member, Estimator):
        measures = measures or member.needs[0]
        noise = dict.fromkeys(measures, 0.05)
        sight = {"robots": (1,), "measures": tuple(measures), "noise": noise}
        return {
            "knowledge": {"estimator": own, "target": sight, "initial": {"position": 0.5}},
            "communication": {"rate": 50.0, "delay": 0.04, "loss": 0.2},
        }
    if issubclass(member, Radio):
        return {"knowledge": {"target": {"robots": (1,)}}, "communication": own}
    if issubclass(member, Disturbance):
        return {"uncertainty": {"disturbances": (own,)}}
    if issubclass(member, Failure):
        return {"robots": {"failures": (own,)}, "mission": {"behaviors": ("surface",)}}
    if issubclass(member, Rule):
        phase = {"behaviors": ("surface",), "when": own}
        return {"mission": {"behaviors": ("surface",), "supervisor": (phase,)}}
    return {"sensing": dict.fromkeys(member.measures, own)}


def other_form(member: type[Component]) -> type[Component] | None:
    """The same in plain Python, where a compiled form would run; None where there is one form only."""
    if not member.compiled:
        return None
    return type(member.__name__, (member,), {"compiled": False, "__module__": member.__module__})


def relative_gap(a: Array, b: Array) -> float:
    """Largest difference of two rows of numbers, relative to their size."""
    if not len(a):
        return 0.0
    return float(np.abs(a - b).max() / max(1.0, np.abs(a).max(), np.abs(b).max()))
