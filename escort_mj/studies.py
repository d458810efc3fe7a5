"""Studies from Python: the same engines as the commands', with results as tables."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from escort_mj import stopping
from escort_mj.api import load_scenario, scenarios_folder, study_path
from escort_mj.progress import Progress, shown_progress
from escort_mj.scenario import Scenario
from escort_mj.shown import Page
from escort_mj.study.engine.parallel import cores

if TYPE_CHECKING:
    import pandas

    from escort_mj.study.compare.runs import Findings
    from escort_mj.study.sweeps.design import Design

ShowProgress = bool | Progress | None


@dataclass(frozen=True, repr=False)
class StudyResult:
    """What came of a study.

    Attributes:
        name: Of the study or of the scenario.
        folder: Where its results lie; the same call goes on there.
        lines: What the command prints.
        table: A row for each run, trial, counterexample or claim.
        passed: Whether it came out well: no run failed, a best point or no counterexample was found.
        found: Everything that the search or the sweep says of itself.
    """

    name: str
    folder: Path
    lines: list[str]
    table: pandas.DataFrame = field(compare=False)
    passed: bool
    found: Any = field(compare=False, default=None)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a copy of the table."""
        return self.table.copy()

    def report(self, path: str | os.PathLike[str] | None = None) -> Page:
        """Write the page of a sweep, with statistics, figures and its worst runs.

        Args:
            path: File to write; None for `report.html` in the folder.

        Raises:
            UsageError: If the folder holds no results of a sweep.
        """
        from escort_mj.report.pages.study_page import write_study_page

        return Page(write_study_page(self.folder, None if path is None else Path(path)))

    def __repr__(self) -> str:
        return "\n".join([f"<{self.name}: {len(self.table)} rows in {self.folder}>", *self.lines])

    def _repr_html_(self) -> str:
        from markupsafe import Markup

        words = Markup("<pre>{}</pre>").format("\n".join(self.lines))
        return str(words) + str(self.table._repr_html_())


def lay_out(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None,
    workers: int | None,
    confirmed: bool = True,
) -> tuple[Design, Path, int]:
    """Lay a study out: its design, the folder of its results, and how many work on it.

    Args:
        study: A file, or the name of a shipped study.
        out: The folder; None for `renders/studies/NAME`.
        workers: How many; None for one per core.
        confirmed: Whether it may be larger than it says itself.

    Raises:
        UsageError: If there is no such study, or it is too large and not confirmed.
        ScenarioError: With everything that is wrong with it.
    """
    from escort_mj.study.sweeps.definition import load_study
    from escort_mj.study.sweeps.design import Design
    from escort_mj.study.sweeps.sweep import check_size

    file = load_study(study_path(study))
    folder = Path(out) if out is not None else Path("renders") / "studies" / file.study.study
    if not confirmed:
        check_size(file, folder)
    return Design(file, scenarios_folder()), folder, cores() if workers is None else workers


def sweep(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    backend: Literal["local", "threads", "dask"] = "local",
    scheduler: str | None = None,
    confirmed: bool = False,
    progress: ShowProgress = None,
) -> StudyResult:
    """Make the runs of a study that have not been made yet.

    Args:
        study: A study file, or the name of a shipped one.
        out: Folder of results; None for `renders/studies/NAME`.
        workers: How many runs go on at once; None for one per core.
        backend: Processes or threads of this machine, or a Dask cluster.
        scheduler: Address of a Dask scheduler; None for a cluster of its own.
        confirmed: Whether a study larger than its own `at_most` may begin.
        progress: As for `shown_progress`: None shows it on terminals and in notebooks.

    Returns:
        A table with a row for each run: what was varied, the seed, how it ended, every metric.

    Raises:
        UsageError: If there is no such study, or it is too large and not confirmed.
        ScenarioError: With everything that is wrong with it.
        KeyboardInterrupt: If it comes; what is done stays, and the same call goes on.
    """
    from escort_mj.study.engine import backends
    from escort_mj.study.sweeps.sweep import TABLE, sweep_line
    from escort_mj.study.sweeps.sweep import sweep as make_runs

    design, folder, count = lay_out(study, out, workers, confirmed)
    make = {"local": backends.local, "threads": backends.threads}.get(backend)
    at = backends.dask(count, scheduler) if make is None else make(count)
    with at as where, shown_progress("sweeping", " runs", progress) as update:
        done = make_runs(design, folder, where, count, confirmed, update)
    passed = not done.failed
    return StudyResult(
        design.study.study, folder, [sweep_line(design, done)], _read_csv(folder / TABLE), passed, done
    )


def compare(
    scenario: Scenario | str | os.PathLike[str] | Mapping[str, Any],
    laws: Sequence[str] = (),
    outer: Sequence[str] = (),
    seeds: int = 1,
    out: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    again: bool = False,
    progress: ShowProgress = None,
) -> StudyResult:
    """Run a scenario under several laws and outer loops, where that has not been done, and compare them.

    Args:
        scenario: A scenario, or what `load_scenario` takes.
        laws: Names of laws; empty for all.
        outer: Names of outer loops; empty for the scenario's own.
        seeds: How many seeds, from the scenario's own upward.
        out: Folder of results; None for `renders/compare/NAME`.
        workers: Processes; None for one per core.
        again: Whether to make every run again.
        progress: As for `sweep`.

    Returns:
        A table with a row for each run: law, outer loop, seed, how it ended, every quantity.

    Raises:
        UsageError: If there is no such law or outer loop, or a folder holds something else.
        KeyboardInterrupt: If it comes; what is done stays, and the same call goes on.
    """
    from escort_mj.report.comparison import draw_comparison
    from escort_mj.study.compare.compare import compare as compare_laws

    mission = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    folder = Path(out) if out is not None else Path("renders") / "compare" / mission.name
    with (
        stopping.keeping(lambda: kept_words(folder)),
        shown_progress("comparing", " runs", progress) as update,
    ):
        found = compare_laws(
            mission, folder, draw_comparison, _names(laws), _names(outer), seeds, workers, None, again, update
        )
    return _of_findings(mission.name, folder, found, _read_csv(folder / "table.csv"))


