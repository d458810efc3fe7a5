"""Studies: what the commands of the same names do, with results as tables."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from escort_mj import stopping
from escort_mj.api import loaded, scenarios_folder, study_path
from escort_mj.api.shown import ShownPage
from escort_mj.errors import UsageError
from escort_mj.progress import Progress, shown_progress
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Count, NotNegative, Overrides, Source, StudySource, checked
from escort_mj.scenario.findings import shown
from escort_mj.study.engine.parallel import cores

if TYPE_CHECKING:
    import pandas

    from escort_mj.study.sweeps.design import Design
    from escort_mj.study.sweeps.results import Results
    from escort_mj.study.sweeps.sweep import Again, Swept

    LaidOut = tuple[Design, Path, int]

ShowProgress = bool | Progress | None
AnyStudy = StudySource


@dataclass(frozen=True, repr=False)
class StudyResult:
    """The results of a study.

    Attributes:
        name: Name of the study or of the scenario.
        folder: Folder of the results; the same call continues there.
        lines: Output of the command.
        written: Files in the folder.
        passed: Whether the study succeeded: no run failed and every claim holds, a best point was found, or
            no counterexample.
        found: Detailed results of the search or sweep.
    """

    name: str
    folder: Path
    lines: list[str]
    written: list[str]
    passed: bool
    found: Any = field(compare=False)
    _rows: bytes | list[dict[str, Any]] = field(compare=False)

    @cached_property
    def table(self) -> pandas.DataFrame:
        """One row per run (`attrs["units"]` has the units of columns), trial, counterexample or claim."""
        import pandas  # slow to import

        from escort_mj.record.tables import without_units

        if isinstance(self._rows, bytes):
            return without_units(pandas.read_csv(BytesIO(self._rows)))
        return pandas.DataFrame(self._rows)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a copy of the table."""
        return self.table.copy()

    @checked
    def report(
        self,
        path: str | os.PathLike[str] | None = None,
        compare: str | None = None,
        formats: Sequence[str] = (),
        quantities: Sequence[str] = (),
        **look: Any,
    ) -> ShownPage:
        """Write the page of a sweep, with statistics, figures and its worst runs.

        Args:
            path: File to write; None for `report.html` in the folder.
            compare: Factor whose levels are compared; None for laws or cases.
            formats: File formats of the figures beside `svg`: `png`, `pdf`.
            quantities: Metrics that tables and figures show; empty for those that the study asks for.
            look: How figures look: `width`, `font`, `font_size` and `title`, as for `Run.plot`.

        Raises:
            UsageError: If the folder contains no results of a sweep, or if a format or look is invalid.
        """
        from escort_mj.report.figures.drawing.look import check_formats, look_of, looking
        from escort_mj.report.pages.study_page import write_study_page

        with looking(look_of(**look)):
            file = None if path is None else Path(path)
            known = check_formats(("svg", *formats))
            return ShownPage(write_study_page(self.folder, file, compare, known, quantities))

    def __repr__(self) -> str:
        return "\n".join([f"<{self.name}: {len(self.table)} rows in {self.folder}>", *self.lines])

    def _repr_html_(self) -> str:
        from markupsafe import Markup

        words = Markup("<pre>{}</pre>").format("\n".join(self.lines))
        return str(words) + str(self.table._repr_html_())


def _lay_out(
    study: AnyStudy,
    out: str | os.PathLike[str] | None,
    workers: int | None,
    confirmed: bool = True,
    overrides: Sequence[str] = (),
) -> LaidOut:
    """Return the design of a study, the folder of its results, and the number of workers.

    Args:
        study: Study file, name of a shipped study, or a mapping with the keys of a file.
        out: Folder for the results; None for `renders/studies/NAME`.
        workers: Number of workers; None for one per core.
        confirmed: Whether the study may exceed its own `at_most`.
        overrides: Texts `key.path=value` that are added to the study's `set`.

    Raises:
        UsageError: If there is no such study, or if it is too large and not confirmed.
        ScenarioError: With all faults of the study.
    """
    from escort_mj.study.sweeps.definition import load_study
    from escort_mj.study.sweeps.design import Design
    from escort_mj.study.sweeps.sweep import check_size

    file = load_study(study if isinstance(study, Mapping) else study_path(study), overrides)
    folder = Path(out) if out is not None else Path("renders") / "studies" / file.study.study
    if not confirmed:
        check_size(file, folder)
    return Design(file, scenarios_folder()), folder, cores() if workers is None else workers


