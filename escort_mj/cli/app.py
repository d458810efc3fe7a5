"""The command line's application: options, progress and exit codes that its commands share."""

from __future__ import annotations

import copy
import errno
import inspect
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import cached_property
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, NoReturn

import typer

from escort_mj import stopping
from escort_mj.cli.group import Commands, print_version
from escort_mj.cli.options import SHARED, help_of, options, plain
from escort_mj.cli.streams import OUTPUT, Output, lasting_streams, printable_json, say
from escort_mj.errors import NO_PATH, EscortError, LogError, ScenarioError
from escort_mj.progress import Progress, terminal_bar, unseen

if TYPE_CHECKING:
    from escort_mj.report.figures.ahead import Draw
    from escort_mj.scenario.schema.scenario import Video

EXIT_CODES = (
    "Exit codes: 0 success, 1 a verdict failed, 2 invalid input, 3 a run diverged or crashed, "
    "130 interrupted."
)

app = typer.Typer(
    name="escort-mj",
    help="Simulate multi-robot escort missions: one YAML file in; verdicts, figures and a video out.",
    epilog=EXIT_CODES,
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

# What the system says where a disk is full, may not be written, or fails.
DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)

GOOD, VERDICT_FAILED, BAD_INPUT, BROKEN = 0, 1, 2, 3


@app.callback()
def _before_every_command(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=print_version)
    ] = False,
) -> None:
    vars(OUTPUT).update(vars(Output()))  # an earlier command of this process has its own


class Answer(NamedTuple):
    """What came of a command.

    Attributes:
        lines: What people read.
        told: What programs read; every document has `command` and `exit_code`, too (docs/json.md).
        code: The exit code.
    """

    lines: Iterable[str]
    told: Mapping[str, Any]
    code: int = GOOD


def command(
    name: str,
    like: str = "",
    flags: Mapping[str, str] = {},
    choices: Mapping[str, Iterable[str]] = {},
    json: bool = True,
) -> Callable[[Callable[..., Answer | None]], Callable[..., Answer | None]]:
    """Return what makes a function a command, with the arguments and options of its signature and docstring.

    Args:
        name: Of the command.
        like: Function of the package whose parameters it has, too, see `options`.
        flags: By name, what options are called, see `options`.
        choices: By name, the words that an argument may be, where its type does not list them.
        json: Whether the command has the option --json.
    """

    def register(function: Callable[..., Answer | None]) -> Callable[..., Answer | None]:
        shared = SHARED if json else SHARED[1:]
        app.command(name)(_Command(name, function, lambda: options(function, like, flags, choices) + shared))
        return function

    return register


class _Command:
    """A command as Typer takes it: as a function, which is described when it is asked for.

    Args:
        name: Its name.
        function: What it calls.
        describe: Returns the parameters that it has as a command.
    """

    def __init__(
        self, name: str, function: Callable[..., Answer | None], describe: Callable[[], list[Parameter]]
    ) -> None:
        self.__name__, self._function, self._describe = name, function, describe

    @cached_property
    def _parameters(self) -> list[Parameter]:
        return self._describe()

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.Signature(self._parameters)

    def __getattribute__(self, name: str) -> Any:
        if name == "__doc__":
            return help_of(self._function)
        if name == "__annotations__":
            return {each.name: each.annotation for each in self._parameters}
        return super().__getattribute__(name)

    def __call__(self, **given: Any) -> None:
        vars(OUTPUT).update({field: given.pop(field) for field in vars(OUTPUT) if field in given})
        answer = self._function(**plain(self._parameters, given))
        if answer is not None:
            finish(self.__name__, answer)


def finish(command: str, answer: Answer) -> NoReturn:
    """End a command with its exit code: print lines of text, or the results as one JSON document."""
    if OUTPUT.json:
        from escort_mj.files import json_text

        document = {"command": command, "exit_code": answer.code, **answer.told}
        typer.echo(printable_json(json_text(document)))
    elif not OUTPUT.quiet or answer.code != GOOD:
        for line in answer.lines:
            say(line)
    raise typer.Exit(answer.code)


