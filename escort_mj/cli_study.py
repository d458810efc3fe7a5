"""Commands for many runs: sweep, report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from escort_mj.cli import BROKEN, GOOD, VERDICT_FAILED, _progress, _shown, app


@app.command()
def sweep(
    study: Annotated[Path, typer.Argument(help="A study file.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of results [default: renders/studies/NAME].")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: as many as cores].")] = None,
    backend: Annotated[Literal["local", "dask"], typer.Option(help="Where runs are computed.")] = "local",
    scheduler: Annotated[
        str | None, typer.Option(help="A running Dask scheduler, such as tcp://host:8786 [default: our own].")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Begin however large the study is.")] = False,
) -> None:
    """Make the runs of a study that have not been made yet; interrupted or killed, it goes on where it was.

    Example: escort-mj sweep scenarios/studies/minute.yaml --workers 2
    """
    from escort_mj import api
    from escort_mj.study import backends
    from escort_mj.study.definition import load_study
    from escort_mj.study.design import Design
    from escort_mj.study.parallel import cores
    from escort_mj.study.sweep import sweep as make_runs

    design = Design(load_study(study), api.scenarios_folder())
    folder = out if out is not None else Path("renders") / "studies" / design.study.study
    count = cores() if workers is None else workers
    where = backends.local(count) if backend == "local" else backends.dask(count, scheduler)
    with _progress("sweeping", " runs") as progress:
        done = make_runs(design, folder, where, count, yes, progress)
    typer.echo(
        f"{design.study.study}: {done.runs} runs in {len(design.cells)} cells: {done.made} made now, "
        f"{done.runs - done.made} had been made before; {done.failed} failed, {done.broken} of them broke"
    )
    typer.echo(f"wrote {_shown(folder)}: results.sqlite runs.csv study.yaml")
    raise typer.Exit(BROKEN if done.broken else VERDICT_FAILED if done.failed else GOOD)