def _run_all(
    study: LaidOut, label: str, progress: ShowProgress, again: bool, only: Collection[int] | None = None
) -> tuple[Swept, Results, bool]:
    """Make the runs of some cells, None for all; return what was done, the results, if all runs ended."""
    from escort_mj.record.outcome import FINAL
    from escort_mj.study.engine import backends
    from escort_mj.study.sweeps.results import open_results
    from escort_mj.study.sweeps.sweep import sweep_design

    design, folder, workers = study
    repeated: Again = "all" if again else "broken_off"
    with backends.local(workers) as where, shown_progress(label, " runs", progress) as update:
        done = sweep_design(design, folder, where, workers, True, update, repeated, only)
    results = open_results(folder)
    return done, results, all(row.outcome in FINAL for row in results.rows.values())


@checked
def sweep(
    study: AnyStudy,
    out: str | os.PathLike[str] | None = None,
    *,
    workers: Count | None = None,
    backend: Literal["local", "threads", "dask"] = "local",
    scheduler: str | None = None,
    confirmed: bool = False,
    overrides: Sequence[str] = (),
    progress: ShowProgress = None,
) -> StudyResult:
    """Perform the missing runs of a study.

    Args:
        study: Study file, name of a shipped study, or a mapping with the keys of a file.
        out: Folder of results; None for `renders/studies/NAME`.
        workers: Number of parallel runs; None for one per core.
        backend: Where runs are made: local processes, threads, or a Dask cluster.
        scheduler: Address of a Dask scheduler, such as `tcp://host:8786`; None to start a local cluster.
        confirmed: Whether to start a study of more runs than its own `at_most`.
        overrides: Texts `key.path=value` that are added to the study's `set`.
        progress: Called with progress, as for `shown_progress`; None shows it on terminals and in notebooks.

    Returns:
        A table with one row per run: varied values, seed, outcome, every metric.

    Raises:
        UsageError: If there is no such study, if it is too large and not confirmed, if no cluster answers, or
            if the folder is a run's.
        ScenarioError: With all faults of the study.
        KeyboardInterrupt: On an interrupt; completed runs are kept, and the same call continues.
    """
    from escort_mj.study.engine import backends
    from escort_mj.study.sweeps.judged import FILES, judged_lines, write_judged
    from escort_mj.study.sweeps.results import open_results
    from escort_mj.study.sweeps.sweep import TABLE, sweep_design, sweep_line

    if scheduler is not None and backend != "dask":
        raise UsageError(f"--scheduler {shown(scheduler)}: is for --backend dask; found --backend {backend}")
    design, folder, count = _lay_out(study, out, workers, confirmed, overrides)
    make = {"local": backends.local, "threads": backends.threads}.get(backend)
    at = backends.dask(count, scheduler) if make is None else make(count)
    with at as where, shown_progress("sweeping", " runs", progress) as update:
        done = sweep_design(design, folder, where, count, confirmed, update)
    lines, written = [sweep_line(design.study.study, done)], ["results.sqlite", TABLE, "study.yaml"]
    claims = write_judged(open_results(folder), folder) if design.study.expect else []
    if claims:
        lines, written = lines + judged_lines(claims), [*written, *FILES]
    passed = not done.failed and all(claim.holds in ("yes", "undecided") for claim in claims)
    rows = (folder / TABLE).read_bytes()
    return StudyResult(design.study.study, folder, lines, written, passed, done, rows)


