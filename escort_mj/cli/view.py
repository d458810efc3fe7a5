"""The command that shows a run, live or recorded."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from threading import Event

import typer

from escort_mj.cli.app import command, say
from escort_mj.cli.options import NotNegative, Overrides, Source, Texts
from escort_mj.errors import UsageError


@command("view", json=False)
def view_command(
    source: Source,
    overrides: Overrides = (),
    plugins: Texts = (),
    speed: float = 1.0,
    at: NotNegative | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
) -> None:
    """Show a run in the browser: replay a run folder, or simulate a scenario live. Stop with Ctrl-C.

    The replay of a run in which verdicts failed opens at the earliest failure; buttons lead to each failure.

    Example: escort-mj view main --speed 4; escort-mj view renders/main

    Args:
        source: Run folder to replay, or scenario to simulate (a file or the name of a shipped scenario).
        speed: Initial speed, in simulated seconds per second.
        at: Time at which the viewer opens, paused [s]; None for the first failure of a run folder.
        host: Network interface to listen on; by default, this machine only.
        port: First port to try; 0 for any free port.
    """
    from escort_mj import api

    if not 0.01 <= speed <= 1000.0:
        raise UsageError(f"--speed: found {speed:g}; allowed is 0.01 to 1000")
    recorded = os.path.isdir(source)
    if recorded and (overrides or plugins):
        raise UsageError("--set and --plugin change a scenario, not a run folder")
    scenario = None if recorded else api.load_scenario(source, overrides, plugins)
    from escort_mj.view.viewer import Viewer, require_viser

    require_viser()
    from escort_mj.view.tape import Live, Stored, failures

    tape = Stored(Path(source)) if scenario is None else Live(scenario)
    failed = failures(tape.verdicts)
    if at is None and failed:
        at = failed[0].time
        say(f"opens at {at:.2f} s: {failed[0].message}")
    with _ended_by_hand() as ended, Viewer(tape, host, port, speed) as viewer:
        if at is not None:
            viewer.stop_at(at)
        say(f"{tape.title} at {viewer.url}  (Ctrl-C ends)")
        if viewer.public:
            typer.echo("anyone who reaches this address can watch and steer the viewer", err=True)
        viewer.run(ended)


@contextlib.contextmanager
def _ended_by_hand() -> Iterator[Event]:
    """Takes Ctrl-C and a polite kill for the end that was meant; a second one ends at once."""
    ended = Event()

    def end(number: int, frame: object) -> None:
        if ended.is_set():
            raise KeyboardInterrupt
        ended.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield ended
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
