"""The runs of a comparison of laws and outer loops, those that have not been made before, and its tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.errors import UsageError
from escort_mj.measuring import measure
from escort_mj.record.files import write_json, write_text
from escort_mj.record.outcome import Outcome
from escort_mj.record.window import Span, span_faults
from escort_mj.scenario import Scenario
from escort_mj.scenario.reader.catalog import catalog_of
from escort_mj.study.compare.comparison import (
    OUTERS,
    QUANTITIES,
    TRUE_ERROR,
    TRUE_PEAK,
    Result,
    Trial,
    chosen_names,
    span_of,
    trials,
)
from escort_mj.study.compare.comparison_table import (
    around_marks,
    comparison_document,
    comparison_latex,
    comparison_page,
    comparison_summary,
    into_page,
    runs_table,
)
from escort_mj.study.compare.laws import controller_of, outer_of
from escort_mj.study.compare.measured import true_error_rms
from escort_mj.study.compare.runs import Findings, RunJob, lines_of, run_once
from escort_mj.study.engine.parallel import cores, side_by_side

if TYPE_CHECKING:
    import xarray

Draw = Callable[[Path, Scenario, Sequence[Result], Span | None], Sequence[Path]]


def compare_controllers(
    scenario: Scenario,
    out: Path,
    draw: Draw,
    laws: Sequence[str] = (),
    outers: Sequence[str] = (),
    seeds: int = 1,
    workers: int | None = None,
    docs: Path | None = None,
    again: bool = False,
    progress: Callable[[float, float], None] | None = None,
    over: Span | None = None,
) -> Findings:
    """Run a scenario under several laws and outer loops, where that has not been done, and compare them.

    Args:
        scenario: What to run; its own law's gains go to the other laws where they mean the same.
        out: Where everything goes; runs that ended there before are not run again.
        draw: Draws the figures into that folder from its runs, and returns their files.
        laws: Names of laws, each of them one or several between commas; empty for all.
        outers: Names of outer loops, likewise; empty for the scenario's own.
        seeds: How many seeds, from the scenario's own upward.
        workers: Processes; None for one per core.
        docs: A page of the docs with marks that the table goes between.
        again: Run everything again.
        progress: Called with the runs done and to do.
        over: The part of each run that quantities look at; None for that of each.

    Raises:
        UsageError: If there is no such law or outer loop, a folder holds something else, or the
            page has no marks, or there is no such part of a run.
        ScenarioError: If a seed leaves no room for robots that are placed at random.
    """
    check_span(over, scenario.duration)
    known = [model.model_fields["law"].default for model in catalog_of(scenario).laws]
    names = chosen_names("--laws", laws, known, known)
    if docs is not None:
        around_marks(docs, scenario)
    loops = chosen_names("--outer", outers, OUTERS, [scenario.mission.outer.loop])
    wanted = trials(names, loops, [scenario.seed + index for index in range(seeds)])
    tasks = [RunJob(trial, trial_scenario(scenario, trial), out / trial.name, again) for trial in wanted]
    workers = cores() if workers is None else workers
    results = side_by_side(partial(fly_trial, over=over), tasks, workers, progress)

    write_json(out / "table.json", comparison_document(scenario, results, over))
    write_text(out / "table.csv", runs_table(results, over))
    write_text(out / "table.md", comparison_page(scenario, results, over))
    write_text(out / "table.tex", comparison_latex(scenario, results, over))
    if docs is not None:
        write_text(docs, into_page(docs, scenario, results, over))
    files = draw(out, scenario, results, over)
    ended = [(result.trial.name, result.outcome, result.message, result.ran) for result in results]
    lines = lines_of("runs", ended)
    written = ["table.md", "table.tex", "table.csv", "table.json", f"figures/ ({len(files)})"]
    return Findings(
        lines + comparison_summary(scenario, results, over), written, all(result.stated for result in results)
    )


def trial_scenario(base: Scenario, trial: Trial) -> Scenario:
    """The scenario with what a trial changes: the law of all robots, outer loop, seed; it expects nothing.

    Raises:
        ScenarioError: If a seed leaves no room for robots that are placed at random.
    """
    return base.replace(
        {
            "name": trial.name,
            "seed": trial.seed,
            "controller": controller_of(base, trial.law),
            **{f"teams.{team}.controller": None for team in range(len(base.teams))},
            "mission.outer": outer_of(base, trial.outer),
            "expect": (),
        }
    )


def check_span(over: Span | None, duration: float) -> None:
    """Refuse a part of a run that runs of a duration [s] do not have.

    Raises:
        UsageError: If it is none.
    """
    if over is None:
        return
    for words in span_faults(over.over, over.after or None, over.before):
        raise UsageError(f"--over, --after, --before: {words}")
    if over.after >= duration or (over.before or 0.0) > duration:
        key, time = ("--after", over.after) if over.after >= duration else ("--before", over.before)
        raise UsageError(f"{key} {time:g}: the run ends at {duration:g} s")


def fly_trial(task: RunJob[Trial], over: Span | None = None) -> Result:
    """Run a trial, unless its folder holds it already, and measure it over a part of it."""
    ended = run_once(task)
    values: dict[str, float | None] = dict.fromkeys(QUANTITIES)
    if ended.trace is not None and ended.outcome == Outcome.COMPLETED.value:
        values = compared_values(ended.trace, over)
    return Result(task.what, ended.outcome, ended.message, values, ended.ran)


def compared_values(trace: xarray.Dataset, over: Span | None = None) -> dict[str, float | None]:
    """All quantities of a run that reached its end, each over its own part of it."""
    spans = {name: span_of(name, over) for name in QUANTITIES}
    parts = {span: span.of(trace) for span in set(spans.values())}

    def value(name: str) -> float | None:
        part = parts[spans[name]]
        if name == TRUE_PEAK:
            return float(np.linalg.norm(part["q_d"].values - part["q"].values, axis=2).max())
        return true_error_rms(part, "q") if name == TRUE_ERROR else measure(name, part).value

    return {name: value(name) for name in QUANTITIES}
