"""`python -m benchmarks.video`: what a frame costs, by what is drawn and how, as in docs/frames.md.

Processor time of the whole process, all threads of a software renderer among them: what others take from the
machine is not counted. Frames of all ways take turns.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from escort_mj.gl import choose_backend

BACKEND, WHY = choose_backend()
os.environ["MUJOCO_GL"] = BACKEND or "disable"

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

from benchmarks.document import measure_page, table  # noqa: E402
from benchmarks.paired import alternate, paired  # noqa: E402
from escort_mj import api  # noqa: E402
from escort_mj.record.folder import RunFolder, read_run  # noqa: E402
from escort_mj.report.video import film  # noqa: E402
from escort_mj.report.video.camera import plan_shot  # noqa: E402
from escort_mj.report.video.encode import VideoFile  # noqa: E402
from escort_mj.report.video.overlay import Overlay  # noqa: E402
from escort_mj.report.video.replay import Replay, replay_of  # noqa: E402
from escort_mj.report.video.scene import draw_marks  # noqa: E402
from escort_mj.report.video.video import scenario_video  # noqa: E402
from escort_mj.scenario.schema.scenario import Video  # noqa: E402

PAGE = "frames.md"
MISSIONS: dict[str, dict[str, Any]] = {
    "main": {},
    "main_3d": {},
    "crowd": {"duration": 8, "expect": []},
}
SIZE = {"width": 1280, "height": 720}
MOMENTS = (0.5, 0.7, 0.9)  # of the run
ROUNDS = 5


class Stage(NamedTuple):
    """What frames of one way are made with."""

    replay: Replay
    video: Video
    model: mujoco.MjModel
    data: mujoco.MjData
    renderer: mujoco.Renderer
    times: list[float]


def shadows(model: mujoco.MjModel) -> None:
    """Shadows of the renderer's own."""
    model.light_castshadow[:] = True


def samples(count: int) -> Callable[[mujoco.MjModel], None]:
    """So many samples a pixel."""
    return lambda model: setattr(model.vis.quality, "offsamples", count)


def detail(slices: int) -> Callable[[mujoco.MjModel], None]:
    """Balls of so many slices, and half as many stacks."""

    def change(model: mujoco.MjModel) -> None:
        model.vis.quality.numslices, model.vis.quality.numstacks = slices, slices // 2

    return change


WAYS: Mapping[str, Callable[[mujoco.MjModel], None]] = {
    "default": lambda model: None,
    "one sample per pixel": samples(0),
    "shadows": shadows,
    "48 slices": detail(48),
    "16 slices": detail(16),
}


def staged(folder: Path, change: Callable[[mujoco.MjModel], None]) -> Stage:
    """A run made ready for frames."""
    run = read_run(folder)
    replay, video = replay_of(run.trace), scenario_video(run).model_copy(update=SIZE)
    model = film.load_model(folder / "model.xml", replay.qpos.shape[1])
    film.prepare(model, video.width, video.height, replay.count)
    change(model)
    renderer = mujoco.Renderer(model, video.height, video.width, film.MOST_MARKS)
    times = [replay.time[0] + share * (replay.end - replay.time[0]) for share in MOMENTS]
    return Stage(replay, video, model, mujoco.MjData(model), renderer, times)


def frame(stage: Stage, marked: bool) -> tuple[float, float]:
    """Processor time of marks and of rendering, all moments [s]."""
    replay, video = stage.replay, stage.video
    aspect = video.width / video.height
    shot = plan_shot(replay, video.camera, stage.model.vis.global_.fovy, aspect, video.speed)
    marks = rendering = 0.0
    for moment in map(replay.at, stage.times):
        film.pose(stage.model, stage.data, moment.qpos, moment.target)
        view = shot.view(moment.time)
        stage.model.stat.extent = view.distance
        stage.renderer.update_scene(stage.data, film.free_camera(view), film.in_space())
        start = time.process_time()
        if marked:
            flags = replay.avoiding[0], replay.touching[0]
            scene, trail = stage.renderer.scene, film.TRAIL * video.speed
            draw_marks(scene, replay, moment, trail, flags, video.width)
        middle = time.process_time()
        stage.renderer.render()
        marks, rendering = marks + middle - start, rendering + time.process_time() - middle
    return marks, rendering


def measure(folder: Path, name: str) -> tuple[list[str], list[str]]:
    """One run: what marks, words and encoding add to the renderer's own work; and other ways to render."""
    stage = staged(folder, WAYS["default"])
    video, replay = stage.video, stage.replay
    nobody = np.zeros(replay.count, dtype=bool)
    picture = np.full((video.height, video.width, 3), 200, dtype=np.uint8)
    overlay = Overlay(name, video.speed, replay.count, (video.width, video.height))
    found: dict[str, float] = {}

    def words() -> float:
        start = time.process_time()
        overlay.write(picture, 1.0, nobody, nobody, nobody)
        return len(MOMENTS) * (time.process_time() - start)

    def whole() -> float:
        marks, rendering = frame(stage, True)
        found["python"] = marks
        return marks + rendering

    def bare() -> float:
        return frame(stage, False)[1]

    with VideoFile(folder / "frames.mp4", (video.width, video.height), video.rate) as file:

        def encoded() -> float:
            start = time.process_time()
            file.add(picture)
            return len(MOMENTS) * (time.process_time() - start)

        whole(), bare(), words(), encoded()
        times = alternate({"bare": bare, "whole": whole, "words": words, "encoded": encoded}, ROUNDS)
    each = {key: 1e3 * float(np.median(values)) / len(MOMENTS) for key, values in times.items()}
    drawing = {"bare": times["bare"], "drawing": times["whole"] - times["bare"] + times["words"]}
    ratio = paired(drawing, "drawing", "bare")
    parts = [
        name,
        f"{each['bare']:.0f}",
        f"{1e3 * found['python'] / len(MOMENTS):.1f}",
        f"{each['whole'] - each['bare']:.0f}",
        f"{each['words']:.1f}",
        f"{each['encoded']:.1f}",
        f"**{ratio:.2f}**",
    ]
    stage.renderer.close()
    return parts, [name, *otherwise(folder)]


def otherwise(folder: Path) -> list[str]:
    """Costs of a frame with marks, by the way it is rendered [ms]."""
    stages = {way: staged(folder, change) for way, change in WAYS.items()}
    turns = {way: lambda stage=stage: sum(frame(stage, True)) for way, stage in stages.items()}
    for turn in turns.values():
        turn()
    times = alternate(turns, ROUNDS)
    for stage in stages.values():
        stage.renderer.close()
    return [f"{1e3 * float(np.median(times[way])) / len(MOMENTS):.0f}" for way in WAYS]


def tables() -> dict[str, str]:
    """Measures every mission."""
    if BACKEND is None:
        raise SystemExit(f"nothing can be drawn on this machine: {WHY}")
    parts, ways = [], []
    with tempfile.TemporaryDirectory() as place:
        for name, changes in MISSIONS.items():
            folder = RunFolder.create(Path(place) / name)
            with folder:
                api.fly(api.load_scenario(name, changes), folder)
            part, way = measure(folder.path, name)
            print(part, way, flush=True)
            parts.append(part)
            ways.append(way)
    heads = ["", "rendering [ms]", "marks, Python [ms]", "marks, total [ms]", "text [ms]"]
    heads += ["to the encoder [ms]", "ratio"]
    return {"frame": table(heads, parts), "ways": table(["frame [ms]", *WAYS], ways)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
