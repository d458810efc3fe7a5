"""Pictures of a team that loses a robot."""

import warnings

import numpy as np
import pytest

from escort_mj.record.folder import read_run
from escort_mj.report.figures.drawing import style
from escort_mj.report.figures.figures import draw_figures
from escort_mj.report.figures.links import links, links_at
from escort_mj.report.figures.paths import bounds
from escort_mj.report.video.replay import replay_of


def gone(samples: int = 60, count: int = 5) -> np.ndarray:
    """Robot 2 is lost at sample 20, robot 5 at sample 40."""
    flags = np.zeros((samples, count))
    flags[20:, 1] = flags[40:, 4] = 1.0
    return flags


@pytest.fixture
def trace(make_run):
    return read_run(make_run(lost=gone())).trace


def pairs(found: np.ndarray) -> set[tuple[int, int]]:
    return {(int(i), int(j)) for i, j in found}


def test_neighbors_change_with_every_loss(trace) -> None:
    formations = links(trace)
    assert [start for start, _ in formations] == [0, 20, 40]
    assert pairs(links_at(formations, 19)) == {(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)}
    assert pairs(links_at(formations, 20)) == {(0, 4), (2, 3), (3, 4)}  # the gap that robot 2 left is open
    assert pairs(links_at(formations, 59)) == {(0, 2), (0, 3), (2, 3)}


def test_a_replay_knows_who_is_lost(trace) -> None:
    np.testing.assert_array_equal(replay_of(trace).lost, gone() > 0)


def test_where_a_lost_robot_drifts_is_not_in_the_picture(trace) -> None:
    trace["q"].values[30:, 1] = 1e4
    low, high = bounds(trace)
    assert (high - low).max() < 100.0


@pytest.mark.slow
@pytest.mark.parametrize("axes", [2, 3])
def test_figures_without_a_warning(make_run, monkeypatch, axes: int) -> None:
    monkeypatch.setattr(style, "DPI", 60)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert draw_figures(make_run(axes=axes, lost=gone()))
