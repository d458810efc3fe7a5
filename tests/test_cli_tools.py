"""The user's way around runs: new, export, doctor."""

import json
from pathlib import Path
from xml.etree import ElementTree

from tests.test_cli import QUIET, command

__all__ = ["command"]


def test_new_then_run_then_export(command, tmp_path: Path) -> None:
    code, out, err = command("new", "mine", "--robots", "4")
    assert (code, err) == (0, "") and out == "wrote mine.yaml schema.json; next: escort-mj run mine.yaml\n"
    code, out, _ = command("run", "mine.yaml", "--set", "duration=1", "--set", "expect=[]", *QUIET)
    assert code == 0
    code, out, _ = command("export", "renders/mine", "mine.csv")
    assert (code, out) == (0, "wrote mine.csv\n")
    header, *rows = (tmp_path / "mine.csv").read_text().splitlines()
    assert "q.robot_4.y [m]" in header.split(",") and len(rows) == 51
    assert command("export", "renders/mine", "ran.xml")[0] == 0
    assert (tmp_path / "ran.xml").read_text() == (tmp_path / "renders" / "mine" / "model.xml").read_text()
    assert command("export", "mine.yaml", "made.xml")[0] == 0
    assert ElementTree.parse(tmp_path / "made.xml").getroot().tag == "mujoco"


def test_metrics_of_runs(command, tmp_path: Path) -> None:
    runs = ["one", "two"]
    for seed, out in enumerate(runs):
        given = ("--set", "duration=1", "--set", f"seed={seed}", "--set", "expect=[]", *QUIET)
        assert command("run", "five.yaml", "--out", out, *given)[0] == 0
    chosen = ("--metric", "tracking_error_rms", "--before", "0.5")
    code, out, _ = command("metrics", *runs, *chosen, "--to", "table.csv")
    head, outcome, *_, row, wrote = out.splitlines()
    assert (code, wrote) == (0, "wrote table.csv") and outcome.split() == ["outcome", *["completed"] * 2]
    assert len(head.split()) == 3 and row.startswith("tracking_error_rms_before_0.5  ")
    header, *rows = (tmp_path / "table.csv").read_text().splitlines()
    assert header.endswith(",tracking_error_rms_before_0.5 [m]") and len(rows) == 2
    for name, words in {"table.md": "| metric |", "table.tex": r"\toprule"}.items():
        assert command("metrics", *runs, *chosen, "--to", name)[0] == 0
        assert words in (tmp_path / name).read_text()
    told = json.loads(command("metrics", runs[0], "--json")[1])
    assert told["units"]["force_rms"] == "N" and len(told["runs"]) == 1
    code, _, err = command("metrics", runs[0], "--metric", "force_rm")
    assert code == 2 and 'did you mean "force_rms"' in " ".join(err.split())


def test_doctor(command) -> None:
    code, out, err = command("doctor")
    assert (code, err) == (0, "")
    for check in ("python", "packages", "mujoco", "kernels", "output", "rendering", "ffmpeg"):
        assert f"  {check} " in out
