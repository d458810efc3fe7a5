"""Messages of robots: which topic is whose, and what is read from each kind of message."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.errors import LogError, UsageError
from escort_mj.judging.log import Wanted
from escort_mj.judging.messages import choose_topics, reading_of
from escort_mj.scenario import parse_scenario
from tests.corpus import assert_said, read

SCENARIO = parse_scenario(
    "name: circling\nduration: 2\nrobots: {positions: [[3, 0], [-3, 0]]}\nmission: {radius: 3}\n"
    "expect: [{metric: radius_error_max, at_most: 1.0e-3}]\n"
)
TIMES = np.arange(0.0, 2.001, 0.05)
START = 1_700_000_000
WANTED = Wanted(("robot_1", "robot_2"), ("x", "y"))


def circle(robot: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and headings of a robot that circles the target once in 10 s."""
    angle = 0.2 * np.pi * TIMES + np.pi * robot
    position = 3.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    velocity = 0.6 * np.pi * np.column_stack([-np.sin(angle), np.cos(angle)])
    return position, velocity, angle + 0.5 * np.pi


ODOMETRY = "nav_msgs/msg/Odometry"


def test_topics_are_found_by_name() -> None:
    pose = "geometry_msgs/msg/PoseStamped"
    topics = {"/robot_1/odom": ODOMETRY, "/robot_1/pose": pose, "/r2/pose": pose, "/target/pose": pose}
    assert choose_topics({**topics, "/robot_12/odom": ODOMETRY}, WANTED) == (
        {"robot_1": "/robot_1/odom", "robot_2": "/r2/pose", "target": "/target/pose"},
        [],
    )
    _, faults = choose_topics({"/robot_1/a": pose, "/robot_1/b": pose}, WANTED)
    assert len(faults) == 2 and "choose one with --map robot_1=TOPIC" in faults[0]
    _, faults = choose_topics(topics, Wanted(("robot_1",), ("x", "y"), names={"robot_1": "/robot_1/odim"}))
    assert 'there is no such topic; did you mean "/robot_1/odom"' in faults[0]


def test_a_velocity_of_odometry_is_turned_into_the_world() -> None:
    message = {
        "pose": {
            "pose": {
                "position": {"x": 1, "y": 2, "z": 0},
                "orientation": {"x": 0, "y": 0, "z": 2**-0.5, "w": 2**-0.5},
            }
        },
        "twist": {"twist": {"linear": {"x": 3, "y": 0, "z": 0}}},
    }
    found = reading_of(message, 2)
    assert found["position"].tolist() == [1, 2] and found["velocity"] == pytest.approx([0, 3])
    assert reading_of({"pose": {"position": {"x": 1, "y": 2}}}, 2)["position"].tolist() == [1, 2]
    assert reading_of({"battery": 3}, 2) == {} and reading_of({"position": [1, 2]}, 2) == {}


def written(path: Path, topics: dict[str, tuple[np.ndarray, list[Any]]], kind: str = "") -> Path:
    """A log of messages as tables, by topic with their times."""
    writing = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer = writing.Writer(file)
        writer.start()
        for topic, (times, messages) in topics.items():
            channel = writer.register_channel(
                topic, "json", writer.register_schema(kind, "jsonschema", b"{}")
            )
            for time, message in zip(times, messages, strict=True):
                writer.add_message(
                    channel, round(1e9 * time), json.dumps(message).encode(), round(1e9 * time)
                )
        writer.finish()
    return path


LONG = {"text": {"position": {"x": 10**400}}, "said": "position.x: found a whole number of more than"}


@pytest.mark.parametrize("case", [*read(Path(__file__).with_name("wrong_messages.yaml")), LONG])
def test_messages_with_something_else_than_numbers(tmp_path: Path, case: dict[str, Any]) -> None:
    right = {"position": {"x": 1, "y": 2}}
    topics = {"/robot_1/pose": right, "/robot_2/pose": right | case["text"]}
    log = written(tmp_path / "log.mcap", {name: (TIMES[2:3], [one]) for name, one in topics.items()})
    with pytest.raises(UsageError) as caught:
        escort_mj.judge(log, SCENARIO)
    assert_said(caught.value, f"{log}: /robot_2/pose at 0.1 s: {case['said']}")


