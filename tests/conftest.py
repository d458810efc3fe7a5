"""What tests of several floors share."""

import fcntl
import gc
import os

# Pytest's workers have the cores already; threads of BLAS would wait for each other there, and burn time so.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import settings

from escort_mj.world.callback import callbacks
from tests import cases, synthetic

# Looking for garbage after every 700 new objects took a twelfth of the time.
gc.set_threshold(100_000, 20, 20)

# How long an example takes says how loaded the machine is. Each run draws others.
settings.register_profile("here", deadline=None, max_examples=40)
settings.load_profile("here")


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Iterator[Any]:
    """Workers take turns with each file: one rewrites its asserts, the others read what it has written."""
    if not isinstance(collector, pytest.Module):
        return (yield)
    with collector.path.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        return (yield)


@pytest.hookimpl(tryfirst=True)  # before pytest leaves out what is slow
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of crossed cases, a few are fast."""
    cases.mark_slow(items)


@pytest.fixture(scope="session")
def compiled() -> None:
    """The native callbacks of planar missions, compiled or read from the cache once for the whole session."""
    callbacks(2)


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Checks of plugins draw a few times and fly shortly."""
    from tests.plugged import hurry

    hurry(monkeypatch)


@pytest.fixture
def make_trace() -> Callable[..., Any]:
    """Synthetic traces, see `synthetic.make_trace`."""
    return synthetic.make_trace


@pytest.fixture
def one_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs have one figure, for tests of what is done with figures: all are drawn in tests/report."""
    from escort_mj.report.figures import figures

    monkeypatch.setattr(figures, "PLOTS", [plot for plot in figures.PLOTS if plot.name == "panels"])


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Studies have no figures, for tests of all else, which takes less time; tests/report draws them."""
    monkeypatch.setattr("escort_mj.report.comparison.draw_comparison", lambda *_: [])
    monkeypatch.setattr("escort_mj.report.pages.study_page.draw_study", lambda *_: [])
