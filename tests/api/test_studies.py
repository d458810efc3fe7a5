"""Studies from Python: the commands' engines, with results as tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import escort_mj
from escort_mj.errors import UsageError
from escort_mj.study.sweeps.definition import load_study

SCENARIO = """
name: one
duration: 0.2
robots: {positions: [[5, 0]], force_limit: 10}
expect: [{metric: radius_error_max, at_most: 1}]
"""
STUDY = """
study: small
scenario: one.yaml
vary: {robots.mass: [1, 2]}
seeds: 2
tune:
  over: {controller.slope: {low: 1, high: 30}}
  objectives: [{metric: tracking_error_rms}]
  trials: 2
  held_out: 0
falsify:
  over: {robots.radius: {low: 0.1, high: 0.2}}
  runs: 4
"""


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: None) -> str:
    """A study file in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    Path("one.yaml").write_text(SCENARIO)
    Path("study.yaml").write_text(STUDY)
    return "study.yaml"


def test_a_sweep_is_a_table_and_goes_on(study: str) -> None:
    done: list[tuple[float, float]] = []

    def interrupt(*progress: float) -> None:
        done.append(progress)
        if len(done) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="2 of 4 runs are kept in renders/studies/small"):
        escort_mj.sweep(study, workers=1, confirmed=True, progress=interrupt)
    result = escort_mj.sweep(study, workers=1, confirmed=True)
    assert result.folder == Path("renders/studies/small") and result.passed
    assert result.lines == ["small: 4 runs in 2 cells: 2 new, 2 from earlier; 0 failed, 0 of them broke"]
    assert result.table["robots.mass"].tolist() == [1, 2, 1, 2] and result.table["passed"].all()
    assert result.table["force_rms"].dtype == float
    assert (
        result.table.attrs["units"]["force_rms"] == result.to_dataframe().attrs["units"]["force_rms"] == "N"
    )
    assert result.to_dataframe() is not result.table and repr(result).startswith("<small: 4 rows in ")
    assert "small: 4 runs" in result._repr_html_() and "<table" in result._repr_html_()
    assert Path(result.report()).name == "report.html"


def test_tuning_and_falsifying_are_tables(study: str) -> None:
    tuned = escort_mj.tune(study, "tuned", workers=1)
    assert len(tuned.table) == 3 and "controller.slope" in tuned.table
    best = escort_mj.load_scenario("tuned/best.yaml")
    assert best.controller.slope == pytest.approx(tuned.found.best.point["controller.slope"])
    nothing = escort_mj.falsify(study, "searched", workers=1)
    assert nothing.passed and nothing.table.empty and nothing.lines[0].startswith("nothing found in")


def test_a_study_may_be_a_mapping(study: str) -> None:
    keys = {"study": "keys", "scenario": "one.yaml", "vary": {"robots.mass": np.array([1.0, 2.0])}}
    result = escort_mj.sweep(keys, "out", workers=1, confirmed=True)
    assert result.table["robots.mass"].tolist() == [1.0, 2.0]
    assert load_study("out/study.yaml").study.vary == {"robots.mass": (1.0, 2.0)}
    again = escort_mj.sweep(keys, "out", workers=1)
    assert " 0 new, 2 from earlier" in again.lines[0]
    with pytest.raises(escort_mj.ScenarioError, match=r"masss\[0\]: .*robots.masss: is not a key"):
        escort_mj.sweep(keys | {"vary": {"robots.masss": [1]}})
    with pytest.raises(
        escort_mj.ScenarioError, match=r"vary.robots.mass\[0\]: found 1j; expected text, a num"
    ):
        escort_mj.falsify(keys | {"vary": {"robots.mass": [1j]}})


def test_where_a_study_cannot_be_made_is_one_error(study: str) -> None:
    escort_mj.run("one.yaml", "kept", figures=False, video=False)
    for make in (escort_mj.sweep, escort_mj.tune, escort_mj.falsify):
        with pytest.raises(UsageError, match="kept: holds a run; choose another folder"):
            make(study, "kept", workers=1)
    with pytest.raises(UsageError, match="kept: holds a run"):
        escort_mj.compare("one.yaml", "pd", out="kept", workers=1, duration=0.1)
    assert escort_mj.open_run("kept").scenario.duration == 0.2
    with pytest.raises(UsageError, match='--scheduler "foo": is for --backend dask; found --ba'):
        escort_mj.sweep(study, scheduler="foo")


@pytest.mark.parametrize("address", ["nonsense", "", "foo://x:1", "tcp://127.0.0.1:abc", "tls://x:1"])
def test_what_is_no_address_of_a_cluster_is_one_error(study: str, address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(UsageError, match=f'no cluster answers at "{address}": '):
        escort_mj.sweep(study, backend="dask", scheduler=address)
    import dask

    assert dask.config.get("scheduler", None) is None  # what the user computes with Dask goes on
