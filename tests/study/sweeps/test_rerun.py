"""A stored run made again: same bits, same metrics, other metrics, and what cannot be repeated."""

import json
import shutil
from pathlib import Path

import pytest

from escort_mj.api import run
from escort_mj.errors import RunFolderError, UsageError
from escort_mj.mission import fly
from escort_mj.record.folder import RERUN, RunFolder, free_place, read_run
from escort_mj.record.trace import save_trace
from escort_mj.scenario import parse_scenario
from escort_mj.study.sweeps.rerun import agreement_lines, rerun_folder

TEXT = """
name: five
duration: 3
robots: {count: 5}
sensing: {position: {noise: 0.02}, velocity: {noise: 0.01}}
expect: [{metric: contacts, at_most: 0}, {metric: radius_error_mean, at_most: 9, after: 1}]
"""


@pytest.fixture(scope="module")
def kept(compiled, tmp_path_factory):
    path = tmp_path_factory.mktemp("kept") / "run"
    run(parse_scenario(TEXT), path, figures=False, video=False)
    return path


@pytest.fixture
def stored(kept, tmp_path):
    return Path(shutil.copytree(kept, tmp_path / "run"))


def change(folder, **factors) -> None:
    """Multiplies stored signals from the middle of the run on."""
    trace = read_run(folder).trace
    for name, factor in factors.items():
        trace[name].values[trace.sizes["time"] // 2 :] *= factor
    save_trace(trace, folder / "trace.nc")


def test_the_same_program_gives_the_same_bits(stored, tmp_path):
    found = rerun_folder(stored, tmp_path / "again")
    assert found.same_bits and found.good
    assert found.versions == {} and found.until == pytest.approx(3.0)
    assert len(found.metrics) > 10 and set(found.gaps.values()) == {0.0}
    assert agreement_lines(found)[1:] == [f"same bits: {found.signals} signals up to 3 s"]
    assert read_run(tmp_path / "again").scenario_yaml == read_run(stored).scenario_yaml
    assert free_place(tmp_path / "again", RERUN) == tmp_path / "again"  # it may be made again


def test_one_changed_bit_is_found_at_its_place_and_time(stored):
    change(stored, tau=1.0 + 2.0**-52)
    found = rerun_folder(stored)
    assert found.differing == {"tau": pytest.approx(1.5)}
    assert not found.same_bits and found.good and not found.apart
    assert agreement_lines(found)[1] == f"  other bits in 1 of {found.signals} signals, first in tau at 1.5 s"
    assert agreement_lines(found)[-1] == f"other bits, same metrics: all {len(found.metrics)} within 0 %"


def test_metrics_agree_within_the_tolerance_and_no_further(stored):
    change(stored, e=1.001)
    near, far = rerun_folder(stored, tolerance=1e-2), rerun_folder(stored, tolerance=1e-5)
    assert near.good and not near.apart
    assert 1e-5 < near.gaps["tracking_error_rms"] <= 1.001e-3
    assert not far.good and list(far.apart) == ["tracking_error_rms", "tracking_error_max"]
    assert agreement_lines(far)[-1].startswith(
        f"other metrics: 2 of {len(far.metrics)} differ, the others within 0 %"
    )


def test_another_scenario_has_other_metrics_and_verdicts(stored):
    text = (stored / "resolved.yaml").read_text()
    assert "at_most: 9.0" in text
    (stored / "resolved.yaml").write_text(
        text.replace("at_most: 9.0", "at_most: 0.001").replace("mass: 1.0", "mass: 4.0")
    )
    found = rerun_folder(stored)
    assert not found.good and found.apart and "q" in found.differing
    (stored / "verdicts.json").write_text(
        (stored / "verdicts.json").read_text().replace("at most 9 m after 1 s", "at most 0.001 m after 1 s")
    )
    assert any("at most 0.001 m" in message for _, message in rerun_folder(stored).verdicts)


def test_versions_are_named(stored):
    trace = read_run(stored).trace
    now = trace.attrs["version_processor"]
    trace.attrs |= {"version_mujoco": "3.0.0", "version_processor": "x86_64-v0"}
    del trace.attrs["version_numba"]
    save_trace(trace, stored / "trace.nc")
    outcome = json.loads((stored / "outcome.json").read_text())
    outcome["versions"] |= {"mujoco": "3.1.0", "processor": "x86_64-v0"}
    (stored / "outcome.json").write_text(json.dumps(outcome))
    found = rerun_folder(stored)
    assert found.same_bits and set(found.versions) == {"mujoco", "numba", "processor"}
    assert found.versions["mujoco"][0] == "3.0.0" and found.versions["numba"][0] == ""
    assert found.versions["processor"] == ("x86_64-v0", now)
    assert "edited  outcome.json says mujoco 3.1.0, trace.nc says 3.0.0" in found.notes
    assert any(line.startswith("  other version  mujoco: 3.0.0 then, ") for line in agreement_lines(found))


def test_a_stopped_run_is_compared_as_far_as_it_came(tmp_path, compiled, monkeypatch):
    import escort_mj.mission as mission

    monkeypatch.setattr(mission, "BLOCK", 16)

    def stop(done: float, total: float) -> None:
        if done > 1.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), RunFolder.create(tmp_path / "run") as folder:
        fly(parse_scenario(TEXT), folder, stop)
    assert read_run(tmp_path / "run").outcome["outcome"] == "interrupted"
    found = rerun_folder(tmp_path / "run")
    assert found.same_bits and 1.0 < found.until < 2.0


class TestNothingToRepeat:
    def test_no_run_folder(self, tmp_path):
        with pytest.raises(RunFolderError, match=r"outcome\.json"):
            rerun_folder(tmp_path)

    def test_no_scenario(self, stored):
        for name in ("scenario.yaml", "resolved.yaml"):
            (stored / name).unlink()
        with pytest.raises(UsageError, match="recorded nothing, so there is nothing to repeat"):
            rerun_folder(stored)

    def test_onto_itself(self, stored, tmp_path):
        before = json.loads((stored / "outcome.json").read_text())
        with pytest.raises(UsageError, match="is the run folder that is compared"):
            rerun_folder(stored, tmp_path / "run" / ".." / "run")
        assert json.loads((stored / "outcome.json").read_text()) == before
