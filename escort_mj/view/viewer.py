"""The browser viewer: a clock that goes at the pace asked for, and a server that shows its moment."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import logging
import socket
import time
from collections.abc import Iterator
from threading import Event
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import UsageError
from escort_mj.report.video.camera import Viewpoint, plan_shot, view_axes
from escort_mj.view.gate import LOCAL, guarded
from escort_mj.view.grips import Grips
from escort_mj.view.panel import ControlPanel
from escort_mj.view.stage import StageView
from escort_mj.view.tape import Tape

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

RATE = 30.0  # pictures per second of wall time
BUDGET = 0.7 / RATE  # wall time for simulating between two pictures [s]
SKIP = 0.25  # wall time for simulating at once toward a time that was asked for [s]
TRAIL, MOST_SAMPLES = 8.0, 500  # how long trails are [s], and how many samples are looked at for them
PORTS = 20  # tried from the one asked for
LAST_PORT = 65535


class Viewer:
    """Shows a tape in browsers. A context manager.

    Attributes:
        panel: The controls.
        now: Time that is shown [s].
        url: Where browsers find it.
        public: Whether other machines may find it, too.
    """

    def __init__(self, tape: Tape, host: str = LOCAL[0], port: int = 8080, speed: float = 1.0) -> None:
        """Start the server.

        Args:
            tape: What to show.
            host: Where to listen; this machine only, unless told otherwise.
            port: The first port to try; 0 for any that is free.
            speed: Simulated seconds per second at first.

        Raises:
            UsageError: If viser is not installed, or nothing can be listened to.
        """
        require_viser()
        import viser

        logging.getLogger("websockets").setLevel(logging.CRITICAL)  # browsers that go away are no news
        self.tape, self.now, self.public = tape, 0.0, host not in LOCAL
        port = _free_port(host, port)
        with _silent(), guarded(host):
            self._server: viser.ViserServer = viser.ViserServer(host=host, port=port, verbose=False)
        self._server.request_share_url = lambda verbose=True: None  # type: ignore[method-assign]  # nobody outside
        shown = host if host not in ("0.0.0.0", "::") else socket.gethostname()
        self.url = f"http://{f'[{shown}]' if ':' in shown else shown}:{port}"
        part, replay = tape.around(0.0, TRAIL, MOST_SAMPLES)
        whole = tape.around(tape.reached, tape.reached, MOST_SAMPLES)[1]
        shot = plan_shot(whole, "overview", 45.0, 16 / 9, 2.0)
        still = plan_shot(whole, "overview", 45.0, 16 / 9, 2.0, Viewpoint(azimuth=float(shot.azimuth[0])))
        out_of_sight = tape.reached < tape.end or np.ptp(still.look_at, axis=0).max() > 0.1 * whole.radius
        self._stage = StageView(self._server, tape.model, replay)
        self._grips = Grips(self._server, tape.movable, replay.planar, replay.radius)
        self._obstacles = [str(name) for name in part["obstacle"].values]
        self.panel = ControlPanel(
            self._server,
            tape,
            replay,
            [str(name) for name in part["behavior"].values],
            speed,
            out_of_sight,
            self._stage.shown,
        )
        self._followed: tuple[int, Array] | None = None
        self._judged = False
        view = shot.view(0.0)
        camera = self._server.initial_camera
        camera.look_at = view.look_at
        camera.position = view.look_at - 1.2 * view.distance * view_axes(view.azimuth, view.elevation)[2]
        camera.fov = np.radians(45.0)
        self.tick(0.0)
        self._show_verdicts()

    def stop_at(self, moment: float) -> None:
        """Show a moment of the run, and pause there.

        Args:
            moment: [s].
        """
        self.panel.stop_at(moment)
        self.tick(0.0)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *error: object) -> None:
        with _silent():
            self._server.stop()

    @property
    def watched(self) -> bool:
        """Whether any browser is connected."""
        return bool(self._server.get_clients())

    def run(self, ended: Event) -> None:
        """Goes on until it is ended; time goes on while a browser is there."""
        before = time.perf_counter()
        while not ended.is_set():
            now = time.perf_counter()
            self.tick(min(now - before, 0.25) if self.watched else 0.0)
            before = now
            time.sleep(max(0.0, now + 1 / RATE - time.perf_counter()))

    def tick(self, passed: float) -> None:
        """Show the next moment.

        Args:
            passed: Wall time since the last tick [s].
        """
        panel, tape = self.panel, self.tape
        sought = panel.take_sought()
        dragged = self._grips.take()
        for name, place in dragged.items():
            tape.move(name, place)
        if sought is None and not (panel.playing and passed) and not panel.changed and not dragged:
            return
        wanted = self.now + panel.speed * passed if panel.playing else self.now
        wanted = min(wanted if sought is None else sought, tape.end)
        tape.advance(wanted, BUDGET if sought is None else SKIP)
        behind = not tape.ending and tape.reached < wanted - 0.5 * panel.speed / RATE
        if sought is not None and tape.reached < wanted and not tape.ending:
            panel.seek(wanted)  # as far as it went; the next tick goes on
        self.now = min(wanted, tape.reached)
        over = bool(tape.ending) and self.now > tape.reached - 1e-6
        if panel.playing and over:
            panel.set_playing(False)
        part, replay = tape.around(self.now, TRAIL, MOST_SAMPLES)
        with self._server.atomic():
            if panel.changed:
                panel.changed = False
                self._grips.show(panel.grips)
            moment = self._stage.draw(replay, self.now)
            self._grips.follow(
                {"target": moment.target} | dict(zip(self._obstacles, moment.obstacles, strict=True))
            )
            self._move_cameras(moment.target, moment.robots)
        last = not panel.playing or sought is not None  # what is written now may stand for long
        panel.tell(self.now, behind, moment, replay, tape.ending if over else "", at_once=last)
        self._show_verdicts()

    def _show_verdicts(self) -> None:
        """Show the verdicts once there are some."""
        if self.tape.verdicts and not self._judged:
            self._judged = True
            self.panel.judge(self.tape.verdicts)

    def _move_cameras(self, target: Array, robots: Array) -> None:
        """Every browser's camera goes as far as what it follows has gone."""
        followed = self.panel.followed
        if followed is None:
            self._followed = None
            return
        here = target if followed < 0 else robots[followed]
        same = self._followed is not None and self._followed[0] == followed
        before = self._followed[1] if same and self._followed is not None else None
        for client in self._server.get_clients().values():
            step = here - (client.camera.look_at if before is None else before)
            if np.abs(step).max() > 1e-9:
                client.camera.position = client.camera.position + step  # what it looks at goes along
        self._followed = followed, here.copy()


def require_viser() -> None:
    """Refuses where viser is not installed.

    Raises:
        UsageError: If it is not.
    """
    if importlib.util.find_spec("viser") is None:
        raise UsageError('the viewer needs viser: pip install "escort-mj[view]"')


def _free_port(host: str, port: int) -> int:
    """The first free port, from the one asked for on.

    Raises:
        UsageError: If there is none, or no such host.
    """
    if not 0 <= port <= LAST_PORT:
        raise UsageError(f"--port: found {port}; allowed is 0 to {LAST_PORT}")
    for tried in range(port, min(port + (PORTS if port else 1), LAST_PORT + 1)):
        try:
            with socket.create_server((host, tried), family=_family(host)) as listening:
                return int(listening.getsockname()[1])
        except OSError as fault:
            reason = fault.strerror or str(fault)
    raise UsageError(f"--host {host} --port {port}: cannot listen there: {reason}")


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Keep viser's own messages off the terminal."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