def reproduce(
    only: Sequence[str | int] = (),
    out: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    again: bool = False,
    progress: ShowProgress = None,
) -> StudyResult:
    """Run the paper's simulations, draw its figures, and judge its claims.

    Args:
        only: Figures, 5 to 17 or `laws`; empty for all.
        out: Folder of results; None for `renders/reproduction`.
        workers: Processes; None for one per core.
        again: Whether to make every run again.
        progress: As for `sweep`.

    Returns:
        A table with a row for each claim: section, figures, the claim, the rule, and whether it holds.

    Raises:
        UsageError: If there is no such figure, or a folder holds something else.
        KeyboardInterrupt: If it comes; what is done stays, and the same call goes on.
    """
    import pandas

    from escort_mj.record.files import read_json
    from escort_mj.report.reproduction import draw_reproduction
    from escort_mj.study.compare.reproduce import reproduce as reproduce_paper

    folder = Path(out) if out is not None else Path("renders") / "reproduction"
    wanted = [str(each) for each in only]
    with (
        stopping.keeping(lambda: kept_words(folder)),
        shown_progress("reproducing", " steps", progress) as update,
    ):
        found = reproduce_paper(
            scenarios_folder(), folder, draw_reproduction, wanted, workers, None, again, update
        )
    columns = ["section", "figures", "claim", "rule", "holds"]
    table = pandas.DataFrame(read_json(folder / "table.json")["claims"], columns=columns)
    return _of_findings("reproduction", folder, found, table)


def tune(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    progress: ShowProgress = None,
) -> StudyResult:
    """Tune values of a scenario within the bounds of a study's section `tune`.

    Args:
        study: A study file, or the name of a shipped one.
        out: Folder of results; None for `renders/studies/NAME`. The best scenario is its `best.yaml`.
        workers: Processes; None for one per core.
        progress: As for `sweep`.

    Returns:
        A table with a row for each trial; `found.best.point` has the best values.

    Raises:
        UsageError: If Optuna is not installed, or no point tried keeps every constraint.
        ScenarioError: With everything that is wrong with the study.
        KeyboardInterrupt: If it comes; what is done stays, and the same call goes on.
    """
    from escort_mj.study.engine import backends
    from escort_mj.study.search.evaluate import base_of
    from escort_mj.study.search.tune import TRIALS
    from escort_mj.study.search.tune import tune as search
    from escort_mj.study.search.tune_table import tuning_lines

    design, folder, count = lay_out(study, out, workers)
    with backends.local(count) as where, shown_progress("tuning", " trials", progress) as update:
        found = search(design, folder, where, update)
    section = design.study.tune
    assert section is not None, "tune has refused studies without it"
    lines = list(tuning_lines(found, section, {key: base_of(design, key) for key in section.over}))
    return StudyResult(design.study.study, folder, lines, _read_csv(folder / TRIALS), True, found)


def falsify(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    progress: ShowProgress = None,
) -> StudyResult:
    """Search the bounds of a study's section `falsify` for missions that break a verdict, and shrink them.

    Args:
        study: A study file, or the name of a shipped one.
        out: Folder of results; None for `renders/studies/NAME`.
        workers: Processes; None for one per core.
        progress: As for `sweep`.

    Returns:
        A table with a row for each counterexample: what breaks, its scenario file and its run folder.

    Raises:
        UsageError: If Optuna is not installed.
        ScenarioError: With everything that is wrong with the study.
        KeyboardInterrupt: If it comes; what is done stays, and the same call goes on.
    """
    import pandas

    from escort_mj.study.engine import backends
    from escort_mj.study.search.falsify import falsification_lines
    from escort_mj.study.search.falsify import falsify as search

    design, folder, count = lay_out(study, out, workers)
    with backends.local(count) as where, shown_progress("searching", " runs", progress) as update:
        found = search(design, folder, where, update)
    rows = [{"broken": one.broken, "message": one.message, **one.point} for one in found.counterexamples]
    files = [{"scenario": str(one.scenario), "folder": str(one.folder)} for one in found.counterexamples]
    table = pandas.DataFrame([row | file for row, file in zip(rows, files, strict=True)])
    lines = list(falsification_lines(found))
    return StudyResult(design.study.study, folder, lines, table, not found.counterexamples, found)


def kept_words(folder: Path) -> str:
    """What an interrupted study has left."""
    return f"runs that have ended are kept in {folder}; the same command goes on from there"


def _names(given: Sequence[str]) -> Sequence[str]:
    """Names that were given: several, or one text with commas between them."""
    return [given] if isinstance(given, str) else given


def _of_findings(name: str, folder: Path, found: Findings, table: pandas.DataFrame) -> StudyResult:
    return StudyResult(name, folder, found.lines, table, found.stated, found)


def _read_csv(path: Path) -> pandas.DataFrame:
    import pandas

    return pandas.read_csv(path)
