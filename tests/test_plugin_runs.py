"""Runs with laws of plugins: in the native loop, in both forms, and what becomes of errors."""

import json
import re

import numpy as np
import pytest

from escort_mj import api
from escort_mj.cli.app import BROKEN
from escort_mj.mission.batch import fly_many
from escort_mj.record.folder import read_run
from escort_mj.record.outcome import Outcome
from escort_mj.study.sweeps.rerun import agreement_lines, rerun_folder
from tests.plugged import COMPILED, LAW, SCENARIO

SIGNALS = ("q", "tau", "rho_hat")


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("plugins")
    (made / "own_law.py").write_text(LAW + COMPILED)
    (made / "plain.py").write_text(LAW.replace('"pid"', '"plain"'))
    (made / "own.yaml").write_text(SCENARIO)
    return made


def flown(folder, *overrides, out=None):
    return api.run(
        api.load_scenario(folder / "own.yaml", overrides, [str(folder / "plain.py")]),
        out, figures=False, video=False,
    )  # fmt: skip


def worst(run, other):
    return max(np.abs(run.trace[name].values - other.trace[name].values).max() for name in SIGNALS)


def test_the_compiled_form_of_a_built_in_law_has_its_bits(compiled, folder):
    ours = flown(folder)
    built_in = "controller={law: apd_smc, switching_gain: 0, adaptation_rate: 20, initial_estimate: 0}"
    assert worst(ours, flown(folder, built_in)) == 0.0
    assert float(np.abs(ours.trace["tau"]).max()) > 1.0


def test_numpy_and_compiled_forms_agree_to_rounding(compiled, folder):
    assert worst(flown(folder), flown(folder, "controller=plain")) < 1e-9


@pytest.mark.parametrize("law", ["pid", "plain"])
def test_threads_have_the_bits_of_one(compiled, folder, law):
    scenario = api.load_scenario(folder / "own.yaml", [f"controller={law}"], [str(folder / "plain.py")])
    alone, *beside = fly_many([scenario] * 4, threads=2, traces=True)
    for name in SIGNALS:
        assert all(run.trace[name].values.tobytes() == alone.trace[name].values.tobytes() for run in beside)


@pytest.mark.parametrize("law", ["pid", "plain"])
def test_an_error_ends_the_run_with_its_place(compiled, folder, tmp_path, law):
    run = flown(folder, f"controller={{law: {law}, fails_at: 1.23}}", out=tmp_path / "run")
    file = folder / {"pid": "own_law.py", "plain": "plain.py"}[law]
    last = [k for k, line in enumerate(file.read_text().splitlines(), 1) if "raise" in line][-1]
    assert run.outcome is Outcome.FAILED
    assert run.message == f"a plugin raised an error at 1.23 s: {file}:{last}: ZeroDivisionError: told to"
    stored = read_run(tmp_path / "run")
    assert stored.outcome["message"] == run.message
    assert float(stored.trace["time"][-1]) == pytest.approx(1.22)
    assert np.isfinite(stored.trace["tau"].values).all()


def test_a_force_that_is_no_number_is_put_down_to_the_law(compiled, folder):
    """Between two samples, and for a moment only."""
    nan = "nan = np.zeros(r.e.shape)\n        nan[1, 0] = np.nan if abs(r.time - 0.134) < 5e-4 else 0.0\n"
    text = LAW.replace('"pid"', '"nan"').replace(
        "        return r.rho_hat", f"        {nan}        return nan + r.rho_hat"
    )
    (folder / "nan.py").write_text(f"import numpy as np\n{text}")
    run = api.run(api.load_scenario(folder / "own.yaml", ["controller=nan"], [str(folder / "nan.py")]))
    assert run.outcome is Outcome.FAILED
    assert run.message.startswith("a plugin raised an error at 0.13 s: ")
    assert re.search(r"nan.py:\d+: Pid gave robot 2 a force that is not a finite number$", run.message)


def test_a_force_that_mujoco_does_not_take_is_put_down_to_the_law(compiled, folder):
    run = flown(folder, "controller={law: pid, proportional_gain: 1e300}")
    assert run.outcome is Outcome.UNSTABLE
    assert re.search(r"BADCTRL .*; the law pid demanded .*e\+\d+ N of robot \d at \d", run.message)


def test_an_error_in_the_first_step_leaves_a_readable_folder(compiled, folder, tmp_path):
    run = flown(folder, "controller={law: plain, fails_at: 0}", out=tmp_path / "run")
    assert run.outcome is Outcome.FAILED
    assert read_run(tmp_path / "run").trace.sizes["time"] == 0


def test_the_command_line_exits_with_3(compiled, folder, tmp_path):
    from typer.testing import CliRunner

    from escort_mj.cli import app

    words = [
        "run",
        str(folder / "own.yaml"),
        "--set",
        "controller.fails_at=0.5",
        "--out",
        str(tmp_path / "x"),
    ]
    result = CliRunner().invoke(app, [*words, "--no-video", "--no-figures"])
    assert result.exit_code == BROKEN
    assert "own_law.py:" in result.output


class TestRecords:
    def test_a_run_keeps_the_plugin_and_its_digest_and_rerun_says_if_it_changed(
        self, compiled, folder, tmp_path
    ):
        file = tmp_path / "own_law.py"
        file.write_text(LAW)
        (tmp_path / "own.yaml").write_text(SCENARIO)
        api.run(tmp_path / "own.yaml", tmp_path / "run", figures=False, video=False)
        kept = tmp_path / "run" / "plugins" / "own_law.py"
        assert kept.read_text() == LAW
        versions = json.loads((tmp_path / "run" / "outcome.json").read_text())["versions"]
        assert versions["plugin_own_law.py"].startswith("sha256 ")
        assert not [one for one in rerun_folder(tmp_path / "run").notes if one.startswith("plugin")]
        file.write_text(LAW.replace("= 30.0", "= 3.0"))
        found = rerun_folder(tmp_path / "run")
        assert found.same_bits
        assert "own_law.py: has changed since" in "\n".join(agreement_lines(found))
        file.unlink()
        assert "is no longer at" in "\n".join(agreement_lines(rerun_folder(tmp_path / "run")))


def test_a_study_runs_them_in_worker_processes_and_knows_their_content(compiled, folder, tmp_path):
    from escort_mj.study.sweeps.definition import load_study
    from escort_mj.study.sweeps.design import Design

    (tmp_path / "own_law.py").write_text(LAW)
    (tmp_path / "own.yaml").write_text(SCENARIO)
    (tmp_path / "study.yaml").write_text(
        "{study: gains, scenario: own.yaml, set: {duration: 0.5}, "
        "vary: {controller.proportional_gain: [10, 20]}}"
    )
    design = Design(load_study(tmp_path / "study.yaml"), tmp_path)
    keys = [run.key for run in design.runs()]
    from escort_mj.study.engine.backends import local
    from escort_mj.study.engine.work import perform
    from escort_mj.study.sweeps.sweep import job_of

    jobs = [job_of(design, run, tmp_path / "out") for run in design.runs()]
    with local(2) as backend:
        rows = [row for _, row in backend(perform, jobs)]
    assert [row.outcome for row in rows] == ["completed", "completed"]
    (tmp_path / "own_law.py").write_text(LAW + "\n")
    changed = Design(load_study(tmp_path / "study.yaml"), tmp_path)
    assert not set(keys) & {run.key for run in changed.runs()}
