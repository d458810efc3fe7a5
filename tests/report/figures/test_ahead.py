"""Figures that another process draws are the same, and what goes wrong there is said here."""

import shutil

import pytest

from escort_mj.errors import RunFolderError
from escort_mj.report.figures import ahead
from escort_mj.report.figures.drawing import style
from escort_mj.report.figures.figures import draw_figures


@pytest.mark.slow
def test_another_process_draws_the_same_figures(make_run, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = make_run()
    monkeypatch.setattr(style, "DPI", 200)  # as the other process does
    expected = {path.name: path.read_bytes() for path in draw_figures(folder)}
    shutil.rmtree(folder / "figures")
    monkeypatch.setattr(ahead, "_cores", lambda: 2)
    with ahead.figures_ahead() as draw:
        monkeypatch.setattr(ahead, "_draw_here", lambda folder: pytest.fail("it did not draw"))
        drawn = draw(folder)
    assert {path.name: path.read_bytes() for path in drawn} == expected


def test_what_cannot_be_drawn_there_is_refused_here(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ahead, "_cores", lambda: 2)
    with ahead.figures_ahead() as draw, pytest.raises(RunFolderError, match="outcome.json"):
        draw(tmp_path)
