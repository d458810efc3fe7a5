"""The runs of the reproduction, those that have not been made before, its table and its figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from escort_mj.record.files import write_json, write_text
from escort_mj.record.outcome import FINAL
from escort_mj.study.compare.measured import Measured, measured
from escort_mj.study.compare.reproduction import (
    PaperFigure,
    PaperRun,
    chosen_figures,
    needed,
    paper_scenario,
    simulations,
)
from escort_mj.study.compare.runs import Findings, RunJob, finished, lines_of, run_once
from escort_mj.study.compare.table import claims_document, claims_markdown, claims_summary
from escort_mj.study.engine.parallel import cores, side_by_side

Draw = Callable[[Path, Sequence[Measured], PaperFigure], Path]


class Done(NamedTuple):
    """What came of a task: what was measured, and whether it ran now."""

    measured: Measured
    ran: bool


def fly_simulation(task: RunJob[PaperRun]) -> Done:
    """Run a simulation, unless its folder holds it already, and measure it.

    Raises:
        UsageError: If the folder holds something else, or another process is writing in it.
    """
    ended = run_once(task)
    return Done(measured(task.what, ended.outcome, ended.message, ended.trace), ended.ran)


def reproduce_paper(
    scenarios: Path,
    out: Path,
    draw: Draw,
    only: Sequence[str] = (),
    workers: int | None = None,
    again: bool = False,
    progress: Callable[[float, float], None] | None = None,
) -> Findings:
    """Run the paper's simulations, those that have not run before, draw its figures and write the table.

    Args:
        scenarios: Folder of the shipped scenarios.
        out: Where everything goes; simulations that ended there before are not run again.
        draw: Draws a figure of such a folder, given what was measured, and returns its file. Of the top
            level of a module, since other processes call it.
        only: Figures by their numbers; empty for all. The table covers every simulation that has run.
        workers: Processes; None for one per core.
        again: Run everything that is asked for again.
        progress: Called with the simulations and figures done and to do.

    Raises:
        UsageError: If there is no such figure, or a folder holds something else.
    """
    figures = chosen_figures(only)
    workers = cores() if workers is None else workers
    wanted = needed(figures) if only else simulations()

    def task(simulation: PaperRun) -> RunJob[PaperRun]:
        return RunJob(simulation, paper_scenario(simulation, scenarios), out / simulation.name, again)

    tasks = [task(simulation) for simulation in wanted]
    steps = len(tasks) + len(figures)

    def report(offset: int) -> Callable[[float, float], None] | None:
        return None if progress is None else lambda done, total: progress(offset + done, steps)

    done = side_by_side(fly_simulation, tasks, workers, report(0))
    measured = [each.measured for each in done]
    known = {run.simulation: run for run in measured}
    others = [task(simulation) for simulation in simulations() if simulation not in known]
    known |= {run.simulation: run for run in map(measured_before, others) if run is not None}
    runs = [known[simulation] for simulation in simulations() if simulation in known]

    lost = {run.simulation for run in measured if run.outcome not in FINAL}
    drawable = [each for each in figures if each.kind == "laws" or not lost.intersection(needed([each]))]
    files = side_by_side(partial(draw, out, tuple(runs)), drawable, workers, report(len(tasks)))

    write_json(out / "table.json", claims_document(runs))
    write_text(out / "table.md", claims_markdown(runs))
    ended = [(run.simulation.name, run.outcome, run.message, ran) for run, ran in done]
    lines = lines_of("simulations", ended) + claims_summary(runs)
    written = ["table.md", "table.json", f"figures/ ({len(files)})"]
    return Findings(lines, written, not lost)


def measured_before(task: RunJob[PaperRun]) -> Measured | None:
    """Measure a simulation that has ended before; None if there is no such run."""
    stored = finished(task)
    if stored is None:
        return None
    return measured(task.what, stored.outcome["outcome"], stored.outcome["message"], stored.trace)
