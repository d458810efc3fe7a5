"""The user's way: commands, their exit codes, and what they print."""

import json
import signal
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from escort_mj import stopping, supervised
from escort_mj.__main__ import main

FIVE_LINES = """\
name: five
duration: 2
robots: {count: 5}
target: {position: ["0.2*t", 0]}
expect: [{metric: contacts, at_most: 0}]
"""


def call(monkeypatch, capfd, *arguments: str) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command, run in this process."""
    monkeypatch.setattr(sys, "argv", ["escort-mj", *arguments])
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)  # a command takes it, as its process ends
    # Not in a process that is forked: this one, which would wait for it, is pytest's.
    monkeypatch.setattr(supervised, "supervise", lambda run: run(supervised.Page()))
    monkeypatch.setattr(supervised, "own_page", None)
    before = {number: signal.getsignal(number) for number in stopping.SIGNALS}
    try:
        with pytest.raises(SystemExit) as stop:
            main()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    out, err = capfd.readouterr()
    assert "Traceback" not in out + err
    return int(stop.value.code or 0), out, err


@pytest.fixture
def command(monkeypatch, capfd, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "five.yaml").write_text(FIVE_LINES)
    return lambda *arguments: call(monkeypatch, capfd, *arguments)


QUIET = ("--no-video", "--no-figures")


def test_a_good_run(command, one_figure, tmp_path: Path) -> None:
    code, out, err = command("run", "five.yaml", *QUIET)
    assert code == 0 and err == ""
    assert "five: completed 2 s (" in out and "pass  contacts" in out
    folder = tmp_path / "renders" / "five"
    written = {
        "scenario.yaml",
        "resolved.yaml",
        "model.xml",
        "trace.nc",
        "metrics.json",
        "verdicts.json",
        "outcome.json",
    }
    assert {path.name for path in folder.iterdir()} == written
    verdicts = json.loads((folder / "verdicts.json").read_text())
    assert [verdict["metric"] for verdict in verdicts] == ["outcome", "contacts"]
    code, out, _ = command("show", str(folder))
    assert code == 0 and "101 samples of 5 robots" in out and "pass  contacts" in out
    code, out, _ = command("report", str(folder))
    assert code == 0 and out == "wrote renders/five/report.html\n"
    assert 'id="replay"' in (folder / "report.html").read_text()


def test_an_earlier_run_stays(command, tmp_path: Path) -> None:
    short = ("run", "five.yaml", *QUIET, "--set", "duration=0.1")
    assert command(*short)[0] == 0
    (tmp_path / "renders" / "five" / "video.mp4").write_text("of the first run")
    code, out, err = command(*short)
    assert code == 0 and "wrote renders/five-2:" in out
    assert err == "renders/five holds an earlier run, which is kept; --overwrite replaces it\n"
    code, _, err = command(*short, "--out", "renders/five")
    assert code == 2 and err.endswith(
        "holds a run already; --overwrite (in Python overwrite=True) replaces it\n"
    )
    assert (tmp_path / "renders" / "five" / "video.mp4").is_file()
    code, out, _ = command(*short, "--overwrite")
    assert code == 0 and "wrote renders/five:" in out
    assert not (tmp_path / "renders" / "five" / "video.mp4").exists()


def test_a_failed_verdict(command) -> None:
    code, out, _ = command(
        "run", "five.yaml", *QUIET, "--set", "expect=[{metric: settling_time, at_most: 0.1}]"
    )
    assert code == 1 and "FAIL  settling_time" in out and "at most 0.1 s" in out


def test_a_diverged_run(command, tmp_path: Path) -> None:
    code, out, _ = command(
        "run", "paper/case1_3d", *QUIET, "--set", "controller.anti_windup=false", "--out", "div"
    )
    assert code == 3 and "diverged" in out
    code, out, _ = command("show", "div")
    assert code == 0 and "diverged" in out


def test_quiet_prints_what_is_wrong(command) -> None:
    assert command("run", "five.yaml", *QUIET, "-q") == (0, "", "")
    code, out, err = command(
        "run", "five.yaml", *QUIET, "--quiet", "--set", "expect=[{settled: 0.01, by: 1}]"
    )
    assert code == 1 and out.startswith("  FAIL  settled") and out.count("\n") == 2 and not err


def test_verbose_names_stages_and_shows_where_it_broke(command, monkeypatch, capfd) -> None:
    code, out, err = command("run", "five.yaml", *QUIET, "-v")
    assert code == 0 and err.startswith("simulating: ") and err.endswith(" s\n")
    monkeypatch.setattr("escort_mj.mission.build", lambda scenario: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        command("run", "five.yaml", *QUIET, "-v")


def test_version_and_short_help(command) -> None:
    assert command("--version") == (0, f"escort-mj {version('escort-mj')}\n", "")
    assert command("run", "-h")[1] == command("run", "--help")[1]


def test_compare_runs_each_law_once(command, undrawn, tmp_path: Path) -> None:
    arguments = ("compare", "five.yaml", "--laws", "pd,apd_smc", "--set", "duration=1", "--workers", "1")
    code, out, err = command(*arguments)
    assert code == 0 and err == ""
    assert "2 runs: 2 new" in out and "APD-SMC" in out and "wrote renders/compare/five" in out
    assert (tmp_path / "renders" / "compare" / "five" / "runs.csv").is_file()
    assert "0 new" in command(*arguments)[1]


def test_a_program_error_is_one_message(command, monkeypatch) -> None:
    monkeypatch.setattr("escort_mj.mission.build", lambda scenario: 1 / 0)
    code, _, err = command("run", "five.yaml", *QUIET)
    assert code == 3 and "ZeroDivisionError" in err
    assert json.loads(Path("renders/five/outcome.json").read_text())["outcome"] == "failed"


def test_schema_is_printed(command, monkeypatch) -> None:
    """That it is the shipped one: tests/scenario/reader."""
    monkeypatch.setattr("escort_mj.scenario.json_schema", lambda kind: {"kind": kind.__name__})
    assert command("schema") == (0, '{\n  "kind": "Scenario"\n}\n', "")


def test_help_names_the_commands_and_exit_codes(command) -> None:
    code, out, _ = command("--help")
    assert code == 0
    for word in ("run", "show", "render", "reproduce", "compare", "schema", "1 a verdict failed"):
        assert word in out
