"""A program as users write it, with the whole public API; mypy checks it strictly (tests/test_types.py)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import escort_mj
from escort_mj.testing import assert_metric, assert_no_contacts, assert_settled


def scenarios() -> list[escort_mj.Scenario]:
    """Scenarios from files, mappings and keys."""
    main = escort_mj.load_scenario("main", {"duration": 20, "robots.mass": np.float64(2.0)})
    own = escort_mj.load_scenario({"robots": {"count": 3}}, ["duration=5"])
    built = escort_mj.Scenario(duration=5, robots={"positions": np.zeros((1, 2))})
    heavier = main.replace({"robots.mass": 3}, seed=4).replace(duration=10)
    return [main, own, built, heavier]


def runs(folder: Path) -> escort_mj.Run:
    """Runs in memory and from folders."""
    run = escort_mj.run(scenarios()[0], folder, overwrite=True, video=False)
    assert run.outcome is escort_mj.Outcome.COMPLETED and run.outcome.good and run.passed
    error: float = run.values["radius_error_mean"]
    words: list[str] = [verdict.message for verdict in run.verdicts if not verdict.passed]
    print(run, run.name, run.message, error, words, run.metrics["contacts"]["unit"], run.folder)
    print(run.trace["q"].isel(time=-1).values, run.scenario.duration, run.figures)
    run.plot("paths").savefig(folder / "paths.pdf")
    run.to_dataframe(["q", "tau"]).to_csv(folder / "signals.csv")
    print(run.summary()["force_rms"], run.report(), run.video(speed=8).path, run.export(folder / "run.csv"))
    return escort_mj.open_run(folder)


def studies() -> None:
    """Many runs, and studies."""
    table = escort_mj.table(escort_mj.run_many(scenarios(), threads=2))
    print(table["force_rms"].mean(), escort_mj.__version__)
    for result in (
        escort_mj.sweep("studies/minute", workers=2, confirmed=True),
        escort_mj.compare("main", ["pd", "apd_smc"], seeds=3),
        escort_mj.tune("studies/tune_apd_smc"),
        escort_mj.falsify("studies/falsify_main", progress=False),
        escort_mj.reproduce([5, 6]),
    ):
        print(result.name, result.folder, result.passed, result.table.describe(), result.to_dataframe())


def test_the_team_gathers() -> None:
    """Assertions on a run."""
    try:
        run = escort_mj.run("main")
    except (escort_mj.ScenarioError, escort_mj.EscortError) as error:
        raise SystemExit(str(error)) from None
    assert_no_contacts(run, between=("robots", "obstacles"))
    assert_settled(run, within=0.05, by=40)
    assert_metric(run, "force_rms", at_most=50.0)
    assert_metric(run, "chattering", at_most=1e6, over="tail")
