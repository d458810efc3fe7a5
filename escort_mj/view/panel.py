"""The viewer's controls in the browser: time, speed, camera, layers, and what is going on."""

from __future__ import annotations

import time
from html import escape
from typing import TYPE_CHECKING

from escort_mj import palette
from escort_mj.expect.verdicts import mark
from escort_mj.record.outcome import Verdict
from escort_mj.report.video.marks import AHEAD, LAYERS
from escort_mj.report.video.replay import Flags, Moment, Replay
from escort_mj.view.stage import GLOW
from escort_mj.view.tape import Tape, failures

if TYPE_CHECKING:
    import viser

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4", "8", "16")
GRIPS = "handles"
FREE, TARGET = "nobody", "target"
PATIENCE = 0.4  # how long the slider is left alone after it was moved [s of wall time]
UPDATES = 0.2  # between two updates of words and slider [s of wall time]


class ControlPanel:
    """Controls, read by the viewer at every tick.

    Attributes:
        playing: Whether time goes on.
        speed: Simulated seconds per second.
        followed: Robot from 0 that the camera goes with, -1 for the target, None for none.
        changed: Whether something was switched since it was last looked at.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        tape: Tape,
        replay: Replay,
        behaviors: list[str],
        speed: float,
        follow: bool,
        shown: dict[str, bool],
    ) -> None:
        """Add the controls.

        Args:
            server: Viser's.
            tape: What is shown.
            replay: The mission's robots and target.
            behaviors: Names of those that can rule a robot.
            speed: Simulated seconds per second at first.
            follow: Whether the camera goes with the target at first.
            shown: Which layers are seen; the controls change it.
        """
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        gui.set_panel_label(tape.title)
        self.playing, self.changed, self._sought = True, True, None
        self._touched = self._said = 0.0
        self.time = gui.add_slider("time [s]", 0.0, tape.end, max(tape.end / 5000, 1e-4), 0.0)
        self.play = gui.add_button("Pause")
        speeds = tuple(sorted({*SPEEDS, f"{speed:g}"}, key=float))
        self.pace = gui.add_dropdown("speed [× real time]", speeds, initial_value=f"{speed:g}")
        robots = [f"robot {k + 1}" for k in range(min(replay.count, palette.MOST_LINES))]
        self.camera = gui.add_dropdown(
            "camera follows",
            (FREE, *[TARGET] * replay.escorts, *robots),
            initial_value=TARGET if follow and replay.escorts else FREE,
        )
        self.status = gui.add_markdown("")
        with gui.add_folder("Show"):
            self.layers = {layer: gui.add_checkbox(name, shown[layer]) for layer, name in LAYERS.items()}
            if tape.movable:
                shown[GRIPS] = False
                self.layers[GRIPS] = gui.add_checkbox("handles to drag target, obstacles", False)
            gui.add_html(_legend(behaviors))
        self.failures = gui.add_folder("Go to a failure", visible=False)
        self.verdicts = gui.add_markdown("")
        self._gui = gui

        @self.play.on_click
        def _(event: object) -> None:
            self.set_playing(not self.playing)

        @self.time.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # not what the viewer itself writes
                self._sought, self._touched = self.time.value, time.monotonic()

        for layer, box in self.layers.items():

            @box.on_update
            def _(event: object, layer: str = layer, box: viser.GuiCheckboxHandle = box) -> None:
                shown[layer], self.changed = bool(box.value), True

        self._shown = shown

    @property
    def grips(self) -> bool:
        """Whether handles are to be seen."""
        return self._shown.get(GRIPS, False)

    @property
    def speed(self) -> float:
        """Simulated seconds per second."""
        return float(self.pace.value)

    @property
    def followed(self) -> int | None:
        """Robot from 0 that the camera goes with, -1 for the target, None for none."""
        name = self.camera.value
        return None if name == FREE else -1 if name == TARGET else int(name.split()[1]) - 1

    def set_playing(self, playing: bool) -> None:
        """Plays or pauses."""
        self.playing = playing
        self.play.label = "Pause" if playing else "Play"

    def seek(self, moment: float) -> None:
        """Asks for a time [s], as moving the slider does."""
        self._sought = moment

    def stop_at(self, moment: float) -> None:
        """Ask for a time [s], and pause there."""
        self.set_playing(False)
        self.seek(moment)

    def take_sought(self) -> float | None:
        """The time that was asked for since this was last called [s]."""
        sought, self._sought = self._sought, None
        return sought

    def tell(
        self, now: float, behind: bool, moment: Moment, replay: Replay, ending: str, at_once: bool
    ) -> None:
        """Write the time, and who avoids or touches something: a few times a second, or at once."""
        clock = time.monotonic()
        if clock - self._said < UPDATES and not at_once:
            return
        self._said = clock
        if clock - self._touched > PATIENCE:
            self.time.value = now  # type: ignore[misc]  # its setter is not declared
        words = [f"**t = {now:.2f} s**"]
        if behind:
            words.append("the simulation cannot keep up with this speed")
        avoiding, touching = replay.lately(moment, GLOW)
        lost = replay.lost[moment.sample]
        for name, flags in (("in contact", touching), ("avoiding", avoiding), ("lost", lost)):
            if who := _named(flags):
                words.append(f"{name}: {who}")
        if ending:
            words.append(ending)
        self.status.content = "<br>".join(words)

    def judge(self, verdicts: list[Verdict]) -> None:
        """Show the verdicts of a run that has ended, with a button that leads to each failure."""
        for one in failures(verdicts):
            with self.failures:
                button = self._gui.add_button(f"{one.time:.2f} s: {one.metric}", hint=one.message)

            @button.on_click
            def _(event: object, moment: float = one.time or 0.0) -> None:
                self.stop_at(moment)

            self.failures.visible = True
        lines = [f"**{mark(one)}** {one.metric} {one.demanded}: {one.found}" for one in verdicts]
        self.verdicts.content = "\n\n".join(lines)


def _legend(behaviors: list[str]) -> str:
    """What the colors of arrows mean."""
    shares = {name: palette.BEHAVIORS.get(name, palette.OBSTACLE) for name in behaviors}
    square = '<span style="color:rgb({},{},{})">&#9632;</span>&nbsp;{}'
    dots = " ".join(
        square.format(*(round(255 * x) for x in color), escape(name)) for name, color in shares.items()
    )
    words = f"Arrows: where v_d leads in {AHEAD:g} s, in the color of the task that rules:"
    return f'<div style="font-size:0.8em;padding:0 0.9em 0.6em">{words} {dots}</div>'


def _named(flags: Flags) -> str:
    """Robots with a raised flag, by number; how many where they are many."""
    numbers = [str(k + 1) for k, raised in enumerate(flags) if raised]
    return f"{len(numbers)} robots" if len(numbers) > 8 else ", ".join(numbers)
