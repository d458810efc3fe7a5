"""Progress: shown where somebody looks."""

import sys
from types import SimpleNamespace

import pytest

from escort_mj import progress


def test_nothing_in_a_pipe(capfd: pytest.CaptureFixture[str]) -> None:
    with progress.shown_progress("sweeping", " runs") as update:
        update(1.0, 2.0)
    with progress.shown_progress("sweeping", " runs", False) as update:
        update(1.0, 2.0)
    assert capfd.readouterr() == ("", "")


def test_ones_own_function_is_called() -> None:
    told: list[tuple[float, float]] = []
    with progress.shown_progress("sweeping", " runs", lambda *done: told.append(done)) as update:
        update(1, 2)
    assert told == [(1, 2)]


def test_a_line_in_a_notebook(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    kernel = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=object()))
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    with progress.shown_progress("sweeping", " runs") as update:
        for done in range(1000):
            update(done, 1000)
        update(1000, 1000)
    out, err = capfd.readouterr()
    assert out.startswith("\rsweeping: 0 of 1000 runs\r") and "\rsweeping: 1000 of 1000 runs\r" in out
    assert out.count("sweeping") < 20 and out.endswith(" \r") and not err
