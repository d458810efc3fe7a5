"""Judges a log of real robots as a run is judged: the scenario says what the log does not.

The logged motion is played through the scenario's world, one physics step after another: MuJoCo's geometry
gives clearances and touches, the scenario's outer loop the reference velocities that it demands where the
robots are. Nothing is integrated, so no force is found: neither of motors, unless logged, nor of contacts.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import axis_names
from escort_mj.errors import LogError, UsageError
from escort_mj.expect.verdicts import Verdict
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.judging.log import FORCE, POSITION, REFERENCE, Gap, Log, Track, Wanted
from escort_mj.judging.messages import BAG, DATABASE, MCAP, is_messages, read_messages
from escort_mj.judging.resampling import at, before, motion_of, totals_of, velocity_of, without_gaps
from escort_mj.judging.tables import CSV, PARQUET, read_table
from escort_mj.metrics.measure import in_words
from escort_mj.mission import Flight, Progress, sum_up
from escort_mj.numerics.steps import SLACK, last_step
from escort_mj.recognize import irregular
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import GAPS, LOG, LOG_END, LOG_OF, NOT_LOGGED, NOT_SEEN, record
from escort_mj.scenario import Scenario
from escort_mj.scenario.findings import did_you_mean, listed, shortened
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.placement import robot_count
from escort_mj.scenario.geometry.trajectory import Piecewise, Trajectory
from escort_mj.scenario.mission import Mission, Seen
from escort_mj.signals import KNOWLEDGE, LIDAR, RADIO, SIGNALS, columns
from escort_mj.world.labels import labels_of
from escort_mj.world.model.build import World, build
from escort_mj.world.playback import play

Array = NDArray[np.float64]

UNKNOWN = (
    *("force", "disturbance", "outer_updates", "q_d", "e", "s", "tau", "rho_hat"),
    *("saturated_time", "effort", "work", "force_variation", "drive_force", "mover_work"),
    *("q_measured", "v_measured", "target_position_measured", "target_velocity_measured"),
)
"""Signals that are unknown unless the log contains them."""
TOTALS = ("outer_updates", "saturated_time", "effort", "work", "force_variation")
"""Signals that a log may contain and that only grow."""
SENSED = (KNOWLEDGE, RADIO, LIDAR)
"""Channels of signals that no log contains: what robots see, hear and estimate."""
DEMANDED = (
    *("v_d", "e_dot", "avoidance_active", "phase", "ruling"),
    *("task_error", "task_wish", "task_removed", "task_angle", "threat"),
)
"""Signals that are unknown likewise where the outer loop sees more than the log tells, or something else."""
OF_TARGET = (
    *("target_position", "target_velocity", "target_speed_max"),
    *("target_clearance", "target_clearance_body", "kinetic_energy"),
)
OF_OBSTACLES = ("obstacle_position", "obstacle_distance", "obstacle_speed_max", "kinetic_energy")
OF_OPPONENTS = ("opponent_status", "interceptor")
OF_TEAMS = ("team_center", "team_velocity")
"""Signals that are unknown where one of such bodies is not in the log."""
AWAY = 1e4  # where bodies are that nobody logged: away from all others [m]
NO_FORCES = "none: touches are found by geometry, and a log tells no force of theirs"
MOST_GAPS = 5  # that are listed
FAR_OFF = 30.0  # times what a quantity should be: its unit is wrong
MOMENTS = 100  # at which the size of the team is looked at


def judge_log(
    path: Path,
    scenario: Scenario,
    names: Mapping[str, str] | None = None,
    start: float | None = None,
    progress: Progress | None = None,
) -> Flight:
    """Judge a log of real robots.

    Args:
        path: A CSV, Parquet or MCAP file, or a ROS bag.
        scenario: Says what the log does not: radii, obstacles, formation, expectations.
        names: What bodies (`robot_1` ..., `target`) are called in the log: in columns, or their topics.
        start: Time stamp of the mission's start [s]; None for the first at which all bodies are logged.
        progress: Called now and then.

    Raises:
        LogError: With all faults of the log.
        UsageError: If there is no such log, or it cannot be read.
    """
    clock = time.perf_counter()
    scenario = scenario.replace({"recording.truth": False}) if scenario.recording.truth else scenario
    wanted = wanted_of(scenario, names or {})
    log = read_log(path, wanted)
    begun, length = _span(log, scenario, start)
    if faults := [
        *log.faults,
        *_track_faults(log),
        *_time_faults(log, scenario, start),
        *_scale_faults(log, scenario, start),
    ]:
        raise LogError(path, faults)
    missing = [name for name in wanted.bodies if name in wanted.unforeseen and name not in log.tracks]
    short = scenario.model_copy(update={"duration": length})  # whose expectations look beyond its end
    timestep = scenario.physics.timestep
    times = timestep * np.arange(last_step(length, timestep) + 1.0)
    motion = motion_of(log, wanted.robots, begun, times)
    gaps = [
        Gap(gap.start - begun, gap.end - begun, gap.bodies)
        for gap in log.gaps
        if gap.end > begun and gap.start < begun + length
    ]
    hidden = _hidden(times, gaps)
    ends = np.flatnonzero(np.diff(hidden.astype(int)))  # the last step before a gap, the last step in it
    edges = tuple(int(step) + int(hidden[step]) for step in ends)
    seen = Seen(motion.position[0], motion.others.get("target"), edges)
    world = build(Mission(short, seen=seen))
    away = {name: _resting(AWAY * place, scenario.axes) for place, name in enumerate(missing, 1)}
    samples, episodes = play(world, motion.position, motion.velocity, motion.others | away, hidden, progress)
    unknown = _fill(samples, world, log, wanted, begun, [*_unknown_of(missing, scenario)])
    labels = labels_of(scenario, world)
    labels["attributes"] |= {
        "contact_forces": NO_FORCES,
        "contact_physics": "none: a log of real robots",
        LOG: path.name,
        "log_start": begun,
        LOG_END: length,
        LOG_OF: scenario.duration if _is_short(log, scenario, length) else length,
        NOT_LOGGED: " ".join(unknown),
        GAPS: [time for gap in gaps for time in gap[:2]] or None,
        NOT_SEEN: " ".join(missing),
    }
    for place, name in enumerate(missing, 1):
        _put_back(samples, world, name, AWAY * place)
    recording = record(samples, world.sizes, labels, episodes)
    words = f"log of real robots: {float(samples[-1, 0]):g} s of {path.name}"
    if _is_short(log, scenario, length):
        words += f", {100.0 * length / scenario.duration:.3g} % of the scenario's {scenario.duration:g} s"
    words += _without(gaps, len(log.tracks))
    if missing:
        words += f"; {listed(missing)} not in the log, and not judged"
    flight = sum_up(scenario, recording, Outcome.COMPLETED, words, time.perf_counter() - clock)
    flight.seen = seen
    flight.verdicts += _unless_some_judged(scenario, flight.verdicts)
    return flight


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
    if not path.exists():
        raise UsageError(f"{path}: there is no such file or folder")
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


def _track_faults(log: Log) -> Iterator[str]:
    """What is wrong with single bodies; where all share the same time stamps, that of these once."""
    told = set()
    for track in log.tracks.values():
        for fault in track.faults():
            words = fault.partition(": ")[2]
            if not words.startswith("time is not ascending") or words not in told:
                yield fault
            told.add(words)


def _span(log: Log, scenario: Scenario, start: float | None) -> tuple[float, float]:
    """Time stamp of the start, and how long all bodies are logged from there on, at most to the end [s]."""
    times = [track.time for track in log.tracks.values() if len(track.time)]
    if not times:
        return 0.0, 0.0
    begun = max(float(time[0]) for time in times) if start is None else start
    end = min(float(time[-1]) for time in times)
    for gap in log.gaps:
        if gap.start < begun < gap.end and start is None:
            begun = gap.end
        if gap.start < end < gap.end:
            end = gap.start
    timestep = scenario.physics.timestep
    whole = last_step(end - begun, timestep) * timestep if end > begun else 0.0
    return begun, min(scenario.duration, whole)


def _time_faults(log: Log, scenario: Scenario, start: float | None) -> Iterator[str]:
    """Logs that do not cover what is to be judged."""
    tracks = [track for track in log.tracks.values() if len(track.time)]
    if not tracks:
        return
    begun, length = _span(log, scenario, start)
    first = max(tracks, key=lambda track: float(track.time[0]))
    last = min(tracks, key=lambda track: float(track.time[-1]))
    span = float(last.time[-1] - first.time[0])
    if span > FAR_OFF * scenario.duration:
        words = f"time goes from {first.time[0]:.10g} to {last.time[-1]:.10g}, the mission lasts"
        yield f"{words} {scenario.duration:g} s: time must be in seconds"
        return
    if begun < float(first.time[0]) - SLACK * scenario.physics.timestep:
        yield f"--start {begun:.10g}: {first.name} is logged from {first.time[0]:.10g} s on"
    for gap in log.gaps:
        if gap.start < begun < gap.end:
            words = f"{in_words(gap.bodies)} from {gap.start:.10g} to {gap.end:.10g} s"
            yield f"--start {begun:.10g}: the log has no position of {words}"
    if length < scenario.physics.timestep:
        words = (
            f"{first.name} is logged from {first.time[0]:.10g} s on, {last.name} up to {last.time[-1]:.10g} s"
        )
        yield f"no time at which all bodies are logged: {words}"
        return


def _is_short(log: Log, scenario: Scenario, length: float) -> bool:
    """Whether a log ends more than a usual step between two stamps before the scenario does."""
    usual = max(float(np.median(np.diff(track.time))) for track in log.tracks.values())
    return length < scenario.duration - usual - SLACK * scenario.physics.timestep


def _resting(place: float, axes: int) -> Trajectory:
    """The way of a body that rests at a place on the first axis, 0 on the others [m]."""
    return Trajectory(
        tuple(Piecewise(np.array([[0.0, place * (axis == 0), 0.0, 0.0, 0.0]])) for axis in range(axes))
    )


def _put_back(samples: Array, world: World, name: str, away: float) -> None:
    """Put a body that nobody logged where it starts in the scenario, for pictures; nothing is judged of it.

    Args:
        samples: Shape (k, record_size).
        world: Of the mission.
        name: Of the body.
        away: Where it was on the first axis meanwhile [m].
    """
    p, obstacle = world.setup.axes, world.bodies.names.index(name) - len(world.team.mass) - 1
    start = next(mover.path.position(0.0) for mover in world.setup.movers if mover.obstacle == obstacle)
    signal = "target_position" if obstacle < 0 else "obstacle_position"
    first = columns(signal, world.sizes).start + p * max(obstacle, 0)
    samples[:, first : first + p] = start
    coordinates = columns("qpos", world.sizes)
    first = coordinates.start + int(np.argmax(samples[0, coordinates] == away))
    samples[:, first : first + p] = start
    for name, nearest in (("clearance", "clearance_body"), ("target_clearance", "target_clearance_body")):
        distance, body = samples[:, columns(name, world.sizes)], samples[:, columns(nearest, world.sizes)]
        far = distance > 0.5 * AWAY
        distance[far], body[far] = np.inf, -1.0


def _unknown_of(missing: Sequence[str], scenario: Scenario) -> Iterator[str]:
    """What is not known of a mission whose log does not contain some bodies, and no sensor's values."""
    yield from UNKNOWN
    sensed = {KNOWLEDGE: scenario.knowledge, RADIO: scenario.communication, LIDAR: scenario.sensing.lidar}
    yield from (signal.name for signal in SIGNALS if sensed.get(signal.channel) is not None)
    if missing or scenario.knowledge is not None or scenario.sensing != type(scenario.sensing)():
        yield from DEMANDED
    if "target" in missing:
        yield from OF_TARGET
    for body in obstacles_of(scenario):
        if body.name in missing:
            yield from OF_OBSTACLES
            yield from {"opponents": OF_OPPONENTS, "teams": OF_TEAMS}.get(str(body.path[0]), ())


