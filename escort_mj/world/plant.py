"""One simulated world: owns MuJoCo's data, steps it, and shows the record of the last evaluation."""

from __future__ import annotations

import sys
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.control.custom import native
from escort_mj.errors import MujocoError
from escort_mj.memory.layout import LAYOUT, State, unpack_plan, unpack_state
from escort_mj.metrics.watching import NAMES, Folded, joined
from escort_mj.monitor.sampling import MOST_SAMPLES
from escort_mj.monitor.signals import EPISODE_SIZE
from escort_mj.native.kernels import DOUBLE
from escort_mj.plugin_calls import is_plugins, place_in, watched
from escort_mj.scenario.geometry.steps import Schedule
from escort_mj.signals import columns
from escort_mj.world.loop import layout
from escort_mj.world.loop.addresses import behind, unpack_addresses
from escort_mj.world.model.build import World
from escort_mj.world.properties import MassProperties
from escort_mj.world.watcher import Watcher

Array = NDArray[np.float64]
LOOK = 0.25  # s at most between two looks at whether the mission was interrupted
PHYSICS = int(mujoco.mjtState.mjSTATE_INTEGRATION) - int(mujoco.mjtState.mjSTATE_USERDATA)


class Kept(NamedTuple):
    """What of the controller's state a run looks at between steps: see `State`."""

    watched_step: Array
    touches: Array
    turn: Array
    under_way: Array
    episodes: Array
    ended: Array
    kept_count: Array
    samples: Array
    steps_count: Array
    steps: Array
    watch_ended: Array
    watch_value: Array
    watch_count: Array
    watch_time: Array
    watch_who: Array


LAYOUT.part(Kept)


@dataclass
class Aside:
    """Steps set aside, of which nobody has found yet what is asked of them.

    Attributes:
        steps: As the callbacks keep them, shape (steps, numbers).
        rows: Where what is found goes: the last of their samples, shape (k, record_size).
        upto: How many steps were set aside up to these.
    """

    steps: Array
    rows: Array
    upto: int

    @property
    def samples(self) -> int:
        """How many samples were taken in the steps."""
        return int(np.count_nonzero(self.steps[:, 0]))


class Mark(NamedTuple):
    """A moment of a simulation.

    It consists of physics, the controller's state, steps since a sample and steps set aside, and MuJoCo's
    warnings.
    """

    physics: Array
    memory: Array
    steps: Array
    aside: list[Aside]
    warnings: NDArray[Any]


