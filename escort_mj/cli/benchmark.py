"""The command `benchmark`: missions on worlds that others drew."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from escort_mj.cli.app import (
    BROKEN,
    GOOD,
    JsonOption,
    SetOption,
    WorkersOption,
    app,
    complete,
    finish,
    progress_bar,
)


@app.command("benchmark")
def benchmark_command(
    name: Annotated[Literal["gcbf"], typer.Argument(help="The benchmark: gcbf (docs/gcbf.md).")],
    worlds: Annotated[
        str | None,
        typer.Option(metavar="FILE|NAME", help="File of worlds, or shipped worlds: n8, n32 [default: n8]."),
    ] = None,
    agents: Annotated[
        int | None, typer.Option(min=1, help="Draw worlds by the published rules, with this many agents.")
    ] = None,
    area: Annotated[float, typer.Option(min=0.5, help="Side of the square of drawn worlds [m].")] = 4.0,
    obstacles: Annotated[int, typer.Option(min=0, help="Number of boxes in drawn worlds.")] = 8,
    travel: Annotated[
        float | None,
        typer.Option(min=0.5, help="Largest distance along an axis from start to goal in drawn worlds [m]."),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(min=1, help="Number of worlds [default: all in a file, or 32 drawn worlds]."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of drawn worlds.")] = 0,
    environment: Annotated[
        Literal["DoubleIntegrator", "LinearDrone", "CrazyFlie"],
        typer.Option(help="Published dynamics of drawn worlds."),
    ] = "DoubleIntegrator",
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Scenario with behaviors, law and sensing [default: that of the environment].",
            autocompletion=complete.scenarios,
        ),
    ] = None,
    overrides: SetOption = None,
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the worlds of a published benchmark, and compare with published controllers.

    Example: escort-mj benchmark gcbf --worlds n32

    Example: escort-mj benchmark gcbf --agents 16 --area 4 --obstacles 8 --episodes 50 --seed 3

    Example: escort-mj benchmark gcbf --environment CrazyFlie --agents 8 --area 2
    """
    from escort_mj.api import benchmarks

    with progress_bar("flying", " episodes") as progress:
        found = benchmarks.gcbf(
            worlds,
            agents=agents,
            area=area,
            obstacles=obstacles,
            travel=travel,
            episodes=episodes,
            seed=seed,
            environment=environment,
            scenario=scenario,
            overrides=overrides or (),
            workers=workers,
            progress=progress or False,
        )
    broken = any(row.outcome != "completed" for row in found.rows)
    finish("benchmark", as_json, found.lines, BROKEN if broken else GOOD, benchmark=name, **found.document())