@checked
def compare(
    scenario: Scenario | Source,
    laws: str | Sequence[str] = (),
    outer: str | Sequence[str] = (),
    seeds: Count = 1,
    out: str | os.PathLike[str] | None = None,
    *,
    over: Literal["whole", "tail"] | None = None,
    after: NotNegative | None = None,
    before: NotNegative | None = None,
    workers: Count | None = None,
    again: bool = False,
    overrides: Overrides = (),
    plugins: Sequence[str] = (),
    progress: ShowProgress = None,
    **keys: Any,
) -> StudyResult:
    """Run a scenario with several laws and outer loops, and compare the results.

    Args:
        scenario: A scenario, or any source that `load_scenario` accepts.
        laws: Names of laws, such as `apd_smc`; empty for all.
        outer: Names of outer loops, such as `barrier_filter`; empty for that of the scenario.
        seeds: Number of seeds, starting at the scenario's seed.
        out: Folder of results; None for `renders/compare/NAME`.
        over: Part of each run that quantities look at: the `whole` run, or its `tail`, which is its last
            fifth; None for what `after` and `before` say, or that of each quantity. A settling time is
            always looked for in the whole run.
        after: Start of a window [s], instead of `over`.
        before: End of the window [s]; None for the end of the run.
        workers: Number of processes; None for one per core.
        again: Whether to repeat runs that already exist.
        overrides: A mapping of key paths to values, or texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        progress: As for `sweep`.
        keys: Further keys of the scenario with their values, such as `duration=10, seed=3`.

    Returns:
        A table with one row per run: controller, outer loop, seed, outcome, every metric.

    Raises:
        UsageError: If there is no such law or outer loop, or if a folder contains other files.
        KeyboardInterrupt: On an interrupt; completed runs are kept, and the same call continues.
    """
    from escort_mj.files import make_folder, write_text
    from escort_mj.record.folder import refuse_run
    from escort_mj.record.window import span_of
    from escort_mj.report.comparison import write_comparison
    from escort_mj.scenario import dump_scenario
    from escort_mj.study.compare import comparison_of
    from escort_mj.study.sweeps.sweep import TABLE

    mission = loaded(compare, scenario, overrides, plugins, keys)
    folder = Path(out) if out is not None else Path("renders") / "compare" / mission.name
    file = (folder / "scenario.yaml").absolute()
    span = span_of(over, after, before)
    study = comparison_of(mission, file, _names(laws), _names(outer), seeds, span)
    refuse_run(folder)
    make_folder(folder)
    write_text(file, dump_scenario(mission))
    done, results, ended = _run_all(_lay_out(study, folder, workers), "comparing", progress, again)
    with stopping.keeping(lambda: kept_words(folder)):
        lines, written = write_comparison(results, folder)
    lines.insert(0, f"{done.runs} runs: {done.made} new, {done.runs - done.made} from earlier")
    rows = (folder / TABLE).read_bytes()
    return StudyResult(mission.name, folder, lines, [*written, TABLE], ended, done, rows)


@checked
def reproduce(
    only: Sequence[str | int] = (),
    out: str | os.PathLike[str] | None = None,
    *,
    workers: Count | None = None,
    again: bool = False,
    progress: ShowProgress = None,
) -> StudyResult:
    """Reproduce the paper's simulations and figures, and check its claims: the study `studies/paper`.

    Args:
        only: Figures, 5 to 17; empty for all.
        out: Folder of results; None for `renders/reproduction`.
        workers: Number of processes; None for one per core.
        again: Whether to repeat runs that already exist.
        progress: As for `sweep`.

    Returns:
        A table with one row per claim: claim, source, rule, and whether the claim holds.

    Raises:
        UsageError: If there is no such figure, or if a folder contains other files.
        KeyboardInterrupt: On an interrupt; completed runs are kept, and the same call continues.
    """
    from escort_mj.report.pages.study_page import PAGE, write_study_page
    from escort_mj.study.sweeps.design import cells_where
    from escort_mj.study.sweeps.judged import FILES, judge_cells, judged_lines
    from escort_mj.study.sweeps.sweep import TABLE, sweep_line

    folder = Path(out) if out is not None else Path("renders") / "reproduction"
    laid_out = design, *_ = _lay_out("studies/paper", folder, workers)
    known = {shown.name: shown for shown in design.study.figures}
    words = [word.strip() for text in only for word in str(text).split(",") if word.strip()]
    names = [f"fig{int(word):02d}" if word.isdigit() else word for word in words]
    if only and not words:
        raise UsageError("--only: found no figure; those of the paper are 5 to 17")
    if unknown := [word for word, name in zip(words, names, strict=True) if name not in known]:
        raise UsageError(
            f"--only {', '.join(unknown)}: there is no such figure; those of the paper are 5 to 17"
        )
    chosen = {index for name in names for index in cells_where(design.cells, known[name].where)}
    done, results, ended = _run_all(laid_out, "reproducing", progress, again, chosen or None)
    with stopping.keeping(lambda: kept_words(folder)):
        write_study_page(folder, formats=("png",))
    claims = judge_cells(results)
    lines = [sweep_line(design.study.study, done), *judged_lines(claims)]
    written = [*FILES, TABLE, PAGE, "figures/"]
    rows = [{key: getattr(one, key) for key in ("claim", "source", "rule", "holds")} for one in claims]
    return StudyResult("reproduction", folder, lines, written, ended, done, rows)


