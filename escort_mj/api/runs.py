"""A run as users have it: what came of a scenario, in memory or in a run folder."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from escort_mj.api.shown import ShownPage, ShownVideo
from escort_mj.errors import UsageError
from escort_mj.files import temporary_folder
from escort_mj.measuring import metric_value
from escort_mj.mission import NOT_KEPT, Flight, save
from escort_mj.record.folder import VIDEO, RunFolder, StoredRun
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Bound, NotNegative, Positive, argument_error, checked
from escort_mj.scenario.findings import did_you_mean
from escort_mj.scenario.reader.load import stored_scenario

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from escort_mj.record.window import Span

MOST_SHOWN = 5  # failed verdicts in a text of a few lines


class Metrics(dict[str, Any]):
    """Metrics by name; another name is an error with the nearest one."""

    def __missing__(self, name: object) -> Any:
        raise KeyError(f"{name}: is not a metric of this run{did_you_mean(str(name), self)}")


class Run:
    """The results of a scenario, in memory or in a run folder.

    Attributes:
        name: Name of the scenario.
        outcome: Outcome of the run.
        message: The outcome in one sentence, with the time.
        metrics: Contents of metrics.json: value, unit, window, time and bodies of each metric.
        verdicts: Verdicts of the expectations.
        folder: Run folder; None for a run in memory.
    """

    name: str
    outcome: Outcome
    message: str
    metrics: dict[str, Any]
    verdicts: list[Verdict]
    folder: Path | None

    def __init__(self, source: Flight | StoredRun, folder: Path | None = None) -> None:
        """Wrap a run.

        Args:
            source: A new run, or a run that was read from its folder.
            folder: Folder of a new run; None for a run in memory.
        """
        self._source = source
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        if isinstance(source, StoredRun):
            self.name, self.folder = str(source.trace.attrs.get("title", source.path.name)), source.path
            self.outcome, self.message = Outcome(source.outcome["outcome"]), str(source.outcome["message"])
        else:
            self.name, self.folder = source.scenario.name, folder
            self.outcome, self.message = source.outcome, source.message
        self.verdicts, self.metrics = source.verdicts, Metrics(source.metrics)

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario of the run.

        Raises:
            ScenarioError: If the scenario of a run folder is invalid in this version of the program.
        """
        if isinstance(self._source, StoredRun):
            return stored_scenario(self._source.scenario_yaml, self._source.scenario_file)
        return self._source.scenario

    @property
    def trace(self) -> xarray.Dataset:
        """Every recorded signal, with labels, units and meanings.

        Raises:
            UsageError: If the trace was not kept.
        """
        return self._source.trace

    @property
    def passed(self) -> bool:
        """Whether every verdict passed, including the outcome."""
        return bool(self.verdicts) and all(verdict.passed for verdict in self.verdicts)

    @cached_property
    def values(self) -> dict[str, float]:
        """Every metric as a number: NaN if it does not apply, infinite for "never"."""
        found = {name: metric_value(value) for name, value in self.metrics.items() if name != "run"}
        return Metrics(found)

    @checked
    def summary(
        self,
        metrics: str | Sequence[str] = (),
        *,
        over: Literal["whole", "tail"] | None = None,
        after: NotNegative | None = None,
        before: NotNegative | None = None,
    ) -> pandas.Series[Any]:
        """Return the run as one row: name, seed, outcome, and metrics as numbers.

        Args:
            metrics: As for `table`.
            over: As for `table`.
            after: As for `table`.
            before: As for `table`.

        Returns:
            The row; `attrs["units"]` has the units of numbers.

        Raises:
            UsageError: If there is no such metric or window, or if the trace was not kept.
        """
        import pandas

        from escort_mj.record.window import span_of

        names = [metrics] if isinstance(metrics, str) else metrics
        for name in names:
            if name not in self.values:
                raise UsageError(f"{name}: is not a metric of {self.name}{did_you_mean(name, self.values)}")
        if (span := span_of(over, after, before)) is None:
            values, suffix = {name: self.values[name] for name in names or self.values}, ""
        else:
            values, suffix = self._values_over(names, span), f"_{span.suffix}"
        about = self.metrics.get("run", {})
        row = {
            "name": self.name,
            "seed": self.scenario.seed,
            "outcome": self.outcome.value,
            "passed": self.passed,
            "simulated_time": about.get("simulated_time"),
            "wall_time": about.get("wall_time"),
        }
        row |= {f"{name}{suffix}": value for name, value in values.items()}
        found = pandas.Series(row, name=self.name, dtype=object)
        units = {f"{name}{suffix}": self.metrics[name]["unit"] for name in values}
        found.attrs["units"] = {"simulated_time": "s", "wall_time": "s"} | units
        return found

    def _values_over(self, names: Sequence[str], span: Span) -> dict[str, float]:
        """Metrics over a part of the run; no names stand for those that have a value and are no moments."""
        from escort_mj.measuring import measure_over
        from escort_mj.metrics.metric import Metric
        from escort_mj.record.team import of_team
        from escort_mj.record.window import end_of
        from escort_mj.scenario.reader.catalog import catalog_of
        from escort_mj.study.compare import check_span

        if (trace := self._source.recording) is None:
            raise UsageError(NOT_KEPT)
        check_span(span, end_of(trace))
        known = {metric.name: metric for metric in catalog_of(self.scenario).of(Metric)}
        found = {}
        for name in names or [name for name, value in self.values.items() if not math.isnan(value)]:
            team, _, bare = name.rpartition(".")
            if names or not known[bare].moment:
                value = measure_over(known[bare], of_team(trace, team) if team else trace, span).value
                found[name] = math.nan if value is None else float(value)
        return found

    @checked
    def to_dataframe(self, signals: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """Return recorded signals over time, with one column per component, such as `q.robot_1.x`.

        Args:
            signals: Names of signals (`trace.data_vars`); None for all.

        Returns:
            A table with the time [s] as its index; `attrs["units"]` has the unit of each column.

        Raises:
            UsageError: If there is no such time-dependent signal.
        """
        from escort_mj.record.export import dataframe_of

        trace = self.trace
        if signals is not None:
            known = [str(name) for name, one in trace.data_vars.items() if one.dims[:1] == ("time",)]
            wanted = [signals] if isinstance(signals, str) else list(signals)
            if not wanted:
                raise UsageError("signals: found none; expected names, or None for all")
            for name in wanted:
                if name not in known:
                    hint = did_you_mean(name, known) or f"; allowed are {', '.join(known)}"
                    raise UsageError(f"{name}: is not a signal over time{hint}")
            trace = trace[wanted]
        return dataframe_of(trace).set_index("time")

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures that `plot` can draw for this run."""
        from escort_mj.report.figures.figures import plots_of

        return tuple(plots_of(self.trace))

    @checked
    def plot(
        self,
        name: str | None = None,
        width: str | Positive | None = None,
        font: str | None = None,
        font_size: Positive | None = None,
        title: bool = True,
    ) -> Figure:
        """Draw a figure of the run.

        Args:
            name: One of `figures`; None for the first, distances and tracking errors.
            width: `column` (3.5 in), `page` (7.2 in), a length such as `8.8cm`, or a number of inches.
            font: Font family.
            font_size: Size of most text [points].
            title: Whether the figure has a title.

        Returns:
            A matplotlib figure.

        Raises:
            UsageError: If the run has no such figure, or if a width or font is invalid.
            RenderError: If there is no sample to draw.
        """
        from escort_mj.report.figures.drawing.look import look_of, looking
        from escort_mj.report.figures.figures import figure_of

        words = "" if self.outcome.good else f"{self.outcome.value}: {self.message}"
        with looking(look_of(width, font, font_size, title)):
            return figure_of(self.trace, name, words)

    @checked
    def video(self, path: str | os.PathLike[str] | None = None, **changes: Any) -> ShownVideo:
        """Render the video of the run, unless its folder already contains it.

        Args:
            path: File to write (.mp4 or .webp); None for video.mp4 in the run folder, or a temporary
                file for a run in memory.
            changes: Keys of the scenario's `video` with new values, such as `speed=8`, `camera="follow"` or
                `start=10`.

        Returns:
            The file; notebooks display it.

        Raises:
            RenderError: If this machine cannot render.
            ScenarioError: If a key or value is invalid.
            UsageError: If there is no such format.
        """
        from escort_mj.report.video.video import render_video

        folder = self._on_disk()
        file = folder / VIDEO if path is None else Path(path)
        if file.suffix == ".mp4" and not changes and (folder / VIDEO).is_file():
            if path is not None:
                shutil.copyfile(folder / VIDEO, file)
            return ShownVideo(file)
        scenario = self.scenario.replace({f"video.{key}": value for key, value in changes.items()})
        return ShownVideo(render_video(folder, scenario.video, out=file))

    @checked
    def report(self, path: str | os.PathLike[str] | None = None) -> ShownPage:
        """Write the run as a self-contained HTML page with a replay.

        Args:
            path: File to write; None for the file in the run folder, or a temporary file for a run in memory.

        Raises:
            RenderError: If there is no sample to show.
        """
        from escort_mj.report.pages.run_page import write_run_page

        return ShownPage(write_run_page(self._on_disk(), None if path is None else Path(path)))

    @checked
    def export(self, path: str | os.PathLike[str]) -> Path:
        """Write the run for other programs.

        Args:
            path: FILE.csv or FILE.parquet: a table; FILE.npz: MuJoCo's states;
                FILE.xml: the world as MJCF.

        Returns:
            The file.

        Raises:
            UsageError: If the suffix is none of these, or what it needs is not installed.
        """
        from escort_mj.record.folder import read_run
        from escort_mj.report.exports import check_export, export_run

        check_export(Path(path))
        export_run(read_run(self._on_disk()), Path(path))
        return Path(path)

    @checked
    def view(
        self, speed: Positive = 1.0, host: str = "127.0.0.1", port: Annotated[int, Bound(0)] = 8080
    ) -> None:
        """Show the run in the browser until interrupted (Ctrl-C, or the stop button of a notebook).

        Args:
            speed: Initial speed, in simulated seconds per second.
            host: Network interface to listen on; by default, this machine only.
            port: First port to try; 0 for any free port.

        Raises:
            UsageError: If viser is not installed.
        """
        import contextlib
        from threading import Event

        from escort_mj.view.tape import Stored
        from escort_mj.view.viewer import Viewer, require_viser

        require_viser()
        with Viewer(Stored(self._on_disk()), host, port, speed) as viewer:
            print(f"{self.name} at {viewer.url}", flush=True)
            with contextlib.suppress(KeyboardInterrupt):
                viewer.run(Event())

    @checked
    def save(self, path: str | os.PathLike[str], overwrite: bool = False) -> Run:
        """Write a run in memory to a run folder.

        Args:
            path: The folder.
            overwrite: Whether to replace an existing run in the folder.

        Returns:
            The same run, with its folder.

        Raises:
            UsageError: If the run has no trace, or if the folder contains another run or other files.
        """
        source = self._source
        if isinstance(source, StoredRun):
            raise UsageError(f"{source.path}: holds this run already; copy the folder")
        if source.recording is None:
            raise UsageError(NOT_KEPT)
        with RunFolder.create(Path(path), overwrite=overwrite) as folder:
            save(folder, source)
        return Run(source, folder.path)

    def _on_disk(self) -> Path:
        """Return the run folder, or a temporary one with the lifetime of the run."""
        if self.folder is not None:
            return self.folder
        if self._temporary is None:
            made = tempfile.TemporaryDirectory(dir=temporary_folder())
            self.save(Path(made.name) / self.name)
            self._temporary = made
        return Path(self._temporary.name) / self.name

    def _in_words(self) -> str:
        """How the run ended, and how many verdicts held."""
        judged = [verdict.passed for verdict in self.verdicts if not verdict.skip]
        skipped = len(self.verdicts) - len(judged)
        words = f"{self.outcome.told(self.message)}; {sum(judged)} of {len(judged)} verdicts passed"
        return words + (f", {skipped} not judged" if skipped else "")

    def __repr__(self) -> str:
        failed = [verdict.message for verdict in self.verdicts if not verdict.passed]
        lines = [
            f"<Run {self.name}: {self._in_words()}>",
            *(f"  FAIL  {words}" for words in failed[:MOST_SHOWN]),
        ]
        if len(failed) > MOST_SHOWN:
            lines.append(f"  ... and {len(failed) - MOST_SHOWN} more")
        return "\n".join(lines)

    @cached_property
    def _thumbnail(self) -> bytes | None:
        """The paths as a small PNG; None where they cannot be drawn."""
        from escort_mj.report.figures.figures import thumbnail_of

        try:
            return thumbnail_of(self.trace)
        except Exception:  # a cell shows what there is
            return None

    def _repr_html_(self) -> str:
        from escort_mj.report.pages.html import run_in_html

        return run_in_html(self.name, self._in_words(), self.passed, self.verdicts, self._thumbnail)


@checked
def table(
    runs: Iterable[Run],
    metrics: str | Sequence[str] = (),
    *,
    over: Literal["whole", "tail"] | None = None,
    after: NotNegative | None = None,
    before: NotNegative | None = None,
) -> pandas.DataFrame:
    """Return many runs as one table, with one row per run and the columns of `Run.summary`.

    Args:
        runs: Runs, for example those of `run_many`.
        metrics: Names of metrics, such as `radius_error_mean`; empty for all.
        over: Part of each run that metrics look at: the `whole` run, or its `tail`, which is its last
            fifth; None for what `after` and `before` say, or that of each metric.
        after: Start of a window [s], instead of `over`.
        before: End of the window [s]; None for the end of the run.

    Returns:
        The table; `attrs["units"]` has the units of columns. Names of columns end with the window where
        one is given, as in `radius_error_mean_after_20`.

    Raises:
        UsageError: If there is no such metric or window, or if a trace was not kept.
    """
    import pandas

    rows: list[dict[str, Any]] = []
    units: dict[str, str] = {}
    for place, run in enumerate(runs):
        if not isinstance(run, Run):  # of an iterator, which nobody looks through twice
            raise argument_error(f"runs[{place}]", run, "a Run")
        row = run.summary(metrics, over=over, after=after, before=before)
        rows.append(dict(row))
        units |= row.attrs["units"]
    found = pandas.DataFrame(rows)
    found.attrs["units"] = units
    return found
