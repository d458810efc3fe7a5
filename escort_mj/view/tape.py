"""What a viewer reads from: the samples of a run that was recorded, or of one that is simulated meanwhile."""

from __future__ import annotations

import math
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RenderError
from escort_mj.expect.verdicts import Verdict
from escort_mj.mission import bound_of, completed, conclude, labels_of, take
from escort_mj.record.episodes import NONE, during
from escort_mj.record.folder import MODEL, StoredRun, read_run
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import record, sealed
from escort_mj.report.video.replay import Replay, replay_of
from escort_mj.report.video.solids import load_model
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import TIME
from escort_mj.world.callback import callbacks, native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]

AT_ONCE = 8  # samples simulated between two looks at the clock


class Tape(Protocol):
    """Samples of a run, as far as there are any.

    Attributes:
        title: What the run is called.
        model: Its world.
        reached: Time of the last sample there is [s].
        end: Time of the last sample there will be [s].
        verdicts: What was expected and whether it held, once the run has ended.
        ending: How the run ended, in words; empty while it goes on.
        well: Whether it ended well, as far as is known.
    """

    title: str
    model: mujoco.MjModel
    end: float
    verdicts: list[Verdict]
    ending: str
    well: bool

    @property
    def reached(self) -> float:
        """Time of the last sample there is [s]."""
        ...

    def advance(self, until: float, budget: float) -> None:
        """Sees to it that there are samples up to a time, or as far as the wall time allows.

        Args:
            until: [s].
            budget: Wall time [s].
        """
        ...

    def around(self, now: float, before: float, most: int) -> tuple[Recorded, Replay]:
        """The samples of a while before a time, and the one after it.

        Args:
            now: [s].
            before: How far back to look [s].
            most: How many samples at most.
        """
        ...


def _rows(times: Array, now: float, before: float, most: int) -> NDArray[np.int64]:
    """Samples from some time before now to the first after it; the last two are neighbors."""
    row = max(int(np.searchsorted(times, now + 1e-9, side="right")) - 1, 0)
    first = min(int(np.searchsorted(times, now - before)), row)
    step = max(1, math.ceil((row - first) / most))
    past = np.arange(row, first - 1, -step)[::-1]
    return np.append(past, row + 1) if row + 1 < len(times) else past


def _whole(part: Recorded) -> tuple[Recorded, Replay]:
    """Samples with the contact episodes among them, and the same as a replay."""
    times = part["time"].values
    part = during(part, float(times[0]), float(times[-1]))
    return part, replay_of(part)


class Stored:
    """A run folder. See `Tape`."""

    def __init__(self, folder: Path) -> None:
        """Open a run folder.

        Raises:
            RunFolderError: If it is no run folder, or the run has recorded nothing.
            RenderError: If it holds no sample, or its model does not fit.
        """
        run: StoredRun = read_run(folder)
        if not run.trace.sizes["time"]:
            raise RenderError(f"{folder}: the trace holds no sample, so there is nothing to see")

        self._recording = sealed(run.trace)
        self._times: Array = self._recording["time"].values
        self.title = str(run.trace.attrs["title"])
        self.model = load_model(run.path / MODEL, run.trace.sizes["coordinate"])
        self.end = self.reached
        self.verdicts = [Verdict(**verdict) for verdict in run.verdicts if "metric" in verdict]
        self.ending, self.well = f"{run.outcome['message']}", run.outcome["outcome"] == "completed"

    @property
    def reached(self) -> float:
        """Time of the last sample [s]."""
        return float(self._times[-1])

    def advance(self, until: float, budget: float) -> None:
        """Nothing: all is there."""

    def around(self, now: float, before: float, most: int) -> tuple[Recorded, Replay]:
        """See `Tape.around`."""
        rows = _rows(self._times, now, before, most)
        return _whole(self._recording.isel(time=rows))


class Live:
    """A mission that is simulated as far as it is watched. See `Tape`; a context manager."""

    def __init__(self, scenario: Scenario) -> None:
        """Build the world and take the first sample.

        Args:
            scenario: What to run.
        """
        world = build(scenario)
        self.scenario, self.title = scenario, scenario.name
        self.model = mujoco.MjModel.from_xml_string(world.xml)  # with textures
        self._plant = Plant(world)
        self._labels = labels_of(scenario, world)
        schedule, timestep = world.schedule, scenario.physics.timestep
        self._spacing = schedule.stride * timestep
        self._samples = np.empty((schedule.count, world.record_size))
        self._done = 0
        self._episodes = NONE
        self._bound = bound_of(scenario, world)
        self._wall = 0.0
        self.end = schedule.last * timestep
        self.verdicts: list[Verdict] = []
        self.ending, self.well = "", True
        self._stack = ExitStack()
        callbacks(scenario.axes)  # compiled or read from the cache now
        self._stack.enter_context(native_loop(world))
        self._simulate(1)

    def __enter__(self) -> Live:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    @property
    def reached(self) -> float:
        """Time of the last sample so far [s]."""
        return float(self._samples[self._done - 1, TIME])

    def advance(self, until: float, budget: float) -> None:
        """Simulates up to a time, or as far as the wall time allows [s]."""
        start = time.perf_counter()
        while not self.ending and self.reached < until - 1e-9 and time.perf_counter() - start < budget:
            self._simulate(min(AT_ONCE, math.ceil((until - self.reached) / self._spacing)))

    def around(self, now: float, before: float, most: int) -> tuple[Recorded, Replay]:
        """See `Tape.around`."""
        times = self._samples[: self._done, TIME]
        rows = _rows(times, now, before, most)
        sizes = self._plant.world.sizes
        return _whole(record(self._samples[rows], sizes, self._labels, self._all_episodes()))

    def _all_episodes(self) -> Array:
        return np.vstack([self._episodes, self._plant.under_way()])

    def _simulate(self, most: int) -> None:
        """Take the next samples, and look whether to go on."""
        clock = time.perf_counter()
        rows = self._samples[self._done : self._done + most]
        kept, ended, outcome, message = take(self._plant, rows, self._bound)
        self._episodes = np.vstack([self._episodes, ended])
        self._done = max(self._done + kept, 1)
        self._wall += time.perf_counter() - clock
        if outcome is not Outcome.COMPLETED or self._done == len(self._samples):
            self._conclude(outcome, message or completed(self._samples[: self._done]))

    def _conclude(self, outcome: Outcome, message: str) -> None:
        samples = self._samples[: self._done]
        told = (samples, self._all_episodes(), outcome, message, self._wall)
        run = conclude(self.scenario, self._plant, *told)
        self.ending, self.well, self.verdicts = message, outcome.good, run.verdicts