@checked
def tune(
    study: AnyStudy,
    out: str | os.PathLike[str] | None = None,
    *,
    workers: Count | None = None,
    overrides: Sequence[str] = (),
    figures: bool = False,
    progress: ShowProgress = None,
) -> StudyResult:
    """Tune values of a scenario within the bounds of a study's `tune` section.

    Args:
        study: Study file, name of a shipped study, or a mapping with the keys of a file.
        out: Folder of results; None for `renders/studies/NAME`. Its `best.yaml` is the best scenario.
        workers: Number of processes; None for one per core.
        overrides: As for `sweep`.
        figures: Whether to draw the progress of the search.
        progress: As for `sweep`.

    Returns:
        A table with one row per trial; `found.best.point` contains the best values.

    Raises:
        UsageError: If Optuna is not installed, or if no trial satisfies all constraints.
        ScenarioError: With all faults of the study.
        KeyboardInterrupt: On an interrupt; completed runs are kept, and the same call continues.
    """
    from escort_mj.study.engine import backends
    from escort_mj.study.search.evaluate import base_of
    from escort_mj.study.search.tune import BEST, SUMMARY, TRIALS, tune_design
    from escort_mj.study.search.tuned import tuning_lines

    design, folder, count = _lay_out(study, out, workers, overrides=overrides)
    with backends.local(count) as where, shown_progress("tuning", " trials", progress) as update:
        found = tune_design(design, folder, where, update)
    section = design.study.tune
    assert section is not None, "tune has refused studies without it"
    lines = list(tuning_lines(found, section, {key: base_of(design, key) for key in section.over}))
    written = ["results.sqlite", TRIALS, SUMMARY, BEST]
    if figures:
        from escort_mj.report.figures.studies.tuning import draw_tuning

        with stopping.keeping(lambda: kept_words(folder)):
            written += [path.name for path in draw_tuning(folder, section, found)]
    rows = (folder / TRIALS).read_bytes()
    return StudyResult(design.study.study, folder, lines, written, True, found, rows)


@checked
def falsify(
    study: AnyStudy,
    out: str | os.PathLike[str] | None = None,
    *,
    workers: Count | None = None,
    overrides: Sequence[str] = (),
    progress: ShowProgress = None,
) -> StudyResult:
    """Search within the bounds of a study's `falsify` section for missions that violate a verdict.

    Args:
        study: Study file, name of a shipped study, or a mapping with the keys of a file.
        out: Folder of results; None for `renders/studies/NAME`.
        workers: Number of processes; None for one per core.
        overrides: As for `sweep`.
        progress: As for `sweep`.

    Returns:
        A table with one row per counterexample: violated verdict, scenario file and run folder.

    Raises:
        UsageError: If Optuna is not installed.
        ScenarioError: With all faults of the study.
        KeyboardInterrupt: On an interrupt; completed runs are kept, and the same call continues.
    """
    from escort_mj.study.engine import backends
    from escort_mj.study.search.falsify import (
        COUNTEREXAMPLES,
        SUMMARY,
        falsification_lines,
        falsify_design,
    )

    design, folder, count = _lay_out(study, out, workers, overrides=overrides)
    with backends.local(count) as where, shown_progress("searching", " runs", progress) as update:
        found = falsify_design(design, folder, where, update)
    rows = [
        {"broken": one.broken, "message": one.message, **one.point}
        | {"scenario": str(one.scenario), "folder": str(one.folder)}
        for one in found.counterexamples
    ]
    lines, written = list(falsification_lines(found)), ["results.sqlite", SUMMARY, f"{COUNTEREXAMPLES}/"]
    return StudyResult(design.study.study, folder, lines, written, not rows, found, rows)


def kept_words(folder: Path) -> str:
    """What an interrupted study has left."""
    return f"runs that have ended are kept in {folder}; the same command goes on from there"


def _names(given: Sequence[str]) -> Sequence[str]:
    """Names that were given: several, or one text with commas between them."""
    return [given] if isinstance(given, str) else given
