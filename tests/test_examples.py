"""The examples run as they are."""

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_many_missions(compiled: None) -> None:
    made = subprocess.run(
        [sys.executable, EXAMPLES / "many_missions.py", "3"], capture_output=True, text=True, check=True
    )
    assert " of 3 missions passed; least clearance 0." in made.stdout


def test_the_notebook_runs_and_shows_what_it_showed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    book = json.loads((EXAMPLES / "first_mission.ipynb").read_text(encoding="utf-8"))
    matplotlib.use("agg")
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: None)
    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    shown, now = [], io.StringIO()
    with contextlib.redirect_stdout(now):
        for cell in book["cells"]:
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), "first_mission.ipynb", "exec"), names)
                shown += [text for output in cell["outputs"] for text in output.get("text", ())]
    assert now.getvalue().splitlines()[:5] == "".join(shown).splitlines()[:5]  # the verdicts
    pictures = [output for cell in book["cells"] for output in cell.get("outputs", ()) if "data" in output]
    assert sum("image/png" in picture["data"] for picture in pictures) == 2
