"""A run in MuJoCo's own viewer, where there is a display."""

from __future__ import annotations

import os
import sys
import threading
import time
from threading import Event

import mujoco
import numpy as np

from escort_mj.errors import UsageError
from escort_mj.report.video.scene import Scenery
from escort_mj.report.video.shots import plan_shot
from escort_mj.report.video.solids import pose
from escort_mj.view.tape import Tape
from escort_mj.view.viewer import BUDGET, MOST_SAMPLES, RATE, TRAIL

KEYS = "space pauses, the arrow keys step, + and - change the speed, R begins again, Esc ends"
SPACE, PLUS, MINUS, EQUAL, AGAIN, RIGHT, LEFT = 32, 334, 333, 61, 82, 262, 263
DASH = 45
CLOSING = 5.0  # how long a window may take to close [s]
STEP = 0.5  # what an arrow key goes, in seconds at the pace of now


def check_display() -> None:
    """Refuses where MuJoCo's viewer cannot open a window.

    Raises:
        UsageError: If there is no display.
    """
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise UsageError(
            "--native needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set; "
            "without --native the viewer works in a browser, over ssh too"
        )


class Native:
    """Shows a tape in MuJoCo's own viewer.

    Attributes:
        now: Time that is shown [s].
        playing: Whether time goes on.
        speed: Simulated seconds per second.
    """

    def __init__(self, tape: Tape, speed: float, start: float | None = None) -> None:
        """Get ready.

        Args:
            tape: What to show.
            speed: Simulated seconds per second at first.
            start: Time at which it opens, paused [s]; None to play from the beginning.
        """
        self.tape, self.speed, self.now, self.playing = tape, speed, start or 0.0, start is None
        self._data = mujoco.MjData(tape.model)
        tape.model.light_castshadow[:] = False  # the scenery has its own

    def key(self, code: int) -> None:
        """What a key does."""
        if code == SPACE:
            self.playing = not self.playing
        elif code in (RIGHT, LEFT):
            self.now += (STEP if code == RIGHT else -STEP) * self.speed
        elif code in (PLUS, EQUAL, MINUS, DASH):
            self.speed *= 2.0 if code in (PLUS, EQUAL) else 0.5
        elif code == AGAIN:
            self.now = 0.0

    def run(self, ended: Event) -> None:
        """Open the window, and continue until it is closed.

        Args:
            ended: Closes it, too.

        Raises:
            UsageError: If the window cannot be opened.
        """
        check_display()
        import mujoco.viewer

        replay = self.tape.around(self.tape.reached, self.tape.reached, MOST_SAMPLES)[1]
        view = plan_shot(replay, "overview", 45.0, 16 / 9, 2.0).view(0.0)
        others = set(threading.enumerate())
        try:
            window = mujoco.viewer.launch_passive(
                self.tape.model, self._data, key_callback=self.key, show_left_ui=False, show_right_ui=False
            )
        except Exception as fault:  # glfw's own errors and RuntimeError, by version
            raise UsageError(
                f"--native: MuJoCo's viewer does not open: {fault}; without --native a browser shows the run"
            ) from None
        scene = window.user_scn
        assert scene is not None, "a viewer that is open has one"
        with window:
            with window.lock():
                window.cam.lookat[:], window.cam.distance = view.look_at, view.distance
                window.cam.azimuth, window.cam.elevation = view.azimuth, view.elevation
            scenery = Scenery(replay, TRAIL / 8.0, 1280)
            before = time.perf_counter()
            while window.is_running() and not ended.is_set():
                now = time.perf_counter()
                with window.lock():
                    self.draw(now - before, scenery, scene)
                window.sync()
                before = now
                time.sleep(max(0.0, now + 1 / RATE - time.perf_counter()))
        for thread in set(threading.enumerate()) - others:
            thread.join(CLOSING)  # a process that ends before its window breaks

    def draw(self, passed: float, scenery: Scenery, scene: mujoco.MjvScene) -> None:
        """Put the bodies where they are next, and the marks beside them.

        Args:
            passed: Wall time since the last picture [s].
            scenery: Draws the marks.
            scene: Takes them.
        """
        wanted = float(np.clip(self.now + self.playing * self.speed * passed, 0.0, self.tape.end))
        self.tape.advance(wanted, BUDGET)
        self.now = min(wanted, self.tape.reached)
        _, replay = self.tape.around(self.now, TRAIL, MOST_SAMPLES)
        moment = replay.at(self.now)
        pose(self.tape.model, self._data, moment.qpos, {"": moment.target})
        mujoco.mj_camlight(self.tape.model, self._data)
        self._data.time = self.now
        scene.ngeom = 0
        scenery.replay = replay
        scenery.draw(scene, moment, replay.avoiding[moment.sample], replay.touching[moment.sample])
