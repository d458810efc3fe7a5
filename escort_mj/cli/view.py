"""The command that shows a run, live or recorded."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from typing import Annotated

import typer

from escort_mj.cli import complete
from escort_mj.cli.app import PluginOption, SetOption, app, say
from escort_mj.errors import UsageError


@app.command("view")
def view_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Run folder to replay, or scenario to simulate (a file or the name of a shipped scenario).",
            autocompletion=complete.runs_or_scenarios,
        ),
    ],
    overrides: SetOption = None,
    plugins: PluginOption = None,
    speed: Annotated[float, typer.Option(help="Initial speed, in simulated seconds per second.")] = 1.0,
    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            min=0.0,
            help="Time at which the viewer opens, paused [s] [default: the first failure of a run folder].",
        ),
    ] = None,
    host: Annotated[
        str, typer.Option(help="Network interface to listen on; by default, this machine only.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="First port to try; 0 for any free port.")] = 8080,
) -> None:
    """Show a run in the browser: replay a run folder, or simulate a scenario live. Stop with Ctrl-C.

    The replay of a run in which verdicts failed opens at the earliest failure; buttons lead to each failure.

    Example: escort-mj view main --speed 4; escort-mj view renders/main
    """
    from escort_mj import api

    if not 0.01 <= speed <= 1000.0:
        raise UsageError(f"--speed: found {speed:g}; allowed is 0.01 to 1000")
    recorded = os.path.isdir(source)
    if recorded and (overrides or plugins):
        raise UsageError("--set and --plugin change a scenario, not a run folder")
    scenario = None if recorded else api.load_scenario(source, overrides or (), plugins or ())
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
