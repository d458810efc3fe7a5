"""The examples run as they are."""

import contextlib
import importlib.util
import io
import json
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_many_missions(compiled: None) -> None:
    made = subprocess.run(
        [sys.executable, EXAMPLES / "many_missions.py", "3"], capture_output=True, text=True, check=True
    )
    assert " of 3 missions passed; least clearance 0." in made.stdout


def test_train_policy(compiled: None, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("cmaes")
    pytest.importorskip("gymnasium")
    spec = importlib.util.spec_from_file_location("train_policy", EXAMPLES / "train_policy.py")
    assert spec is not None and spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    curve = example.main(2, duration=0.5)
    assert len(curve) == 2 and np.isfinite(curve).all()
    assert "trained: " in capsys.readouterr().out


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs_and_prints_what_it_shows(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: None
) -> None:
    book = json.loads(path.read_text(encoding="utf-8"))
    matplotlib.use("agg")
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: None)
    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    shown, now = [], io.StringIO()
    with contextlib.redirect_stdout(now):
        for cell in book["cells"]:
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), path.name, "exec"), names)
                shown += [text for output in cell["outputs"] for text in output.get("text", ())]
    assert words(now.getvalue()) == words("".join(shown))
    pictures = [output for cell in book["cells"] for output in cell.get("outputs", ()) if "data" in output]
    assert any("image/png" in picture["data"] for picture in pictures)


def words(text: str) -> str:
    """Text without its digits: they depend on the processor."""
    return re.sub(r"[\d.]+", "#", text)