def odometry(store: Any, robot: int, time: float, place: Any, speed: Any, heading: float) -> Any:
    """A message of a robot that looks ahead, in whose frame its speed is."""
    types = store.types
    vector, point = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Point"]
    stamp = types["builtin_interfaces/msg/Time"](START + int(time), round(1e9 * (time % 1.0)))
    number = {"seq": 0} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    turn = types["geometry_msgs/msg/Quaternion"](
        0.0, 0.0, float(np.sin(heading / 2)), float(np.cos(heading / 2))
    )
    forward = vector(float(np.hypot(*speed)), 0.0, 0.0)
    return types[ODOMETRY](
        types["std_msgs/msg/Header"](**number, stamp=stamp, frame_id="world"),
        f"robot_{robot + 1}",
        types["geometry_msgs/msg/PoseWithCovariance"](
            types["geometry_msgs/msg/Pose"](point(*map(float, place), 0.0), turn), np.zeros(36)
        ),
        types["geometry_msgs/msg/TwistWithCovariance"](
            types["geometry_msgs/msg/Twist"](forward, vector(0.0, 0.0, 0.0)), np.zeros(36)
        ),
    )


@pytest.mark.parametrize("form", ["folder", "db3", "mcap", "bag"])
def test_a_ros_bag(compiled: None, tmp_path: Path, form: str) -> None:
    rosbag1, rosbag2 = pytest.importorskip("rosbags.rosbag1"), pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    path = tmp_path / ("log.bag" if form == "bag" else "bag")
    if form == "bag":
        store, writer = typesys.get_typestore(typesys.Stores.ROS1_NOETIC), rosbag1.Writer(path)
    else:
        plugin = rosbag2.StoragePlugin.MCAP if form == "mcap" else rosbag2.StoragePlugin.SQLITE3
        store = typesys.get_typestore(typesys.Stores.LATEST)
        writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    written = store.serialize_ros1 if form == "bag" else store.serialize_cdr
    with writer as bag:
        for robot in range(2):
            channel = bag.add_connection(f"/robot_{robot + 1}/odom", ODOMETRY, typestore=store)
            for time, *state in zip(TIMES, *circle(robot), strict=True):
                message = odometry(store, robot, time, *state)
                bag.write(channel, round(1e9 * (time + 5)), written(message, ODOMETRY))
    if form in ("db3", "mcap"):
        (path,) = path.glob(f"*.{form}")
    judged = escort_mj.judge(path, SCENARIO)
    assert judged.passed and judged.trace.attrs["log_start"] == START
    exact = circle(1)[1]
    assert np.abs(judged.trace["v"].values[::5, 1] - exact[np.arange(0, 41, 2)]).max() < 1e-6
    with pytest.raises(LogError, match="robot_2: both|--map robot_2=/rover: there is no such topic"):
        escort_mj.judge(path, SCENARIO, names={"robot_2": "/rover"})


def test_json_of_others_in_mcap(compiled: None, tmp_path: Path) -> None:
    def poses(robot: int) -> list[Any]:
        places = circle(robot)[0]
        return [{"pose": {"position": dict(zip("xy", place, strict=True))}} for place in places]

    topics = {topic: (TIMES, poses(robot)) for robot, topic in enumerate(("/a", "/b"))}
    log = written(tmp_path / "log.mcap", topics, "foxglove.PoseInFrame")
    assert escort_mj.judge(log, SCENARIO, names={"robot_1": "/a", "robot_2": "/b"}).passed
    with pytest.raises(LogError, match="robot_1: no topic of its name; topics are /a or /b"):
        escort_mj.judge(log, SCENARIO)


def test_an_empty_folder_is_no_log(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is no log; allowed are .csv"):
        escort_mj.judge(tmp_path, SCENARIO)