def _scale_faults(log: Log, scenario: Scenario, start: float | None) -> Iterator[str]:
    """Positions of another unit than meters: the team is far larger or smaller than its formation."""
    begun, length = _span(log, scenario, start)
    tracks = [track for track in log.tracks.values() if len(track.time) > 1]
    if len(tracks) < 2 or length <= 0.0 or not all(one.sound for one in tracks):
        return
    times = np.linspace(begun, begun + length, MOMENTS)
    team = np.stack([at(times, track.time, track.values[POSITION]) for track in tracks])
    away = np.linalg.norm(team - team.mean(axis=0), axis=2)
    size, radius = float(np.median(away)), scenario.mission.radius
    if not radius / FAR_OFF < size < radius * FAR_OFF:
        words = (
            f"its bodies are a median of {size:.3g} from their center, the mission's radius is {radius:g} m"
        )
        yield f"{words}: positions must be in meters"


def _fill(
    samples: Array, world: World, log: Log, wanted: Wanted, start: float, unknown: Sequence[str]
) -> list[str]:
    """Write what else the log tells into samples; what it does not becomes NaN, or 0 where that is none.

    Of obstacles, only those become NaN that the log does not contain.

    Returns:
        Names of the signals that are unknown.
    """
    times = samples[:, 0] + start
    known = _logged(log, wanted, world, times, start)
    moving = len(wanted.robots) + len(world.setup.movers)
    more = world.model.nv > moving * world.setup.axes  # turning, rolling, swinging loads: nobody logged these
    missing = [name for name in dict.fromkeys((*unknown, *("kinetic_energy",) * more)) if name not in known]
    hidden = wanted.unforeseen - log.tracks.keys()
    lacks = np.array([name in hidden for name in world.bodies.names[len(wanted.robots) + 1 : -1]], dtype=bool)
    kinds = {signal.name: signal for signal in SIGNALS if signal.recorded(world.sizes)}
    sensed = [signal.name for signal in SIGNALS if signal.channel in SENSED]
    missing = [name for name in missing if name in kinds or name in sensed]
    for name in (*known, *(name for name in missing if name in kinds)):
        signal = kinds[name]
        nothing = np.nan if np.dtype(signal.dtype).kind == "f" else 0.0
        place = columns(name, world.sizes)
        if name in known:
            samples[:, place] = known[name].reshape(len(samples), -1)
        elif "obstacle" in signal.dims:
            shape = [world.sizes[dim] for dim in signal.dims]
            where = lacks[:, None] if signal.dims[0] == "obstacle" and len(shape) > 1 else lacks
            samples[:, place] = np.where(np.broadcast_to(where, shape).ravel(), nothing, samples[:, place])
        else:
            samples[:, place] = nothing
    return missing


