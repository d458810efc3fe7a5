"""Whole runs: what is sampled, how runs end, and that they repeat to the bit."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest

import escort_mj
from escort_mj import Outcome
from escort_mj.mission import fly
from escort_mj.record.folder import RunFolder
from escort_mj.scenario import Scenario

SHORT = ["duration=3", "expect=[]"]


def run(name: str, *overrides: str, out: Path | None = None) -> escort_mj.Run:
    return escort_mj.run(escort_mj.load_scenario(name, [*SHORT, *overrides]), out, figures=False, video=False)


@pytest.mark.parametrize("name", ["main", "paper/case1_3d"])
def test_all_control_signals_of_a_sample_belong_to_one_evaluation(name: str) -> None:
    result = run(name)
    trace = result.trace
    np.testing.assert_array_equal(trace.e, trace.q_d - trace.q_measured)
    np.testing.assert_array_equal(trace.e_dot, trace.v_d - trace.v_measured)
    slope = result.scenario.controller.slope
    np.testing.assert_allclose(trace.s, trace.e_dot + slope * trace.e, rtol=1e-14, atol=1e-14)
    law = result.scenario.controller
    tau = trace.rho_hat + law.proportional_gain * trace.e + law.derivative_gain * trace.e_dot
    tau = tau + law.switching_gain * np.tanh(trace.s)
    np.testing.assert_allclose(trace.tau, tau, rtol=1e-12, atol=1e-10)
    np.testing.assert_array_equal(trace.force, np.clip(trace.tau, -10.0, 10.0))


def test_samples_begin_at_the_start_and_come_at_the_recording_rate_and_at_the_end() -> None:
    positions = [[5, 1], [-4, 3], [0, -6]]
    result = run("main", f"robots={{positions: {positions}}}", "recording.rate=25", "duration=2.03")
    np.testing.assert_allclose(result.trace.time, [*(np.arange(51) * 0.04), 2.03], atol=1e-12)
    np.testing.assert_array_equal(result.trace.q[0], positions)
    np.testing.assert_array_equal(result.trace.q_d[0], positions)
    assert result.outcome is Outcome.COMPLETED


def test_without_noise_measurements_are_true() -> None:
    trace = run("main", "sensing={}").trace
    np.testing.assert_array_equal(trace.q, trace.q_measured)
    np.testing.assert_array_equal(trace.v, trace.v_measured)


def test_runs_repeat_to_the_bit_and_another_seed_has_others() -> None:
    """Side by side, too: tests/mission/test_batch.py, and of threads of one's own tests/world."""
    one, again, other = (run("sensing", "duration=0.3", f"seed={seed}").trace for seed in (8, 8, 9))
    assert one.drop_attrs().identical(again.drop_attrs())
    assert not np.array_equal(one.q, other.q)


def test_the_paper_as_printed_diverges_in_space_and_leaves_a_readable_folder(tmp_path: Path) -> None:
    scenario = escort_mj.load_scenario("paper/case1_3d", ["controller.anti_windup=false"])
    result = escort_mj.run(scenario, tmp_path, figures=False, video=False)
    assert result.outcome is Outcome.DIVERGED and not result.passed
    stored = escort_mj.open_run(tmp_path)
    assert stored.outcome == "diverged"
    assert "m from the target at" in stored.message
    for name, variable in stored.trace.variables.items():
        if variable.dtype.kind == "f":
            assert not np.isnan(variable.values).any(), name
    assert "NaN" not in (tmp_path / "metrics.json").read_text()
    again = escort_mj.load_scenario(tmp_path / "scenario.yaml")
    assert again == scenario


