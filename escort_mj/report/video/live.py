"""Pictures of a mission under way, drawn by a child process: only there may MuJoCo be loaded with GL.

The child is this same module. It unpickles messages from its input: a table of what a mission looks like,
then for each picture an array of the samples since the last one. It writes the picture, one byte per color,
to its output.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import EscortError, RenderError
from escort_mj.record.recording import record
from escort_mj.report.video.video import drawing_environment
from escort_mj.signals import TIME, record_size

if TYPE_CHECKING:
    from escort_mj.report.video.camera import View, Viewpoint
    from escort_mj.scenario.schema.scenario import Video

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

CAMERAS = {"overview": "overview", "follow": "target_follow", "top": "top"}  # of the scenario, of the model
TRAIL = 8.0  # how long trails are; older samples are not needed [s]


class Subject(NamedTuple):
    """What a mission looks like.

    Attributes:
        xml: The model, as text.
        sizes: Size of each dimension of a sample.
        labels: See `record`.
        video: The scenario's, whose camera it is seen through.
        assets: Files that the model names.
    """

    xml: str
    sizes: dict[str, int]
    labels: dict[str, Any]
    video: Video
    assets: Mapping[str, bytes] = {}


class Painter:
    """Draws missions of any kind, one after another, in a child process that starts with the first picture.

    Attributes:
        size: Width and height [pixel].
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self._child: subprocess.Popen[bytes] | None = None
        self._errors: IO[bytes] | None = None

    def show(self, subject: Subject) -> None:
        """Turn to another mission.

        Raises:
            RenderError: If nothing can be drawn on this machine, or the child has failed.
        """
        self._send(subject._asdict())

    def draw(self, samples: Array) -> Picture:
        """Return a picture of the newest sample, shape (height, width, 3).

        Args:
            samples: Those taken since the last picture of the mission, shape (k, record_size).

        Raises:
            RenderError: If the child has failed.
        """
        self._send(samples)
        assert self._child is not None and self._child.stdout is not None
        width, height = self.size
        drawn = self._child.stdout.read(3 * width * height)
        if len(drawn) < 3 * width * height:
            raise RenderError(self._reason())
        return np.frombuffer(drawn, dtype=np.uint8).reshape(height, width, 3).copy()

    def close(self) -> None:
        """End the child."""
        child, self._child = self._child, None
        if child is not None:
            assert child.stdin is not None and child.stdout is not None
            with contextlib.suppress(OSError):
                child.stdin.close()
            child.stdout.close()
            child.wait()
        if self._errors is not None:
            self._errors.close()
            self._errors = None

    def _send(self, message: Any) -> None:
        if self._child is None:
            self._start()
        assert self._child is not None and self._child.stdin is not None
        try:
            pickle.dump(message, self._child.stdin)
            self._child.stdin.flush()
        except OSError:
            raise RenderError(self._reason()) from None

    def _start(self) -> None:
        environment = drawing_environment()
        command = [sys.executable, "-P", "-m", "escort_mj.report.video.live", *map(str, self.size)]
        self._errors = tempfile.TemporaryFile()
        self._child = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env=environment,
            start_new_session=True,  # an interrupt of the terminal is the parent's
        )

    def _reason(self) -> str:
        """Say why the child has failed."""
        assert self._child is not None and self._errors is not None
        self._child.kill()
        code = self._child.wait()
        self._errors.seek(0)
        said = self._errors.read().decode(errors="replace").splitlines()
        self.close()
        return f"the renderer failed with exit code {code}" + (f": {said[-1]}" if said else "")


class _MissionPicture:
    """The child's picture of one mission."""

    def __init__(self, subject: Subject, size: tuple[int, int]) -> None:
        import mujoco

        from escort_mj.report.video.film import MOST_MARKS, prepare

        self._subject = subject
        self._width, height = size
        self._model = mujoco.MjModel.from_xml_string(subject.xml, dict(subject.assets))
        prepare(self._model, *size, subject.sizes["robot"])
        self._data = mujoco.MjData(self._model)
        self._extent = float(self._model.stat.extent)
        self._renderer = mujoco.Renderer(self._model, height, self._width, MOST_MARKS)
        self._samples: Array = np.zeros((0, record_size(subject.sizes)))

    def draw(self, samples: Array) -> Picture:
        """Return a picture of the newest sample."""
        import mujoco

        from escort_mj.report.video.camera import Viewpoint, plan_shot
        from escort_mj.report.video.film import GLOW, free_camera, in_space
        from escort_mj.report.video.replay import replay_of
        from escort_mj.report.video.scene import draw_marks
        from escort_mj.report.video.solids import pose

        known = np.concatenate([self._samples, samples])
        self._samples = known[known[:, TIME] >= known[-1:, TIME] - TRAIL]
        replay = replay_of(record(self._samples, self._subject.sizes, self._subject.labels))
        moment = replay.at(replay.end)
        pose(self._model, self._data, moment.qpos, moment.target)
        mujoco.mj_camlight(self._model, self._data)
        stand, name = Viewpoint.of(self._subject.video), self._subject.video.camera
        camera: Any = CAMERAS.get(name)
        if camera is None:
            shot = plan_shot(replay, name, self._model.vis.global_.fovy, 1.0, 1.0, stand)
            camera = free_camera(shot.view(replay.end))
        elif stand != Viewpoint(robot=stand.robot):
            camera = free_camera(self._view(camera, stand, moment.robots.mean(axis=0)))
        self._model.stat.extent = getattr(camera, "distance", self._extent)
        self._renderer.update_scene(self._data, camera, in_space())
        halos = replay.lately(moment, GLOW)
        draw_marks(self._renderer.scene, replay, moment, TRAIL, halos, self._width)
        return np.asarray(self._renderer.render())

    def _view(self, camera: str, stand: Viewpoint, robots: Array) -> View:
        """One of the model's cameras, which looks past the middle of the robots, as the user has it stand."""
        from escort_mj.report.video.camera import View

        seen = self._data.camera(camera)
        _, up, back = seen.xmat.reshape(3, 3).T
        distance = float((seen.xpos - robots) @ back)
        ahead = up if back[2] > 0.999 else -back  # looking down, what is at the top of the picture
        azimuth, elevation = np.degrees((np.arctan2(ahead[1], ahead[0]), np.arcsin(-back[2])))
        return stand.chosen(View(seen.xpos - distance * back, distance, float(azimuth), float(elevation)))

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()


def serve_pictures(arguments: list[str] | None = None) -> int:
    """Draw what the input says until it ends. MUJOCO_GL must name a back end that works.

    Returns:
        The exit code.
    """
    parser = argparse.ArgumentParser(
        prog="python -m escort_mj.report.video.live", description=serve_pictures.__doc__
    )
    parser.add_argument("size", type=int, nargs=2, help="width and height")
    width, height = parser.parse_args(arguments).size
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no picture
    shown: _MissionPicture | None = None
    try:
        while True:
            message = pickle.load(sys.stdin.buffer)
            if isinstance(message, dict):
                if shown is not None:
                    shown.close()
                shown = _MissionPicture(Subject(**message), (width, height))
            elif shown is not None:
                output.write(shown.draw(message).tobytes())
                output.flush()
    except EOFError:
        return 0
    except (EscortError, ValueError) as fault:
        print(f"{fault}".replace("\n", " "), file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(serve_pictures())
