"""Logs as messages by topic: MCAP with JSON (ours and others'), and ROS bags."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import UsageError
from escort_mj.judging.log import FORCE, POSITION, REFERENCE, VELOCITY, Log, Track, Wanted
from escort_mj.scenario.findings import did_you_mean, listed, shortened, shown

Array = NDArray[np.float64]
Messages = Iterator[tuple[str, float, Any]]
"""Topic, time stamp of the recording [s], and the message."""

MCAP, BAG, DATABASE, INDEX = ".mcap", ".bag", ".db3", "metadata.yaml"
PLACES = ("pose.pose.position", "pose.position", "transform.translation", "point", "position", "translation")
"""Where messages have a position: Odometry, PoseStamped, TransformStamped, PointStamped, our own exports."""
SPEEDS = ("twist.twist.linear", "twist.linear", "velocity")
TURN, BODY_SPEED = "pose.pose.orientation", SPEEDS[0]  # of Odometry, whose velocity is in the body's frame
FORCES = ("force", "wrench.force")
QUANTITIES = {POSITION: PLACES, VELOCITY: SPEEDS, FORCE: FORCES, REFERENCE: (REFERENCE,)}
NS = 1e-9
PREFERRED = ("odometry", "odom", "robot", "target", "posestamped", "pose")  # in types and topics


def is_messages(path: Path) -> bool:
    """Whether a path is a log of messages."""
    return path.suffix in (MCAP, BAG, DATABASE) or (path.is_dir() and (path / INDEX).is_file())


def read_messages(path: Path, wanted: Wanted) -> Log:
    """Read a log from an MCAP file or a ROS bag.

    Args:
        path: The file, or the folder of a rosbag2.
        wanted: What to look for.

    Raises:
        UsageError: If it cannot be read, or the package that reads it is not installed.
    """
    opened = _json_mcap if path.suffix == MCAP and _is_json(path) else _ros_bag
    with _readable(path), opened(path) as (topics, messages):
        chosen, faults = choose_topics(topics, wanted)
        rows: dict[str, list[tuple[float, dict[str, Array]]]] = {topic: [] for topic in chosen.values()}
        for topic, stamp, message in messages(set(rows)):
            try:
                found, own = reading_of(message, len(wanted.axes)), _stamp(message)
            except ValueError as error:
                raise UsageError(f"{path}: {topic} at {stamp:.16g} s: {error}") from None
            if POSITION in found:
                rows[topic].append((own or stamp, found))
    tracks = {}
    for name, topic in chosen.items():
        if rows[topic]:
            tracks[name] = _track(name, topic, rows[topic])
        else:
            kind = topics[topic]
            places = listed(PLACES)
            faults.append(f"{name}: no message of {topic} ({kind}) has a position; looked for {places}")
    ignored = tuple(topic for topic in topics if topic not in rows)
    return Log(path, tracks, {}, ignored, tuple(faults))


def choose_topics(topics: Mapping[str, str], wanted: Wanted) -> tuple[dict[str, str], list[str]]:
    """Choose the topic of each body.

    Args:
        topics: Type of the messages by topic.
        wanted: The bodies, and topics that were named for them.

    Returns:
        Topics by body, and what is wrong with them.
    """
    chosen, faults = {}, []
    for name in wanted.bodies:
        if (given := wanted.names.get(name)) is not None:
            if given in topics:
                chosen[name] = given
            else:
                hint = did_you_mean(given, topics) or f"; the log has {listed(sorted(topics))}"
                faults.append(f"--map {name}={given}: there is no such topic{hint}")
            continue
        own = [topic for topic in topics if _names(topic, name)]
        ranked = sorted((_rank(topic, topics[topic]), topic) for topic in own)
        if len(ranked) > 1 and ranked[0][0] == ranked[1][0]:
            both = f"{ranked[0][1]} and {ranked[1][1]}"
            faults.append(f"{name}: both {both} may be its topic; choose one with --map {name}=TOPIC")
        elif ranked:
            chosen[name] = ranked[0][1]
        elif name in wanted.robots:
            all_topics = shortened(listed(sorted(topics)) or "none")
            faults.append(
                f"{name}: no topic of its name; topics are {all_topics}; --map {name}=TOPIC names it"
            )
    return chosen, faults


def _names(topic: str, name: str) -> bool:
    """Whether a topic is of a body: `/robot_1/odom`, `/r1/pose`, `/robots/1` of robot_1."""
    number = name.removeprefix("robot_")
    words = name if number == name else rf"(?:robot|r)[_/]?{number}|robots/{number}"
    return re.search(rf"(?:^|/)(?:{words})(?:/|$)", topic) is not None


def _rank(topic: str, kind: str) -> int:
    """How well a topic of a body says where it is: lower is better."""
    last = kind.replace(".", "/").rpartition("/")[2].lower()
    words = [place for place, word in enumerate(PREFERRED) if word == last or topic.endswith(f"/{word}")]
    return min(words, default=len(PREFERRED))


def reading_of(message: Any, axes: int) -> dict[str, Array]:
    """What a message tells of a body: position, and where it has them velocity and force, each shape (p,).

    The velocity of an Odometry message is turned from the body's frame into the world's.

    Args:
        message: Of ROS, or a table from JSON.
        axes: Number of axes of the mission.

    Raises:
        ValueError: If there is something else where a number is expected.
    """
    found = {}
    for quantity, places in QUANTITIES.items():
        for place in places:
            vector = _vector(message, place, axes)
            if vector is None:
                continue
            turn = _part(message, TURN) if place == BODY_SPEED else None
            found[quantity] = (vector if turn is None else _turned(vector, turn))[:axes]
            break
    return found


def _vector(message: Any, place: str, axes: int) -> Array | None:
    """A vector in a message, with three axes or more; None where there is none."""
    names = ("x", "y", "z", *(f"x{k}" for k in range(4, axes + 1)))
    part = _part(message, place)
    numbers = [] if part is None else [_number(part, axis, place) for axis in names]
    return None if not numbers or None in numbers[:axes] else np.array([number or 0.0 for number in numbers])


def _part(message: Any, place: str) -> Any:
    """What is at a place such as `pose.position` of a message; None for nothing."""
    for key in place.split("."):
        message = message.get(key) if isinstance(message, Mapping) else getattr(message, key, None)
    return message


def _number(part: Any, key: str, place: str) -> float | None:
    """A number in a part of a message, which is at a place; None where there is nothing."""
    value = _part(part, key)
    if value is None:
        return None
    with suppress(OverflowError):
        if isinstance(value, Real) and not isinstance(value, bool):
            return float(value)
    raise ValueError(f"{place}.{key}: found {shown(value)}; expected a number")


def _turned(vector: Array, turn: Any) -> Array:
    """A vector of the body's frame in the world's; a quaternion of zeros turns nothing."""
    w, *axis = (_number(turn, key, TURN) or 0.0 for key in "wxyz")
    length = w * w + sum(x * x for x in axis)
    if length == 0.0:
        return vector
    twice = 2.0 * np.cross(axis, vector[:3])
    return np.asarray(vector[:3] + (w * twice + np.cross(axis, twice)) / length)


def _stamp(message: Any) -> float | None:
    """The time stamp in a message's header [s]; None for none, or for zero."""
    for place in ("header.stamp", "timestamp"):
        stamp = _part(message, place)
        seconds = _number(stamp, "sec", place)
        parts = (_number(stamp, key, place) for key in ("nanosec", "nsec", "nanoseconds"))
        rest = next((each for each in parts if each is not None), 0.0)
        if seconds is not None and (seconds or rest):
            return seconds + NS * rest
    return None


