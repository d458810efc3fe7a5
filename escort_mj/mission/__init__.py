"""One run on one page: build the world, step it natively, record, end with an outcome, judge."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.errors import EscortError, UsageError
from escort_mj.expect.verdicts import judge
from escort_mj.measuring import measures_of, summarize
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import Metric
from escort_mj.monitor.signals import START
from escort_mj.native.on_demand import waited
from escort_mj.plugin_calls import waiting_once
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.record.recording import NONE, Recording, Variable, record
from escort_mj.record.stored import ASSETS
from escort_mj.scenario import dump_scenario
from escort_mj.scenario.mission import Mission, Seen
from escort_mj.scenario.reader.catalog import catalog_of
from escort_mj.scenario.reader.dump import short_dump
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import RADII, TIME, columns
from escort_mj.world.callback import callbacks, native_loop
from escort_mj.world.labels import labels_of
from escort_mj.world.model.build import World, build
from escort_mj.world.model.robot.placing import models_of
from escort_mj.world.plant import Mark, Plant

if TYPE_CHECKING:
    import xarray

    from escort_mj.record.folder import RunFolder

Array = NDArray[np.float64]
Progress = Callable[[float, float], None]
"""Called with the simulated time reached and the time to reach [s]."""


class Room:
    """Memory for samples, the same for one mission after another: fresh memory costs a tenth of a run."""

    def __init__(self) -> None:
        self._numbers = np.empty(0)

    def take(self, rows: int, columns: int) -> Array:
        """A matrix, shape (rows, columns), in place of the one taken before."""
        size = rows * columns
        if self._numbers.size < size:
            self._numbers = np.empty(size)
        return self._numbers[:size].reshape(rows, columns)


BLOCK = 256  # samples between two looks at the state's health
SHORT = 0.5  # s of a run that is made again rather than read, if its process dies
LARGEST = 1e10  # control that MuJoCo takes (mjMAXVAL) [N]
NOT_KEPT = "this run's trace was not kept: ask for traces"
DIVERGED_BEYOND = 10.0  # times the mission's radius or the farthest start, whichever is larger


@dataclass
class Flight:
    """What came of a scenario that was run now; users have it as a `runs.Run`.

    Attributes:
        scenario: What was run.
        outcome: How it ended.
        message: The same in one sentence, with the moment.
        recording: Every recorded signal, see `signals.py`; None where it was not kept.
        measures: The value of every metric, as it was found.
        metrics: The same as metrics.json has them, with units.
        verdicts: What was expected, and whether it held.
        seen: What was seen of real robots; None for a simulation.
    """

    scenario: Scenario
    outcome: Outcome
    message: str
    recording: Recording | None = field(repr=False)
    measures: dict[str, Measure] = field(repr=False)
    metrics: dict[str, Any] = field(repr=False)
    verdicts: list[Verdict]
    seen: Seen | None = None

    @cached_property
    def trace(self) -> xarray.Dataset:
        """Every recorded signal, labelled.

        Raises:
            UsageError: If it was not kept.
        """
        if self.recording is None:
            raise UsageError(NOT_KEPT)
        return self.recording.to_dataset()

    @property
    def passed(self) -> bool:
        """Whether every verdict holds, the outcome itself among them."""
        return all(verdict.passed for verdict in self.verdicts)


def fly(
    scenario: Scenario,
    folder: RunFolder | Callable[[], RunFolder] | None = None,
    progress: Progress | None = None,
    room: Room | None = None,
    *,
    interpret: bool = False,
) -> Flight:
    """Run a scenario to its end, or to the point where it fails.

    Args:
        scenario: A checked scenario.
        folder: Where to write what came of it, sample by sample; None keeps everything in memory. A function
            that makes a folder is called once the run takes longer than `SHORT`; the caller saves one that
            ends before.
        progress: Called now and then.
        room: Where samples go; what is recorded there lasts until the next mission that gets it.
        interpret: Whether the controller runs as plain Python, see `callback.native_loop`.

    Raises:
        KeyboardInterrupt: If it was interrupted; a folder then holds the run as far as it came.
    """
    world = build(scenario)
    plant = Plant(world)
    if not interpret:
        callbacks(scenario.axes)  # now, so that the clock below times the run alone
    written = Written(folder, scenario, world)
    with stopping.deferred():
        clock = time.perf_counter() - waited()
        told = _simulate(plant, scenario, written, progress, room or Room(), interpret)
        samples, episodes, outcome, message = told
        wall = time.perf_counter() - waited() - clock
        if outcome is Outcome.INTERRUPTED and (written.folder is None or not len(samples)):
            raise KeyboardInterrupt(message)
        run = conclude(scenario, plant, samples, episodes, outcome, message, wall, written.folder)
    return run


class Written:
    """What is on disk of a run under way: all of it, or nothing while it is short.

    Attributes:
        folder: The run folder; None while there is none.
    """

    def __init__(
        self, folder: RunFolder | Callable[[], RunFolder] | None, scenario: Scenario, world: World
    ) -> None:
        """Begin a folder that is there; arguments as for `fly`."""
        self.folder: RunFolder | None = None
        self._make = folder if callable(folder) else None
        self._scenario, self._world = scenario, world
        self._began = time.perf_counter()
        if folder is not None and not callable(folder):
            self._begin(folder)

    def _begin(self, folder: RunFolder) -> None:
        begin_folder(folder, self._scenario, self._world)
        self.folder = folder

    def append(self, samples: Array, start: int, episodes: Sequence[Array], plant: Plant) -> None:
        """Write what is new.

        Args:
            samples: All so far, shape (k, record_size).
            start: The first that is new.
            episodes: Contact episodes that ended, block by block, the last new.
            plant: What simulates.
        """
        if self.folder is not None:
            self.folder.append(samples[start:], episodes[-1], plant.under_way())
        elif self._make is not None and time.perf_counter() - self._began > SHORT:
            self._begin(folder := self._make())
            folder.append(samples, np.vstack(episodes), plant.under_way())


def begin_folder(folder: RunFolder, scenario: Scenario, world: World) -> None:
    """Write the data that is known before the first step of a run."""
    plugins = [file for each in catalog_of(scenario).plugins if (file := each.source.file)]
    labels, short = labels_of(scenario, world), short_dump(scenario)
    whole = dump_scenario(scenario)
    copies = {f"{ASSETS}/{each.digest[:12]}.xml": each.text.encode() for each in models_of(world.team)}
    folder.begin(whole, world.xml, world.sizes, labels, plugins, short, world.assets | copies)


def conclude(
    scenario: Scenario,
    plant: Plant,
    samples: Array,
    episodes: Array,
    outcome: Outcome,
    message: str,
    wall: float,
    folder: RunFolder | None = None,
) -> Flight:
    """Sums up and judges what was simulated.

    Args:
        scenario: What was run.
        plant: What simulated it.
        samples: Shape (k, record_size).
        episodes: Contact episodes, shape (k, len(EPISODE)).
        outcome: How it ended.
        message: The same in words.
        wall: Time that it took, that for compiling kernels not included [s].
        folder: Where to write it.
    """
    world = plant.world
    recording = record(samples, world.sizes, labels_of(scenario, world), episodes)
    recording.attrs["mujoco_warnings"] = sum(plant.warnings().values())
    run = sum_up(scenario, recording, outcome, message, wall)
    if folder is not None:
        folder.finish(run.outcome, run.message, recording, run.metrics, run.verdicts)
    return run


def save(folder: RunFolder, run: Flight) -> None:
    """Write a run in memory into a folder.

    Raises:
        UsageError: If its trace was not kept.
    """
    if run.recording is None:
        raise UsageError(NOT_KEPT)
    begin_folder(folder, run.scenario, build(Mission(run.scenario, seen=run.seen)))
    folder.finish(run.outcome, run.message, run.recording, run.metrics, run.verdicts)


def sum_up(scenario: Scenario, recording: Recording, outcome: Outcome, message: str, wall: float) -> Flight:
    """Find metrics and verdicts of a recording.

    Args:
        scenario: What was run.
        recording: Every recorded signal.
        outcome: How it ended.
        message: The same in words.
        wall: Time that it took [s].
    """
    times = recording["time"].values
    steps = round(float(times[-1]) / scenario.physics.timestep) + 1 if len(times) else 0
    known = catalog_of(scenario).of(Metric)
    wanted = {one.subject for one in scenario.expect}
    with waiting_once():
        measures = measures_of(recording, known, wanted)
        verdicts = judge(scenario.expect, recording, outcome)
        errors = [found.reason for found in measures.values() if found.broken]
        errors += [verdict.found for verdict in verdicts if verdict.broken]
        if errors and outcome is Outcome.COMPLETED:
            outcome, message = Outcome.FAILED, f"a plugin raised an error after the run: {errors[0]}"
            verdicts = judge(scenario.expect, recording, outcome)
    if outcome is Outcome.COMPLETED and measures["stuck"].bodies:
        message += f"; {measures['stuck'].manner}"
    metrics = summarize(measures, recording, outcome, steps=steps, wall_time=wall, metrics=known)
    return Flight(scenario, outcome, message, recording, measures, metrics, verdicts)


def failed(scenario: Scenario, error: Exception) -> Flight:
    """The run of a scenario that an error broke: nothing but that."""
    message = str(error) if isinstance(error, EscortError) else f"{type(error).__name__}: {error}"
    nothing = Recording({}, {"time": Variable("time", [], {})}, {})
    verdicts = judge([], nothing, Outcome.FAILED)
    return Flight(scenario, Outcome.FAILED, message, None, {}, {}, verdicts)


def _simulate(
    plant: Plant,
    scenario: Scenario,
    written: Written,
    progress: Progress | None,
    room: Room,
    interpret: bool,
) -> tuple[Array, Array, Outcome, str]:
    """Step the world in blocks of samples, and check after each block whether to continue.

    Returns:
        The samples worth keeping, shape (k, record_size); the contact episodes, shape (k, len(EPISODE)); how
        it ended; and that in words.
    """
    world = plant.world
    total = world.schedule.count
    samples = room.take(total, world.record_size)
    bound = bound_of(scenario, world)
    done, outcome, message = 0, Outcome.COMPLETED, ""
    episodes = [NONE]
    with native_loop(world, interpret=interpret):
        while done < total and outcome is Outcome.COMPLETED:
            start = done
            kept, ended, outcome, message = take(plant, samples[start : start + BLOCK], bound)
            plant.fold_steps()
            episodes.append(ended)
            done = start + kept
            written.append(samples[:done], start, episodes, plant)
            reached = float(samples[done - 1, TIME]) if done else 0.0
            if outcome is Outcome.COMPLETED and (signal := stopping.asked()):
                outcome, message = Outcome.INTERRUPTED, f"interrupted by {signal} at {reached:.2f} s"
            if progress is not None:
                progress(reached, scenario.duration)
    told = np.vstack([*episodes, plant.under_way()])
    end = samples[done - 1, TIME] if done else -1.0  # maybe interrupted between two samples
    told = told[told[:, START] <= end]
    return samples[:done], told, outcome, message or completed(samples[:done])


def bound_of(scenario: Scenario, world: World) -> float:
    """Distance to the target beyond which the mission has diverged [m]."""
    sent = world.setup.destinations(scenario.duration)
    places = np.vstack([world.team.position, sent]) - world.setup.target.position(0.0)
    return DIVERGED_BEYOND * max(scenario.mission.radius, float(np.linalg.norm(places, axis=1).max()))


def completed(samples: Array) -> str:
    """Says that a run reached its end."""
    return f"completed {samples[-1, TIME]:g} s"


def take(plant: Plant, rows: Array, bound: float, look: bool = True) -> tuple[int, Array, Outcome, str]:
    """Take samples, and look whether to go on; what is not worth keeping is taken back.

    Args:
        plant: Is simulated on, to the last sample that is worth keeping.
        rows: Receives the samples, shape (k, record_size); fewer if the mission is interrupted on the way.
        bound: See `bound_of`.
        look: Whether to look for what plugins have changed in the process.

    Returns:
        How many samples to keep, the contact episodes that ended among them, and how things stand.
    """
    mark, began = plant.mark(), plant.steps
    taken, ended = plant.fill(rows, look)
    distances = distances_of(rows[:taken], plant.world.sizes)
    kept, outcome, message = examine(rows[:taken], distances, plant, bound)
    if outcome is not Outcome.FAILED:
        broken = _broken_off(plant, mark, began, rows[:taken], distances, bound)
        return broken or (kept, ended, outcome, message)
    if kept < taken:
        ended = take_back(plant, mark, kept)
    return kept, ended, outcome, message


def _broken_off(
    plant: Plant, mark: Mark, began: int, block: Array, distances: Array, bound: float
) -> tuple[int, Array, Outcome, str] | None:
    """Look for the physics step that breaks a run off, and end the run there, with a sample of its own.

    Where samples, or the speeds since the one before, leave that open, steps are taken once more, one by one.

    Args:
        plant: Has simulated the samples; is left as it is, or where the run ends.
        mark: Where they begin.
        began: How many physics steps had been taken there.
        block: The samples, shape (k, record_size); those that are kept are written anew.
        distances: See `distances_of`.
        bound: See `bound_of`.

    Returns:
        As of `take`; None if all is well.
    """
    sizes, schedule, warned = plant.world.sizes, plant.schedule, bool(plant.warnings())
    timestep, first = plant.world.scenario.physics.timestep, schedule.before(began)
    ends = [schedule.step(first + row) for row in range(len(block))]
    elapsed = (np.array(ends) - [began, *ends[:-1]])[:, np.newaxis] * timestep
    robots, target = (block[:, columns(name, sizes)] for name in ("speed_max", "target_speed_max"))
    is_open = ~(distances <= bound - (robots + target) * elapsed).all(axis=1) | ~_finite(block, sizes)
    if not (is_open.any() or warned):
        return None
    after, sample = plant.mark(), np.empty((1, plant.world.record_size))
    plant.back_to(mark)
    with stopping.deaf():
        for row in range(len(block)) if warned else np.flatnonzero(is_open):
            plant.fill(np.empty((row + first - schedule.before(plant.steps), plant.world.record_size)))
            here = plant.mark()
            plant.fill(sample)
            if not (is_open[row] or plant.warnings()):
                continue
            plant.back_to(here)
            while plant.steps <= ends[row]:
                plant.step(1)
                now, counted = plant.record[np.newaxis], plant.data.warning.number.copy()
                is_kept, outcome, message = examine(now, distances_of(now, sizes), plant, bound)
                if outcome is Outcome.COMPLETED:
                    continue
                last = plant.steps - 2 + is_kept
                plant.back_to(mark)
                with plant.ending_at(max(last, began)) as shorter:
                    kept, ended = plant.fill(block[: shorter.before(last + 1) - first], look=True)
                plant.data.warning.number[:] = counted
                return kept, ended, outcome, message
    plant.back_to(after)
    return None


def distances_of(block: Array, sizes: Mapping[str, int]) -> Array:
    """Return the distance of each robot to the target in some samples, shape (k, n) [m].

    It is 0 of those that are lost: wherever they drift, the mission goes on.
    """
    place, target, lost = (block[:, columns(name, sizes)] for name in ("q", "target_position", "lost"))
    with np.errstate(invalid="ignore", over="ignore"):  # of a state that is no number any longer
        away = place.reshape(len(block), sizes["robot"], sizes["axis"]) - target[:, np.newaxis]
        return np.where(lost > 0.0, 0.0, np.sqrt((away * away).sum(axis=2)))


def _limits(block: Array, sizes: Mapping[str, int], bound: float) -> Array | float:
    """How far from the target robots may be in some samples; where the radius may grow, shape (k, n) [m]."""
    if not sizes.get(RADII):
        return bound
    return np.maximum(bound, DIVERGED_BEYOND * block[:, columns("kept_radius", sizes)])


def _far_away(
    block: Array, distances: Array, sizes: Mapping[str, int], bound: float
) -> tuple[int, str] | None:
    """Return the first sample with a robot beyond a distance to the target [m], and which, in words."""
    far = distances > _limits(block, sizes, bound)
    if not far.any():
        return None
    first = int(np.argmax(far.any(axis=1)))
    robot = int(np.argmax(np.where(far[first], distances[first], 0.0)))
    away = f"{distances[first, robot]:.0f} m from the target at {block[first, TIME]:.2f} s"
    return first, f"robot {robot + 1} is {away}"


def take_back(plant: Plant, mark: Mark, kept: int) -> Array:
    """Brings a simulation back to an earlier sample; MuJoCo's warnings stay counted.

    Args:
        plant: What simulates.
        mark: Somewhat earlier.
        kept: How many samples after the mark.

    Returns:
        The contact episodes that ended between the two.
    """
    warned = plant.data.warning.number.copy()
    plant.back_to(mark)
    with stopping.deaf():
        _, ended = plant.fill(np.empty((kept, plant.world.record_size)), look=True)
    plant.data.warning.number[:] = warned
    return ended


def examine(block: Array, distances: Array, plant: Plant, bound: float) -> tuple[int, Outcome, str]:
    """Look at a block of samples.

    Args:
        block: The samples, shape (k, record_size).
        distances: See `distances_of`.
        plant: Has simulated them.
        bound: See `bound_of`.

    Returns:
        How many of its samples to keep, and how things stand.
    """
    if failure := plant.failure:
        before = block[:, TIME] < failure.time
        moment = f" at {failure.time:.2f} s"
        return int(before.sum()), Outcome.FAILED, f"a plugin raised an error{moment}: {failure.message}"
    if not len(block):
        return 0, Outcome.COMPLETED, ""
    sizes = plant.world.sizes
    finite = _finite(block, sizes)
    keep = len(block) if finite.all() else int(np.argmin(finite))
    if warnings := plant.warnings():
        words = ", ".join(f"{name} ({count} times)" for name, count in warnings.items())
        words += _excess(block, plant)
        return keep, Outcome.UNSTABLE, f"MuJoCo warned by {block[-1, TIME]:.2f} s: {words}"
    if far := _far_away(block[:keep], distances[:keep], sizes, bound):
        return far[0] + 1, Outcome.DIVERGED, far[1]
    if keep < len(block):
        return keep, Outcome.DIVERGED, f"the state is no longer a number at {block[keep, TIME]:.2f} s"
    return keep, Outcome.COMPLETED, ""


def _finite(block: Array, sizes: Mapping[str, int]) -> NDArray[np.bool_]:
    """Which samples hold numbers; clearances are infinite where there is nothing to be clear of."""
    law = block[:, columns("q", sizes).start : columns("disturbance", sizes).stop]
    return np.asarray(~np.isnan(block).any(axis=1) & np.isfinite(law).all(axis=1))


def _excess(block: Array, plant: Plant) -> str:
    """Name the law and the robot of the first force in a block of samples that MuJoCo does not take."""
    sizes = plant.world.sizes
    demanded = np.abs(block[:, columns("tau", sizes)]).reshape(len(block), sizes["robot"], -1).max(axis=2)
    rows, robots = np.nonzero(~(demanded <= LARGEST))
    if not len(rows):
        return ""
    row, robot = rows[0], robots[0]
    setup, force = plant.world.setup, demanded[row, robot]
    members = block[row, columns("member_of", sizes)].astype(int) - 1 if setup.teams else None
    law = setup.all_laws[setup.laws_of(members)[robot]]
    return f"; the law {law.law} demanded {force:.3g} N of robot {robot + 1} at {block[row, TIME]:.2f} s"
