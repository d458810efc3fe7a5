"""What a viewer reads from: the samples of a run that was recorded, or of one that is simulated meanwhile."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RenderError
from escort_mj.mission.stepped import SteppedMission
from escort_mj.record.episodes import during
from escort_mj.record.folder import MODEL, StoredRun, read_run
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.record.recording import Recorded, record, sealed
from escort_mj.report.video.replay import Replay, replay_of
from escort_mj.report.video.solids import load_model
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import TIME
from escort_mj.world.labels import labels_of
from escort_mj.world.stages import IN_SPACE

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

    @property
    def movable(self) -> tuple[str, ...]:
        """Names of the bodies that can be put elsewhere."""
        ...

    def move(self, name: str, position: Array) -> None:
        """Put a body elsewhere, from the last sample on.

        Args:
            name: One of `movable`.
            position: World frame, shape (3,) [m].
        """
        ...


def failures(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return the verdicts that failed at a known moment, in the order of these moments."""
    failed = [
        (one.time, place, one)
        for place, one in enumerate(verdicts)
        if not one.passed and one.time is not None
    ]
    return [one for *_, one in sorted(failed, key=lambda each: each[:2])]


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
            RunFolderError: If it is no run folder, the run has recorded nothing, or its model does not fit.
            RenderError: If it holds no sample.
        """
        run: StoredRun = read_run(folder)
        if not run.trace.sizes["time"]:
            raise RenderError(f"{folder}: the trace holds no sample, so there is nothing to see")

        self._recording = sealed(run.trace)
        self._times: Array = self._recording["time"].values
        self.title = str(run.trace.attrs["title"])
        self.model = load_model(run.path / MODEL, run.trace.sizes["coordinate"])
        self.end = self.reached
        self.verdicts = run.verdicts
        self.ending, self.well = f"{run.outcome['message']}", run.outcome["outcome"] == "completed"

    @property
    def reached(self) -> float:
        """Time of the last sample [s]."""
        return float(self._times[-1])

    movable: tuple[str, ...] = ()

    def advance(self, until: float, budget: float) -> None:
        """Nothing: all is there."""

    def move(self, name: str, position: Array) -> None:
        """Nothing: what is recorded stays."""

    def around(self, now: float, before: float, most: int) -> tuple[Recorded, Replay]:
        """See `Tape.around`."""
        rows = _rows(self._times, now, before, most)
        return _whole(self._recording.isel(time=rows))


class Live:
    """A mission that is simulated as far as it is watched. See `Tape`.

    Attributes:
        mission: The mission.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Build the world and take the first sample.

        Args:
            scenario: What to run.
        """
        self.mission = SteppedMission(scenario)
        self.title = scenario.name
        world = self.mission.world
        self.model = mujoco.MjModel.from_xml_string(world.xml, world.assets)  # with textures
        schedule, timestep = world.schedule, scenario.physics.timestep
        self._spacing = schedule.stride * timestep
        self.end = schedule.last * timestep
        self.verdicts: list[Verdict] = []
        self.ending, self.well = "", True
        fixed = [k for k, obstacle in enumerate(scenario.obstacles) if obstacle.motion is None]
        names = [body.name for body in world.mission.obstacles]
        self._obstacles = {names[k]: k for k in fixed} if scenario.axes <= IN_SPACE else {}

    @property
    def reached(self) -> float:
        """Time of the last sample so far [s]."""
        return float(self.mission.samples[-1, TIME])

    @property
    def movable(self) -> tuple[str, ...]:
        """See `Tape.movable`: a target without a policy, and obstacles that the scenario lets rest."""
        known = self.mission.scenario.target
        target = ("target",) if known is not None and known.policy is None else ()
        return (*target, *self._obstacles) if self.mission.scenario.axes <= IN_SPACE else ()

    def move(self, name: str, position: Array) -> None:
        """See `Tape.move`."""
        if self.ending:
            return
        place = position[: self.mission.scenario.axes]
        if name == "target":
            self.mission.move_target(place)
            return
        self.mission.change({f"obstacles.{self._obstacles[name]}.position": place.tolist()})
        self.model.body(name).pos[: len(place)] = place

    def advance(self, until: float, budget: float) -> None:
        """Simulates up to a time, or as far as the wall time allows [s]."""
        start = time.perf_counter()
        while not self.ending and self.reached < until - 1e-9 and time.perf_counter() - start < budget:
            spacings = min(AT_ONCE, math.ceil((until - self.reached) / self._spacing - 1e-6))
            self.mission.step(spacings * self._spacing)
            if self.mission.outcome is not Outcome.RUNNING:
                flight = self.mission.flight()
                self.ending, self.well, self.verdicts = flight.message, flight.outcome.good, flight.verdicts

    def around(self, now: float, before: float, most: int) -> tuple[Recorded, Replay]:
        """See `Tape.around`."""
        samples, world = self.mission.samples, self.mission.world
        rows = _rows(samples[:, TIME], now, before, most)
        labels = labels_of(self.mission.scenario, world)
        return _whole(record(samples[rows], world.sizes, labels, self.mission.episodes))