@contextmanager
def drawing_video(
    folder: Path, video: Video | None = None, out: Path | None = None
) -> Iterator[Callable[[], bool]]:
    """Draw the video while something else is done.

    Without GL it reports what is missing and leaves the rest of the run unchanged.

    Args:
        folder: The run folder.
        video: Size, rate, speed, camera and window; None takes the scenario's.
        out: The file; None for video.mp4 in the folder.

    Returns:
        A context with a function that waits for the video and returns whether there is one.
    """
    from escort_mj.errors import RenderError
    from escort_mj.report.video.video import started_video

    with ExitStack() as stack:
        fault: RenderError | None = None
        try:
            rendering = stack.enter_context(started_video(folder, video, out))
        except RenderError as error:
            fault = error

        def finish() -> bool:
            nonlocal fault
            if fault is None:
                try:
                    with progress_bar("drawing the video", " frames", announced=True) as progress:
                        rendering.finish(progress)
                except RenderError as error:
                    fault = error
            if fault is not None:
                say(f"no video: {fault}", err=True)
            return fault is None

        yield finish


def drawing_figures() -> AbstractContextManager[Draw]:
    """Get ready to draw figures, see `figures_ahead`."""
    from escort_mj.report.figures.ahead import figures_ahead

    return figures_ahead()


@contextmanager
def progress_bar(label: str, unit: str, announced: bool = False) -> Iterator[Progress]:
    """Show progress: a bar with rate and time left on a terminal, else nothing.

    Args:
        label: What is being done.
        unit: What is counted.
        announced: Whether a pipe gets one line that says what is being done.
    """
    clock = time.perf_counter()
    if OUTPUT.quiet:
        yield unseen
    elif sys.stderr.isatty():
        with terminal_bar(label, unit) as update:
            yield update
    else:
        if announced:
            say(f"{label} ...", err=True)
        yield unseen
    if OUTPUT.verbose:
        say(f"{label}: {time.perf_counter() - clock:.2f} s", err=True)


def shown_path(path: Path) -> str:
    """A path as short as it can be typed from here."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative


def _application() -> typer.Typer:
    """Return the application with only the command that is asked for: describing them all takes 0.1 s."""
    asked = [command for command in app.registered_commands if command.name in sys.argv[1:2]]
    if not asked:
        return app
    alone = copy.copy(app)
    alone.registered_commands = asked
    return alone


@lasting_streams()
def run_program() -> None:
    """Run a command; errors become one message and an exit code, never a traceback."""
    try:
        _application()()
    except (ScenarioError, LogError) as error:
        typer.echo(str(error), err=True)  # a safe line for each fault
        sys.exit(error.exit_code)
    except EscortError as error:
        say(f"escort-mj: {error}", err=True)
        sys.exit(error.exit_code)
    except Exception as error:
        stopping.raise_if_interrupted()
        # The latter is what Python says where no disk has room.
        if isinstance(error, OSError) and (error.errno in DISK or "No usable temporary" in str(error)):
            name = error.filename or "a temporary file"
            say(f"escort-mj: {name}: cannot be written: {error.strerror}", err=True)
            sys.exit(BROKEN)
        if isinstance(error, OSError) and error.errno in NO_PATH:
            from escort_mj.scenario.findings import shortened

            say(f"escort-mj: {shortened(error.filename)}: {error.strerror}", err=True)
            sys.exit(BAD_INPUT)
        if OUTPUT.verbose or os.environ.get("ESCORT_MJ_TRACEBACK"):
            raise
        say(f"escort-mj: the program broke: {type(error).__name__}: {error}", err=True)
        say("--verbose shows where; please report it.", err=True)
        sys.exit(BROKEN)