def _logged(log: Log, wanted: Wanted, world: World, times: Array, start: float) -> dict[str, Array]:
    """Signals that the log contains, at times, each of shape (times, ...)."""
    tracks: list[Track] = [log.tracks[name] for name in wanted.robots]
    found: dict[str, Array] = {}
    if all(FORCE in track.values for track in tracks):
        found["force"] = np.stack([at(times, track.time, track.values[FORCE]) for track in tracks], axis=1)
        totals = [
            (track, totals_of(track, float(limit), start))
            for track, limit in zip(tracks, world.setup.force_limit, strict=True)
        ]
        for name in totals[0][1]:
            each = [at(times, track.time, one[name]) for track, one in totals]
            found[name] = np.stack(each, axis=1)
    if all(REFERENCE in track.values for track in tracks):
        found["v_d"] = np.stack([at(times, track.time, track.values[REFERENCE]) for track in tracks], axis=1)
    kinds = {signal.name: np.dtype(signal.dtype).kind for signal in SIGNALS}
    for name, (stamps, values) in log.signals.items():
        if name in TOTALS:
            values = without_gaps(stamps, values, log.gaps)
        found[name] = (at if kinds[name] == "f" else before)(times, stamps, values)
    if "v_d" in found and "e_dot" not in found:
        speed = [at(times, track.time, velocity_of(track)) for track in tracks]
        found["e_dot"] = found["v_d"] - np.stack(speed, axis=1)
    return found
