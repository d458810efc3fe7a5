"""Judges a log of real robots as a run is judged: the scenario says what the log does not.

The logged motion is played through the scenario's world, one physics step after another: MuJoCo's geometry
gives clearances and touches, the scenario's outer loop the reference velocities that it demands where the
robots are. Nothing is integrated, so no force is found: neither of motors, unless logged, nor of contacts.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import axis_names
from escort_mj.errors import LogError, UsageError
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.judging.faults import faults_of, is_short, span_of
from escort_mj.judging.filling import fill, ways_away
from escort_mj.judging.log import Gap, Log, Wanted
from escort_mj.judging.messages import BAG, DATABASE, MCAP, is_messages, read_messages
from escort_mj.judging.resampling import motion_of
from escort_mj.judging.tables import CSV, PARQUET, read_table
from escort_mj.metrics.measure import in_words
from escort_mj.mission import Flight, Progress, completed, sum_up
from escort_mj.mission.stepped import SteppedMission
from escort_mj.numerics.steps import SLACK, last_step
from escort_mj.recognize import irregular
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.record.recording import GAPS, LOG, LOG_END, LOG_OF, NOT_LOGGED, NOT_SEEN, record
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import checked
from escort_mj.scenario.findings import did_you_mean, listed, shortened
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.placement import robot_count
from escort_mj.scenario.mission import Mission, Seen
from escort_mj.snapshots import mission_mark
from escort_mj.world.labels import labels_of
from escort_mj.world.model.build import World, build
from escort_mj.world.playback import Playback, without_forces

Array = NDArray[np.float64]

NO_FORCES = "none: touches are found by geometry, and a log tells no force of theirs"
MOST_GAPS = 5  # that are listed


def judge_log(
    path: Path,
    scenario: Scenario,
    names: Mapping[str, str] | None = None,
    start: float | None = None,
    progress: Progress | None = None,
) -> Flight:
    """Judge a log of real robots, see `Replay`.

    Args:
        path: A CSV, Parquet or MCAP file, or a ROS bag.
        scenario: Says what the log does not: radii, obstacles, formation, expectations.
        names: What bodies (`robot_1` ..., `target`) are called in the log: in columns, or their topics.
        start: Time stamp of the mission's start [s]; None for the first at which all bodies are logged.
        progress: Called now and then.

    Raises:
        LogError: With all faults of the log.
        UsageError: If there is no such log, or it cannot be read.
        KeyboardInterrupt: On an interrupt.
    """
    replay = Replay(path, scenario, names, start)
    if progress is not None:
        replay.on_sample(lambda now: progress(now.time, replay.length))
    replay.step(replay.length)
    return replay.flight()


class Replay(SteppedMission):
    """A log of real robots, as a mission under way: stepped, looked at and taken back, but left as it was.

    Attributes:
        log: As it was read.
        length: How much of it the mission covers [s].
    """

    @checked
    def __init__(
        self,
        path: Path,
        scenario: Scenario,
        names: Mapping[str, str] | None = None,
        start: float | None = None,
    ) -> None:
        """Read a log, and look at its first moment; arguments and errors as of `judge_log`."""
        scenario = scenario.replace({"recording.truth": False}) if scenario.recording.truth else scenario
        self._wanted = wanted = wanted_of(scenario, names or {})
        self.log = log = read_log(path, wanted)
        if faults := [*faults_of(log, scenario, start)]:
            raise LogError(path, faults)
        self._start, self.length = begun, length = span_of(log, scenario, start)
        self._missing = [n for n in wanted.bodies if n in wanted.unforeseen and n not in log.tracks]
        self._gaps = [
            Gap(gap.start - begun, gap.end - begun, gap.bodies)
            for gap in log.gaps
            if gap.end > begun and gap.start < begun + length
        ]
        timestep = scenario.physics.timestep
        times = timestep * np.arange(last_step(length, timestep) + 1.0)
        hidden = _hidden(times, self._gaps)
        ends = np.flatnonzero(np.diff(hidden.astype(int)))  # the last step before a gap, the last step in it
        motion = motion_of(log, wanted.robots, begun, times, hidden)
        edges = tuple(int(step) + int(hidden[step]) for step in ends)
        self._seen = Seen(motion.position[0], motion.ways.get("target"), edges)
        ways = {**motion.ways, **ways_away(self._missing, scenario.axes)}
        self._motion = motion._replace(ways=ways)
        super().__init__(scenario)
        self._mark = mission_mark(scenario, log.sum, begun)

    def _build(self, scenario: Scenario) -> World:
        short = scenario.model_copy(update={"duration": self.length})  # its expectations look beyond its end
        return build(Mission(short, seen=self._seen))

    def _plant(self, world: World) -> Playback:
        return Playback(world, self._motion)

    def _advance_undisturbed(self, until: int) -> None:
        schedule, plant = self.world.schedule, self.plant
        while plant.steps < until:
            sample = schedule.step(schedule.before(plant.steps))
            if not plant.step(min(sample + 1, until) - plant.steps):
                return
            if failure := plant.failure:
                moment = f"a plugin raised an error at {failure.time:.2f} s"
                self.outcome, self.message = Outcome.FAILED, f"{moment}: {failure.message}"
                return
            if plant.steps == sample + 1 and not self._motion.hidden[sample]:
                self.keep(plant.record[None], plant.ended())
                for watcher in self._watchers:
                    watcher(self)
        if plant.steps > schedule.last:
            self.outcome, self.message = Outcome.COMPLETED, completed(self.samples)

    def _refuse(self, *values: Any, **named: Any) -> NoReturn:
        """Say that what has happened stays so.

        Raises:
            UsageError: Always.
        """
        raise UsageError(
            "a log of real robots: what has happened cannot be commanded, pushed or changed; expected step, "
            "state, snapshot, restore and run"
        )

    command = push = release = move_target = change = _refuse

    def flight(self) -> Flight:
        """Return what the log tells so far, judged."""
        scenario, log, samples = self.scenario, self.log, self.samples.copy()
        unknown = fill(samples, self.world, log, self._wanted, self._start, self._missing)
        end = float(samples[-1, 0]) if len(samples) else 0.0
        short = is_short(log, scenario, end)
        labels = labels_of(scenario, self.world)
        labels["attributes"] |= {
            "contact_forces": NO_FORCES,
            "contact_physics": "none: a log of real robots",
            LOG: log.path.name,
            "log_start": self._start,
            LOG_END: end,
            LOG_OF: scenario.duration if short else end,
            NOT_LOGGED: " ".join(unknown),
            GAPS: [time for gap in self._gaps for time in gap[:2]] or None,
            NOT_SEEN: " ".join(self._missing),
        }
        recording = record(samples, self.world.sizes, labels, without_forces(self.episodes))
        words = f"log of real robots: {end:g} s of {log.path.name}"
        if short:
            share = 100.0 * end / scenario.duration
            words += f", {share:.3g} % of the scenario's {scenario.duration:g} s"
        words += _without(self._gaps, len(log.tracks))
        if self._missing:
            words += f"; {listed(self._missing)} not in the log, and not judged"
        if self.outcome is Outcome.FAILED:
            words += f"; {self.message}"
        outcome = Outcome.INTERRUPTED if self.outcome is Outcome.RUNNING else self.outcome
        flight = sum_up(scenario, recording, outcome, words, self.wall)
        flight.seen = self._seen
        flight.verdicts += _unless_some_judged(scenario, flight.verdicts)
        return flight


def wanted_of(scenario: Scenario, names: Mapping[str, str]) -> Wanted:
    """What a scenario has to find in a log.

    Raises:
        UsageError: If a name is given to a body that the scenario does not have.
    """
    robots = tuple(f"robot_{k + 1}" for k in range(robot_count(scenario)))
    bodies = [body for body in obstacles_of(scenario) if body.motion is not None and body.drive is not None]
    willed = {body.name for body in bodies if body.policy is not None or body.path[0] != "teams"}
    if scenario.target is not None and scenario.target.policy is not None:
        willed.add("target")
    moving = tuple(body.name for body in bodies)
    wanted = Wanted(robots, tuple(axis_names(scenario.axes)), moving, frozenset(willed), names)
    if not isinstance(names, Mapping) or not all(
        isinstance(one, str) for pair in names.items() for one in pair
    ):
        raise UsageError(f"names: found {shortened(names)}; expected names in the log by names of bodies")
    for name in names:
        if name not in wanted.bodies:
            hint = did_you_mean(name, wanted.bodies) or f"; allowed are {listed(wanted.bodies)}"
            raise UsageError(f"--map {shortened(name)}={names[name]}: the scenario has no such body{hint}")
    called: dict[str, str] = {}
    for body in wanted.bodies:
        label = names.get(body, body)
        if label in called:
            raise UsageError(
                f"--map: {called[label]} and {body} would both be {shortened(label)} in the log; "
                f"--map {body}=NAME gives {body} another name"
            )
        called[label] = body
    return wanted


def read_log(path: Path, wanted: Wanted) -> Log:
    """Read a log; its suffix says how.

    Raises:
        UsageError: If there is none, or it cannot be read.
        LogError: If its columns make no sense.
    """
    if not os.path.exists(path):  # which a name that is too long does not either
        raise UsageError(f"{shortened(path)}: there is no such file or folder")
    inside = sorted(path.iterdir()) if path.is_dir() else []
    if kind := next(filter(None, map(irregular, [path, *inside])), ""):
        raise UsageError(f"{path}: is {kind}, not a file" if not inside else f"{path}: holds {kind}")
    if path.suffix in (CSV, PARQUET):
        return read_table(path, wanted)
    if is_messages(path):
        return read_messages(path, wanted)
    kinds = listed([CSV, PARQUET, MCAP, DATABASE, BAG, "the folder of a rosbag2"])
    raise UsageError(f"{path}: is no log; allowed are {kinds}")


def _hidden(times: Array, gaps: Sequence[Gap]) -> NDArray[np.bool_]:
    """Whether each time lies within a gap, its ends excluded, shape (times,)."""
    hidden = np.zeros(len(times), dtype=bool)
    slack = SLACK * (times[1] - times[0]) if len(times) > 1 else 0.0
    for gap in gaps:
        hidden |= (times > gap.start + slack) & (times < gap.end - slack)
    return hidden


def _without(gaps: Sequence[Gap], count: int) -> str:
    """What of a log of so many bodies is not judged, in words; nothing without gaps."""
    if not gaps:
        return ""
    shown = [
        f"from {gap.start:.6g} to {gap.end:.6g} s "
        f"({'all bodies' if len(gap.bodies) == count else in_words(gap.bodies)})"
        for gap in gaps[:MOST_GAPS]
    ]
    more = [f"{len(gaps) - MOST_GAPS} more"] * (len(gaps) > MOST_GAPS)
    total = sum(gap.end - gap.start for gap in gaps)
    return f"; not logged, and not judged, for {total:.6g} s: {', '.join([*shown, *more])}"


def _unless_some_judged(scenario: Scenario, verdicts: Sequence[Verdict]) -> Iterator[Verdict]:
    """Yield a verdict that fails if a log tells nothing of what a scenario expects beside an outcome."""
    asked = {
        place
        for place, one in enumerate(scenario.expect)
        if one.skip is None and one.kind != OutcomeExpectation.kind
    }
    skipped = {verdict.expectation for verdict in verdicts if verdict.skip}
    if not asked or not asked <= skipped:
        return
    subject, demanded, found = "judged", "at least 1 expectation", f"0 of {len(asked)}"
    yield Verdict(
        subject, demanded, 0.0, "", None, "", -1.0, passed=False, near_miss=False, held=False,
        message=f"{subject} {demanded}: {found}",
    )  # fmt: skip