def _track(name: str, topic: str, rows: Iterable[tuple[float, dict[str, Array]]]) -> Track:
    """A body's messages; what some of them lack none has."""
    stamps, readings = zip(*rows, strict=True)
    common = set.intersection(*(set(reading) for reading in readings))
    values = {quantity: np.stack([reading[quantity] for reading in readings]) for quantity in common}
    return Track(name, topic, np.array(stamps), values)


Opened = Iterator[tuple[dict[str, str], Callable[[set[str]], Messages]]]


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Turn whatever readers stumble over into one sentence."""
    try:
        yield
    except UsageError:
        raise
    except Exception as error:
        words = str(error).partition("\n")[0] or type(error).__name__
        raise UsageError(f"{path}: cannot be read: {shortened(words)}") from None


def _missing(path: Path, package: str) -> UsageError:
    return UsageError(f'{path}: reading it needs {package}: pip install "escort-mj[logs]"')


def _is_json(path: Path) -> bool:
    """Whether an MCAP file holds messages in JSON."""
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise _missing(path, "mcap") from None
    with _readable(path), path.open("rb") as file:
        summary = make_reader(file).get_summary()
        channels = summary.channels.values() if summary else ()
        return any(channel.message_encoding == "json" for channel in channels)


@contextmanager
def _json_mcap(path: Path) -> Opened:
    """Topics and messages of an MCAP file with JSON."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        topics = {
            channel.topic: summary.schemas[channel.schema_id].name if channel.schema_id else ""
            for channel in summary.channels.values()
            if channel.message_encoding == "json"
        }

        def messages(wanted: set[str]) -> Messages:
            for _, channel, message in reader.iter_messages(topics=sorted(wanted)) if wanted else ():
                yield channel.topic, NS * message.log_time, json.loads(message.data)

        yield topics, messages


@contextmanager
def _ros_bag(path: Path) -> Opened:
    """Topics and messages of a ROS bag."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise _missing(path, "rosbags") from None
    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        topics = {connection.topic: connection.msgtype for connection in reader.connections}

        def messages(wanted: set[str]) -> Messages:
            connections = [each for each in reader.connections if each.topic in wanted]
            for connection, stamp, data in reader.messages(connections) if connections else ():
                yield connection.topic, NS * stamp, reader.deserialize(data, connection.msgtype)

        yield topics, messages
