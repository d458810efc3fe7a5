"""Runs for other programs, read back by the formats' own libraries."""

import json
from pathlib import Path

import jsonschema
import mujoco
import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.errors import UsageError, WriteError
from escort_mj.mission import fly
from escort_mj.record.folder import RunFolder, StoredRun, read_run
from escort_mj.report.exports.foxglove import write_mcap
from escort_mj.report.exports.states import write_states
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario import Scenario, parse_scenario

COLLISION = load_scenario(
    "faults/collision",
    [
        "obstacles=[{position: [6, 0], shape: box, size: [0.4, 0.5, 0.6]}]",
        'target={position: ["0.2*t", 50]}',
    ],
)
FOUR_AXES = parse_scenario("name: four\naxes: 4\nduration: 0.2\nrobots: {count: 5}\n")


@pytest.fixture(scope="module")
def run(compiled, tmp_path_factory) -> StoredRun:
    with RunFolder.create(tmp_path_factory.mktemp("run") / "told") as folder:
        fly(COLLISION, folder)
    return read_run(folder.path)


@pytest.fixture(scope="module")
def told(run, tmp_path_factory) -> list[tuple]:
    """Every message of an MCAP file: topic, schema's name, time [s], content."""
    reading = pytest.importorskip("mcap.reader")
    path = tmp_path_factory.mktemp("mcap") / "told.mcap"
    write_mcap(run, path)
    found = []
    with path.open("rb") as file:
        reader = reading.make_reader(file)
        names = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        assert names["scenario.yaml"].decode() == (run.path / "scenario.yaml").read_text()
        assert {one.name for one in reader.iter_metadata()} == {"escort_mj"}
        for schema, channel, message in reader.iter_messages():
            assert channel.message_encoding == "json" and schema.encoding == "jsonschema"
            content = json.loads(message.data)
            jsonschema.validate(content, json.loads(schema.data))
            found.append((channel.topic, schema.name, message.log_time / 1e9, content))
    return found


def test_mcap_moves_frames_as_bodies_moved(run, told) -> None:
    replay = replay_of(run.trace)
    scenes = [content for topic, name, _, content in told if name == "foxglove.SceneUpdate"]
    assert len(scenes) == 1
    entities = {entity["id"]: entity for entity in scenes[0]["entities"]}
    assert {"robot_1_body", "robot_2_body", "target_body", "obstacle_1_body"} < set(entities)
    assert entities["robot_1_body"]["frame_id"] == "robot_1_body" and entities["robot_1_body"]["frame_locked"]
    assert entities["robot_1_body"]["spheres"][0]["size"]["x"] == pytest.approx(2 * replay.robot_radius[0])
    (box,) = entities["obstacle_1_body"]["cubes"]
    assert entities["obstacle_1_body"]["frame_id"] == "world" and box["pose"]["position"]["x"] == 6.0
    moved = [(time, content) for _, name, time, content in told if name == "foxglove.FrameTransforms"]
    assert len(moved) == 61
    for time, content in moved:
        moment = replay.at(time)
        frames = {one["child_frame_id"]: one for one in content["transforms"]}
        assert set(frames) == {"robot_1_body", "robot_2_body", "target_body"}
        for name, place in (("robot_1_body", moment.robots[0]), ("target_body", moment.target)):
            assert list(frames[name]["translation"].values()) == pytest.approx(place, abs=2e-6)
            assert frames[name]["rotation"]["w"] == 1.0


def test_mcap_says_what_robots_did(run, told) -> None:
    second = [(time, content) for topic, _, time, content in told if topic == "/robots/2"]
    assert len(second) == run.trace.sizes["time"]
    time, content = second[17]
    assert time == pytest.approx(float(run.trace["time"][17]))
    assert list(content["velocity"].values()) == pytest.approx(run.trace["v"].values[17, 1])
    times = [time for _, _, time, _ in told]
    assert times == sorted(times)


def test_mcap_logs_contacts_and_verdicts(run, told) -> None:
    lines = [(time, content) for _, name, time, content in told if name == "foxglove.Log"]
    words = [content["message"] for _, content in lines]
    (touch,) = (k for k, said in enumerate(words) if said.startswith("robot_1 and robot_2 touch"))
    assert lines[touch][0] == pytest.approx(float(run.trace["episode_start"][0]), abs=1e-6)
    assert any(said.startswith("xfail: contacts") for said in words)


@pytest.mark.parametrize("scenario", [COLLISION, FOUR_AXES], ids=["collision", "four axes"])
def test_states_are_played_by_mujoco(scenario: Scenario, tmp_path: Path) -> None:
    with RunFolder.create(tmp_path / "run") as folder:
        fly(scenario, folder)
    run = read_run(folder.path)
    write_states(run, tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as found:  # refuses pickles
        model = mujoco.MjModel.from_xml_string(str(found["model"]))
        data, replay = mujoco.MjData(model), replay_of(run.trace)
        assert found["qpos"].shape == (len(replay.time), model.nq)
        np.testing.assert_array_equal(found["time"], replay.time)
        for row in range(0, len(replay.time), 3):
            data.qpos, data.qvel = found["qpos"][row], found["qvel"][row]
            data.mocap_pos, data.mocap_quat = found["mocap_pos"][row], found["mocap_quat"][row]
            mujoco.mj_kinematics(model, data)
            np.testing.assert_allclose(data.body("target").xpos, replay.target[row], atol=1e-12)
            np.testing.assert_allclose(data.body("robot_1").xpos, replay.robots[row, 0], atol=1e-9)
        if run.trace.sizes["axis"] == 2:  # two slides a robot: velocities are the robots'
            speeds = found["qvel"].reshape(len(replay.time), -1, 2)
            np.testing.assert_allclose(speeds[1:40], run.trace["v"].values[1:40], atol=1e-6)


def test_where_nothing_can_be_written(run, tmp_path: Path, monkeypatch) -> None:
    for write, name in ((write_mcap, "a.mcap"), (write_states, "a.npz")):
        with pytest.raises(WriteError, match="cannot be written: No such file or directory"):
            write(run, tmp_path / "nowhere" / name)
    monkeypatch.setitem(__import__("sys").modules, "mcap.writer", None)
    with pytest.raises(UsageError, match=r'pip install "escort-mj\[mcap\]"'):
        write_mcap(run, tmp_path / "a.mcap")