class Plant:
    """Steps a world natively. Use inside `callback.native_loop(world)`.

    Attributes:
        world: What is simulated.
        data: MuJoCo's data; the controller's state lives in its `userdata`.
        schedule: When samples are taken.
    """

    def __init__(self, world: World) -> None:
        self.world, self.schedule = world, world.schedule
        self.data = mujoco.MjData(world.model)
        layout.check(world.model, self.data)
        self._memory = self.data.userdata.ctypes.data
        self._changed: native.PluginFailure | None = None  # by what a plugin changed in the process
        self._aside: list[Aside] = []
        self._start()
        self._kept: Kept = LAYOUT.read(Kept, world.model.numeric_data.ctypes.data, self._memory)
        self.properties = MassProperties(world.model) if world.sizes.get("truth") else None
        self._watcher = Watcher(world) if world.mission.watches else None
        self._room = len(self._kept.steps) or sys.maxsize  # physics steps between two looks at what is asked
        self._at_once = MOST_SAMPLES
        self._pace = 16  # physics steps between two looks

    @cached_property
    def state(self) -> State:
        """Views of the controller's whole state."""
        return unpack_state(self.world.model.numeric_data.ctypes.data, self._memory, self.world.setup.axes)

    @property
    def addresses(self) -> tuple[int, int]:
        """Where kernels find the plan and the state."""
        return self.world.model.numeric_data.ctypes.data, self._memory

    @cached_property
    def _trees(self) -> NDArray[np.int32]:
        """Kinematic tree of each robot."""
        model = self.world.model
        addresses = unpack_addresses(behind(model.numeric_data.ctypes.data), self.world.setup.axes)
        trees: NDArray[np.int32] = model.dof_treeid[addresses.dof_address.astype(int)]
        return trees

    def step(self, count: int) -> bool:
        """Advances by so many physics steps, without entering Python for as long as `LOOK`.

        With the truth channel, what can only be found by differences is then added to the record, for the
        state that the steps led to.

        Returns:
            Whether all were taken; an interrupted mission (`stopping.asked`) stops between them.

        Raises:
            MujocoError: If MuJoCo gives up.
        """
        while count:
            room = self._room - int(self._kept.steps_count[0])
            some, began = min(count, self._pace, room), time.perf_counter()
            try:
                mujoco.mj_step(self.world.model, self.data, nstep=some)
            except mujoco.FatalError as error:
                words = " ".join(str(error).split())
                raise MujocoError(f"MuJoCo cannot step this world: {words}") from None
            self.take_steps()
            count -= some
            if count and stopping.asked():
                return False
            if some == self._pace:
                took = time.perf_counter() - began
                self._pace = max(some // 2, 1) if took > LOOK else 2 * some if took < LOOK / 4 else some
        if self.properties is not None:
            residuals = self.properties.residuals(self.data.qpos, self.data.qvel)
            self.state.skew_residual[:] = residuals.skew[self._trees]
            self.state.coriolis_residual[:] = residuals.coriolis[self._trees]
        return True

    @property
    def is_full(self) -> bool:
        """Whether no further step can be kept before `take_steps`."""
        return bool(self._kept.steps_count[0] >= self._room)

    def take_steps(self, rest: bool = False) -> None:
        """Set aside the steps up to the last sample, for `fold_steps` once there is no room for more.

        Steps behind it stay kept until their sample is taken, unless there is no room for one more: how long
        MuJoCo steps at once, which is a matter of time, changes no bit of what they are folded into.

        Args:
            rest: Whether to fold all steps that are kept, as another scenario is to follow.
        """
        if self._watcher is None:
            return
        kept, count = self._kept, int(self._kept.steps_count[0])
        sampled = np.flatnonzero(kept.steps[:count, 0])
        count = int(sampled[-1]) + 1 if len(sampled) else count * (rest or self.is_full)
        if not count:
            return
        last, begun, whole = int(kept.kept_count[0]), not kept.watch_ended[0], len(sampled) > 0
        rows = kept.samples[max(last - len(sampled), 0) : last]
        upto = count + (self._aside[-1].upto if self._aside else 0)
        self._aside.append(Aside(kept.steps[:count].copy(), rows, upto))
        left = kept.steps[count : int(kept.steps_count[0])].copy()
        kept.steps[: len(left)], kept.steps_count[0], kept.watch_ended[0] = left, len(left), whole
        if begun or not whole or upto >= self._room:
            self.fold_steps(begun)

    def fold_steps(self, begun: bool = False) -> None:
        """Find what is asked of the steps set aside; write it to the record and to their samples.

        Args:
            begun: Whether the record has what was found of earlier steps since the same sample.
        """
        if self._watcher is None or not self._aside:
            return
        aside, self._aside = self._aside, []
        steps, kept = np.concatenate([one.steps for one in aside]), self._kept
        starts = np.append(0, np.flatnonzero(steps[:-1, 0]) + 1)
        found = self._watcher.fold(steps, starts)
        fields = Folded(kept.watch_value, kept.watch_count, kept.watch_time, kept.watch_who)
        if begun:
            whole = joined(self.world.mission.watches, fields, Folded(*(each[0] for each in found)))
            for each, first in zip(found, whole, strict=True):
                each[0] = first
        for field, each in zip(fields, found, strict=True):
            field[:] = each[-1]
        places, end = [columns(name, self.world.sizes) for name in NAMES], 0
        for one in aside:
            end += one.samples
            for place, each in zip(places, found, strict=True):
                one.rows[:, place] = each[end - len(one.rows) : end]

    def samples(self, most: int) -> Array:
        """Advances to the next samples and takes them, without entering Python between them.

        Episodes that end meanwhile find room in the log as if Python had looked at every sample: where it is
        full at the end, the same steps are taken again with fewer samples at once.

        Args:
            most: How many samples at most.

        Returns:
            At least one, shape (k, record_size); a view, until the next call, without what is asked of steps
            that are set aside. What there is, if the mission is interrupted on the way.
        """
        schedule, kept = self.schedule, self._kept.samples
        watched = self.steps
        next_one = schedule.before(watched)
        if not len(kept):
            whole = self.step(schedule.step(next_one) + 1 - watched)
            return self._row[None][: int(whole)]
        self._kept.kept_count[0] = 0.0  # what `step` alone has kept was not asked for
        while True:
            count = min(most, len(kept), self._at_once)
            if count > 1:
                before = self.mark()
            if not self.step(schedule.step(next_one + count - 1) + 1 - watched):
                return kept[: int(self._kept.kept_count[0])]
            if count == 1 or self._kept.ended[0] < len(self._kept.episodes):
                break
            self.back_to(before)
            self._at_once = count // 2
        self._at_once = 2 * count
        return kept[:count]

    def fill(self, rows: Array, look: bool = False) -> tuple[int, Array]:
        """Take the next samples, as many as there are rows.

        Args:
            rows: Receives them, shape (k, record_size); what expectations ask of them with `fold_steps`.
            look: Whether to look at the end for what plugins have changed in the process (0.3 ms).

        Returns:
            How many there are, fewer if the mission is interrupted on the way; and the contact episodes that
            ended meanwhile, shape (e, EPISODE_SIZE).
        """
        if look and self._called:
            filled, changes = (0, np.zeros((0, EPISODE_SIZE))), list[str]()
            try:
                with watched() as changes:
                    filled = self.fill(rows)
            except Exception:
                if not changes:  # else what the plugin changed may have broken it
                    raise
            if changes:
                words = " or ".join(map(place_in, self._called))
                self._changed = native.PluginFailure(float(self.data.time), f"{words}: {changes[0]}")
            return filled
        log, row = list[Array](), 0
        while row < len(rows) and not stopping.asked():
            taken = self.samples(len(rows) - row)
            rows[row : row + len(taken)] = taken
            row += len(taken)
            self._lay(rows[:row], len(taken))
            if self.has_ended:
                log.append(self.ended())
        return row, np.vstack(log) if log else np.zeros((0, EPISODE_SIZE))

    def _lay(self, rows: Array, taken: int) -> None:
        """Have what will be found of steps set aside written to the samples just taken, the last rows."""
        end, first = len(rows), len(rows) - taken
        for one in reversed(self._aside):
            start = max(end - one.samples, first)
            if start == end:
                return
            one.rows, end = rows[start:end], start

    @contextmanager
    def ending_at(self, step: int) -> Iterator[Schedule]:
        """Have a sample in a step, wherever the schedule has others, and none behind it."""
        whole, self.schedule = self.schedule, self.schedule.ending_at(step)
        extra = unpack_plan(self.world.model.numeric_data.ctypes.data, self.world.setup.axes).extra
        place = bisect_left(whole.extra, step)
        before, extra[place] = extra[place], step
        try:
            yield self.schedule
        finally:
            self.schedule, extra[place] = whole, before

    def mark(self) -> Mark:
        """All that stepping depends on and changes, to come `back_to`."""
        physics = np.empty(mujoco.mj_stateSize(self.world.model, PHYSICS))
        mujoco.mj_getState(self.world.model, self.data, physics, PHYSICS)
        samples = (self._kept.samples.ctypes.data - self._memory) // DOUBLE
        memory = self.data.userdata[:samples].copy()
        steps = self._kept.steps[: int(self._kept.steps_count[0])].copy()
        return Mark(physics, memory, steps, [*self._aside], self.data.warning.number.copy())

    def back_to(self, mark: Mark) -> None:
        """Takes back what was simulated since a mark; that a plugin failed meanwhile is forgotten."""
        self.fold_steps()
        self._aside = [*mark.aside]
        mujoco.mj_setState(self.world.model, self.data, mark.physics, PHYSICS)
        self.data.userdata[: len(mark.memory)] = mark.memory
        self._kept.steps[: len(mark.steps)] = mark.steps
        self.data.warning.number[:] = mark.warnings
        native.forget(self._memory)

    @property
    def steps(self) -> int:
        """How many physics steps have been taken."""
        return int(self._kept.watched_step[0])

    def carry_on(self, before: Plant) -> None:
        """Go on from where another plant is, whose scenario differs in numbers but in no size.

        Args:
            before: The other plant. State of the controller that has another shape here starts afresh.
        """
        before.take_steps(rest=True)  # by what was asked of them
        before.fold_steps()
        mark, old, new = before.mark(), before.world.setup, self.world.setup
        mujoco.mj_setState(self.world.model, self.data, mark.physics, PHYSICS)
        self.data.warning.number[:] = mark.warnings
        for name in LAYOUT.fields[State].keys() - {"samples", "steps"}:
            there, here = getattr(before.state, name), getattr(self.state, name)
            if there.shape == here.shape:
                here[...] = there
        self._kept.steps[: len(mark.steps)] = mark.steps
        self._kept.kept_count[0] = self.state.next_known[0] = (
            0.0  # what is known ahead is of the other target
        )
        if old.arrangement is not None and new.arrangement is not None:
            self.state.chord_length[0] *= new.arrangement.length / old.arrangement.length
        moved = (old.obstacle_position != new.obstacle_position).any(axis=1)
        self.state.obstacle_position[moved] = new.obstacle_position[moved]

    @property
    def record(self) -> Array:
        """The record of the last evaluation of the law, see `signals.py`; a copy, shape (record_size,)."""
        self.fold_steps()
        return self._row

    @property
    def _row(self) -> Array:
        """The record, with what is asked of steps as far as it was found."""
        return np.take(self.data.userdata, self._recorded)

    @cached_property
    def _recorded(self) -> NDArray[np.int64]:
        """Where the numbers of a record stand in the state."""
        plan = unpack_plan(self.world.model.numeric_data.ctypes.data, self.world.setup.axes)
        return np.concatenate([start + np.arange(count) for start, count in plan.stretches.astype(int)])

    def reset(self) -> None:
        """Back to the start; the controller seeds its own state at its first evaluation."""
        mujoco.mj_resetData(self.world.model, self.data)
        self._start()

    def _start(self) -> None:
        """Set what moves at the start moving; what a plugin did in this memory before is forgotten."""
        native.forget(self._memory)
        self._changed, self._aside = None, []
        if self.world.model.nkey:
            mujoco.mj_resetDataKeyframe(self.world.model, self.data, 0)

    @property
    def failure(self) -> native.PluginFailure | None:
        """The error that a plugin raised in a step; None if there was none."""
        return native.failure(self._memory) or self._changed

    @cached_property
    def _called(self) -> list[Callable[..., Any]]:
        """Functions of plugins that the loop calls in Python."""
        setup = self.world.setup
        members = [setup.law, setup.outer, setup.estimator, setup.radio, *setup.all_behaviors, *setup.laws]
        members += [*setup.disturbances, *setup.sensing.own.values(), *setup.failures]
        members += [*(mover.policy for mover in setup.movers), *(phase.when for phase in setup.phases)]
        own = (type(each) for each in members if each is not None and is_plugins(type(each)))
        kinds = [kind for kind in own if not kind.compiled]
        return list(dict.fromkeys(getattr(kind, kind.method) for kind in kinds))

    @property
    def has_ended(self) -> bool:
        """Whether contact episodes have ended since `ended` was asked."""
        return bool(self._kept.ended[0])

    def ended(self) -> Array:
        """Take the contact episodes that have ended off the log, shape (k, EPISODE_SIZE)."""
        rows = self._kept.episodes[: int(self._kept.ended[0])].copy()
        self._kept.ended[0] = 0.0
        return rows

    def under_way(self) -> Array:
        """The contact episodes that go on, as far as they have come, shape (k, EPISODE_SIZE)."""
        kept = self._kept
        return kept.touches[int(kept.turn[0]) % 2, : int(kept.under_way[0]), :EPISODE_SIZE].copy()

    def warnings(self) -> dict[str, int]:
        """How often MuJoCo warned so far, by the warning's name."""
        if not self.data.warning.number.any():
            return {}
        counts = {
            str(kind.name).removeprefix("mjWARN_"): int(self.data.warning[int(kind)].number)
            for kind in mujoco.mjtWarning.__members__.values()
            if kind.name != "mjNWARNING"
        }
        return {name: count for name, count in counts.items() if count}
