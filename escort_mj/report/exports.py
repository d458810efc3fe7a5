"""A run for other programs, as the suffix of the file says: a table, MuJoCo's states, its world as MJCF."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.files import check_place, read_text, replaced, write_model
from escort_mj.record.export import CSV, PARQUET, write_table
from escort_mj.record.folder import MODEL, StoredRun
from escort_mj.record.stored import ASSETS
from escort_mj.report.video.replay import replay_of
from escort_mj.report.video.solids import load_model, pose
from escort_mj.world.stages import DIRECTIONS, IN_SPACE, SHADOW

MJCF, STATES = ".xml", ".npz"
SUFFIXES = (MJCF, CSV, PARQUET, STATES)


def check_export(path: Path) -> None:
    """Refuse a file that cannot be an export.

    Raises:
        UsageError: If its suffix is none of those allowed, or there is no such folder.
    """
    check_place(path, SUFFIXES)


def export_run(run: StoredRun, path: Path) -> None:
    """Write a run as a table, as MuJoCo's states, or its world as MJCF.

    Args:
        run: What a run folder holds.
        path: The file.

    Raises:
        UsageError: If the suffix is none of those allowed, or what it needs is not installed.
        RunFolderError: If the model is damaged or does not fit.
        WriteError: If the file cannot be written.
    """
    check_export(path)
    if path.suffix == STATES:
        write_states(run, path)
    elif path.suffix == MJCF:
        load_model(run.path / MODEL, run.recording.sizes["coordinate"])  # or it would be of no use
        files = [file for file in (run.path / ASSETS).glob("*") if file.is_file()]
        assets = {f"{ASSETS}/{file.name}": file.read_bytes() for file in files}
        write_model(path, read_text(run.path / MODEL), assets)
    else:
        write_table(run.trace, path)


def write_states(run: StoredRun, path: Path) -> None:
    """Write the states of a run, one row per sample, as arrays of a NumPy archive without pickles.

    `time` (T,) [s]; `qpos` (T, nq) and `qvel` (T, nv), by differences of qpos from sample to sample;
    `mocap_pos` (T, nmocap, 3) [m] and `mocap_quat` (T, nmocap, 4, wxyz), which move the target; `model`, the
    text of the world as MJCF.

    Args:
        run: A run folder with at least one sample.
        path: A `.npz` file.

    Raises:
        RunFolderError: If the model is damaged or does not fit.
        RenderError: If there is no sample.
        WriteError: If the file cannot be written; an earlier one stays as it was.
    """
    replay = replay_of(run.trace)
    model = load_model(run.path / MODEL, replay.qpos.shape[1])
    data = mujoco.MjData(model)
    shadows = _target_shadows(model, run.trace["target_position"].values)
    count = len(replay.time)
    qpos, qvel = np.empty((count, model.nq)), np.zeros((count, model.nv))
    mocap_pos, mocap_quat = np.empty((count, model.nmocap, 3)), np.empty((count, model.nmocap, 4))
    for row in range(count):
        pose(model, data, replay.qpos[row], replay.target[row])
        for mocap, way in shadows.items():
            data.mocap_pos[mocap] = way[row]
        qpos[row], mocap_pos[row], mocap_quat[row] = data.qpos, data.mocap_pos, data.mocap_quat
        if row:
            mujoco.mj_differentiatePos(
                model, qvel[row], replay.time[row] - replay.time[row - 1], qpos[row - 1], qpos[row]
            )
    if count > 1:
        qvel[0] = qvel[1]
    text = read_text(run.path / MODEL)
    arrays = {"qpos": qpos, "qvel": qvel, "mocap_pos": mocap_pos, "mocap_quat": mocap_quat}
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, model=np.array(text), time=replay.time, **arrays)


def _target_shadows(model: mujoco.MjModel, target: NDArray[np.float64]) -> dict[int, NDArray[np.float64]]:
    """Where the target's bodies of axes beyond the third were, shape (T, 3) [m], by what moves them.

    Args:
        model: The world.
        target: Positions in all axes, shape (T, p) [m].
    """
    ways = {}
    for number, first in enumerate(range(IN_SPACE, target.shape[1], IN_SPACE), 1):
        body = model.body(f"target{SHADOW}{number}")
        moved = (target - target[0])[:, first : first + IN_SPACE]
        way = np.tile(body.pos, (len(target), 1))
        way[:, ["xyz".index(direction) for direction in DIRECTIONS[moved.shape[1]]]] += moved
        ways[int(body.mocapid[0])] = way
    return ways
