"""Runs for other programs, read back by the formats' own libraries."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.errors import WriteError
from escort_mj.mission import fly
from escort_mj.record.folder import RunFolder, read_run
from escort_mj.report.exports import write_states
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario import Scenario, parse_scenario

COLLISION = load_scenario(
    "faults/collision",
    [
        "obstacles=[{position: [6, 0], shape: box, size: [0.4, 0.5, 0.6]}]",
        'target={position: ["0.2*t", 50]}',
    ],
)
FOUR_AXES = parse_scenario(
    "name: four\naxes: 4\nduration: 0.2\nrobots: {count: 5}\ntarget: {position: [0, 0, 0, t]}\n"
)


@pytest.mark.parametrize("scenario", [COLLISION, FOUR_AXES], ids=["collision", "four axes"])
def test_states_are_played_by_mujoco(compiled: None, scenario: Scenario, tmp_path: Path) -> None:
    with RunFolder.create(tmp_path / "run") as folder:
        fly(scenario, folder)
    run = read_run(folder.path)
    with pytest.raises(WriteError, match="cannot be written: No such file or directory"):
        write_states(run, tmp_path / "nowhere" / "run.npz")
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
            if run.trace.sizes["axis"] == 4:  # the fourth axis is the height on a stage of its own
                height = (
                    run.trace["target_position"].values[row, 3] - run.trace["target_position"].values[0, 3]
                )
                shadow = data.body("target_shadow_1").xpos - model.body("target_shadow_1").pos
                np.testing.assert_allclose(shadow, [0.0, 0.0, height], atol=1e-12)
        if run.trace.sizes["axis"] == 2:  # two slides a robot: velocities are the robots'
            speeds = found["qvel"].reshape(len(replay.time), -1, 2)
            np.testing.assert_allclose(speeds[1:40], run.trace["v"].values[1:40], atol=1e-6)
