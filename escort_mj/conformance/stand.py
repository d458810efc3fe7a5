"""A stand on which components are called by hand: the controller's memory without a simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.equations import Equations
from escort_mj.conformance.trials import IN_SPACE, TRIALS, table_of, table_with
from escort_mj.control.custom import native
from escort_mj.knowledge.sight import MEASURES
from escort_mj.memory.layout import LAYOUT, State, state_size, unpack_plan, unpack_state
from escort_mj.memory.packing import pack
from escort_mj.memory.sampling import Sampling
from escort_mj.policies import Policy
from escort_mj.scenario.kinds import kind_of
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

SEED = 4144
ROUNDING = 1e-9  # relative difference of two ways to compute the same
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
        sight_variance: Variances of what robots measure of the target, see `SightParameters`.
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
        self._trial = TRIALS[kind_of(type(own))]
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
        self._numbers = native.block_of(own, setup)
        self._block = int(self._numbers.ctypes.data)
        plan = unpack_plan(self._plan, axes)
        self.sight_variance, self.timestep = plan.sight_variance, plan.timestep

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
        for values in (state.noise, state.common_noise, state.second_noise, state.second_common_noise):
            values[:] = random.standard_normal(values.shape)
        for values in (state.q, state.v, state.mover_position, state.mover_velocity, state.policy_memory):
            values[:] = random.standard_normal(values.shape)
        for j, place in enumerate(state.obstacle_position):
            place[:] = state.q_measured[j % len(state.q)] + random.standard_normal(len(place))
        self._trial.draw(state, random, scale)

    def call(self, robot: int | None = None) -> int:
        """Call the law, or the behavior for one robot.

        Returns:
            What a behavior returned.

        Raises:
            BrokenError: If it raised an error.
        """
        for name in () if self._trial.keeps_outputs else type(self.own).outputs:
            getattr(self.state, name)[...] = 0.0
        returned = native.invoke(self._number, self._block, self._plan, self._memory, robot)
        if returned is None:
            found = native.failure(self._memory)
            native.forget(self._memory)
            raise BrokenError("runs", found.message if found else "failed")
        return returned

    @property
    def numbers(self) -> int:
        """How many robots, bodies or questions the method can be called for."""
        return self._trial.numbers(self.state)

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


def stands(member: type[Equations], kind: type[Scenario]) -> Iterator[Stand]:
    """A stand of each size; bodies with a policy move in two or three axes."""
    for robots, axes in SIZES:
        if axes <= IN_SPACE or not issubclass(member, Policy):
            yield Stand(member.model_validate(table_of(member, axes)), kind, robots, axes)


def other_form(member: type[Equations]) -> type[Equations] | None:
    """The same in plain Python, where a compiled form would run; None where there is one form only."""
    if not member.compiled:
        return None
    return type(member.__name__, (member,), {"compiled": False, "__module__": member.__module__})


def relative_gap(a: Array, b: Array) -> float:
    """Largest difference of two rows of numbers, relative to their size."""
    if not len(a):
        return 0.0
    return float(np.abs(a - b).max() / max(1.0, np.abs(a).max(), np.abs(b).max()))