def test_a_warning_of_mujoco_is_an_outcome(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A milligram under a meganewton: an acceleration that MuJoCo calls bad."""
    monkeypatch.chdir(tmp_path)
    result = run(
        "main",
        "robots.mass=1e-6",
        "robots.force_limit=1e6",
    )
    assert result.outcome is Outcome.UNSTABLE
    assert "BADQACC" in result.message
    assert np.isfinite(result.trace.q).all()
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_a_force_that_mujoco_does_not_take_is_put_down_to_the_law_of_the_team() -> None:
    changes = {"duration": 0.2, "expect": [], "teams[0].demand": [], "robots.force_limit": None}
    stiff = {"law": "pd", "proportional_gain": 1e15}
    run = fly(escort_mj.load_scenario("pursuit/two_laws", {**changes, "teams[1].controller": stiff}))
    assert run.outcome is Outcome.UNSTABLE and "; the law pd demanded" in run.message
    assert run.trace.attrs["law"] == "apd_smc (north), pd (south)"


def test_a_robot_with_a_law_of_its_own_moves_as_if_all_had_it() -> None:
    """Robots that ask nothing of each other, in two runs of different laws and in one of both."""
    keys = {"duration": 4, "expect": [], "obstacles": [], "mission.behaviors": ["surface"]}
    pd = {"law": "pd", "slope": 7.0}
    one, other = (fly(escort_mj.load_scenario("main", keys | {"controller": law})) for law in ("asmc", pd))
    both = escort_mj.load_scenario(
        "main", keys | {"controller": "asmc", "robots.overrides": [{"robot": 2, "controller": pd}]}
    )
    found = fly(both).trace
    for name in ("q", "tau", "rho_hat", "s"):
        np.testing.assert_array_equal(found[name][:, 1], other.trace[name][:, 1])
        np.testing.assert_array_equal(found[name][:, 0], one.trace[name][:, 0])
    assert found.attrs["law"] == "asmc, pd (robot 2)"


def test_a_run_that_diverged_knows_nothing_of_what_came_after_its_last_sample() -> None:
    """Robot 1 leaves at 500 m/s while the others touch: cut off, they are as in a run that ends there."""
    robots = {
        "positions": [[3, 0], [0, 10], [0.56, 10]],
        "velocities": [[500, 0], [0.5, 0], [-0.5, 0]],
        "force_limit": 1e-12,
    }
    mission = {"radius": 5, "behaviors": ["surface"]}
    keys = {"name": "leaves", "robots": robots, "mission": mission, "target": {"position": [0, 0]}}
    gone = fly(Scenario.model_validate(keys | {"duration": 20}))
    assert gone.outcome is Outcome.DIVERGED
    end = gone.metrics["run"]["simulated_time"]
    assert end == pytest.approx(0.196)
    whole = fly(Scenario.model_validate(keys | {"duration": end}))
    assert whole.trace.sizes["episode"] == 1 and float(whole.trace["episode_end"][0]) == pytest.approx(0.198)
    assert gone.trace.drop_attrs().identical(whole.trace.drop_attrs())
    assert gone.metrics["run"]["steps"] == whole.metrics["run"]["steps"] == 99


def test_callbacks_are_gone_after_a_run() -> None:
    run("main", "duration=0.1")
    assert mujoco.get_mjcb_control() is None and mujoco.get_mjcb_sensor() is None


LONG = (
    "import signal, sys, escort_mj; "
    "signal.signal(signal.SIGINT, signal.default_int_handler); "  # a shell's background ignores it
    "escort_mj.run(escort_mj.load_scenario('main', ['duration=100000', 'recording.rate=10', 'expect=[]']), "
    "sys.argv[1], figures=False, video=False)"
)


def started(folder: Path) -> subprocess.Popen[bytes]:
    """A child in the middle of a long run."""
    child = subprocess.Popen([sys.executable, "-c", LONG, str(folder)], stderr=subprocess.PIPE)
    samples = folder / "journal" / "samples.f64"
    deadline = time.monotonic() + 120.0
    while not (samples.exists() and samples.stat().st_size > 500_000):
        assert child.poll() is None, child.stderr and child.stderr.read().decode()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return child


def test_a_killed_run_opens_and_says_how_far_it_came(tmp_path: Path) -> None:
    child = started(tmp_path / "run")
    live = escort_mj.open_run(tmp_path / "run")
    assert live.outcome == "running"
    child.kill()
    child.wait()
    stored = escort_mj.open_run(tmp_path / "run")
    assert stored.outcome == "killed"
    reached = float(stored.trace.time[-1])
    assert f"{reached:.2f} s" in stored.message
    samples = min(stored.trace.sizes["time"], 200)
    expected = run("main", f"duration={samples / 10 - 0.1:.1f}", "recording.rate=10").trace
    np.testing.assert_array_equal(stored.trace.q[:samples], expected.q)
    assert (tmp_path / "run" / "trace.nc").is_file()


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interrupted_run_ends_in_order(tmp_path: Path, number: signal.Signals) -> None:
    child = started(tmp_path / "run")
    os.kill(child.pid, number)
    child.wait(60)
    outcome = json.loads((tmp_path / "run" / "outcome.json").read_text())
    assert outcome["outcome"] == "interrupted" and number.name in outcome["message"]
    assert child.returncode == -number  # as of any Python program
    assert escort_mj.open_run(tmp_path / "run").trace.sizes["time"] > 100


def test_an_interrupt_is_no_result(tmp_path: Path) -> None:
    scenario = escort_mj.load_scenario("main", ["duration=100"])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def interrupt(reached: float, duration: float) -> None:
        signal.raise_signal(signal.SIGINT)

    try:
        for folder in (tmp_path / "run", None):
            with pytest.raises(KeyboardInterrupt):
                escort_mj.run(scenario, folder, figures=False, video=False, progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)
    stored = escort_mj.open_run(tmp_path / "run")
    assert 1.0 < stored.metrics["run"]["simulated_time"] < 20.0
    assert {path.name for path in (tmp_path / "run").iterdir()} >= {"metrics.json", "verdicts.json"}


def test_a_run_that_breaks_is_marked_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: RunFolder, *rows: np.ndarray) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RunFolder, "append", full)
    with pytest.raises(OSError, match="No space left"):
        run("main", out=tmp_path / "run")
    outcome = json.loads((tmp_path / "run" / "outcome.json").read_text())
    assert outcome["outcome"] == "failed" and "No space left" in outcome["message"]


def test_metrics_look_at_the_target_itself_and_the_law_at_what_is_measured() -> None:
    """With a target seen one meter beside its place, robots circle the wrong point, and metrics say so."""
    off = "sensing={target_position: {bias: [1, 0]}}"
    trace = run("paper/case1_2d", off, "uncertainty={}", "duration=30", "expect=[]").trace
    apart = trace.target_position_measured - trace.target_position
    np.testing.assert_allclose(apart, np.broadcast_to([1.0, 0.0], apart.shape), atol=1e-12)
    last = trace.isel(time=slice(-50, None))
    radius = float(trace.attrs["mission_radius"])
    seen = np.linalg.norm(last.q.values - last.target_position_measured.values[:, None], axis=2)
    np.testing.assert_allclose(seen, radius, atol=0.01)
    true = np.linalg.norm(last.q.values - last.target_position.values[:, None], axis=2)
    assert np.abs(true - radius).max() > 0.7
