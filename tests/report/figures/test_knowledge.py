"""Pictures of what robots know: a team of which one robot sees the target and two hear each other."""

import warnings

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb

from escort_mj import palette
from escort_mj.report.figures.drawing.look import look_of, looking
from escort_mj.report.figures.figures import figure_of, plots_of
from tests.report.figures.test_figures import assert_words_inside
from tests.synthetic import make_trace

TIME = np.arange(0.0, 20.0, 0.1)
N = 4
PLACES = np.array([[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0], [0.0, -5.0]])


@pytest.fixture(scope="module")
def trace():
    """All hear each other in a line but from 10 s to 15 s, when 1, 2 and 3, 4 are apart."""
    heard = np.tile([[2, 0], [1, 3], [2, 4], [3, 0]], (len(TIME), 1, 1))
    heard[100:150] = [[2, 0], [1, 0], [4, 0], [3, 0]]
    estimate = np.zeros((len(TIME), N, 2))
    estimate[:, 3] = [0.6, 0.8]
    return make_trace(
        TIME,
        robots=N,
        q=PLACES,
        heard_from=heard,
        target_seen=[1, 0, 0, 0],
        target_estimate=estimate,
        target_covariance=np.tile(0.02 * np.eye(2), (N, 1, 1)),
        information_age=0.1 * np.arange(N),
    )


def drawn(trace, name, **look):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with looking(look_of(**look)):
            canvas = figure_of(trace, name)
        canvas.draw_without_rendering()
    return canvas


def words(canvas):
    return {text.get_text() for legend in canvas.legends for text in legend.get_texts()}


def test_errors_ages_sight_and_hearing_share_their_time(trace):
    canvas = drawn(trace, "knowledge")
    errors, ages, sight, hearing, losses = canvas.axes
    assert [axes.get_ylabel() for axes in canvas.axes] == [
        "error [m]",
        "age [s]",
        "robot",
        "robot",
        "share [%]",
    ]
    assert all(axes.get_xlim() == (0.0, TIME[-1]) for axes in canvas.axes)
    assert losses.get_xlabel() == "time [s]" and "full lane: 2" in hearing.get_title(loc="left")
    assert errors.get_yscale() == "log"
    of_last = [line for line in errors.lines if line.get_color() == palette.robot_colors(N)[3]]
    assert {round(float(line.get_ydata()[90]), 9) for line in of_last} == {1.0, 0.4}  # and 2 sigma
    assert max(float(np.max(line.get_ydata())) for line in ages.lines) == pytest.approx(0.3)
    assert {"2σ that the robot expects", "team in parts", "robot 4"} <= words(canvas)
    assert filled(sight, palette.robot_colors(N)[0]) == [(0.0, pytest.approx(TIME[-1]))]
    assert filled(sight, palette.robot_colors(N)[1]) == []
    for axes in canvas.axes:
        assert filled(axes, palette.CONTACT) == [(10.0, 15.0)]


def test_of_robots_that_know_their_target_it_is_whom_they_hear_and_which_messages_are_lost(trace):
    known = {"target_seen": [1] * N, "target_estimate": 0.0, "information_age": 0.0, "target_covariance": 0.0}
    counts = {"messages_lost": [1.0] * N, "messages_heard": [3.0] * N}
    canvas = drawn(
        make_trace(TIME, robots=N, q=PLACES, heard_from=trace["heard_from"].values, **known, **counts),
        "knowledge",
    )
    hearing, losses = canvas.axes
    assert hearing.get_title(loc="left").startswith("(a) Teammates heard")
    assert losses.get_ylabel() == "share [%]" and {
        *np.ravel([line.get_ydata() for line in losses.lines])
    } == {25.0}
    assert words(canvas) == {*(f"robot {i + 1}" for i in range(N)), "team in parts"}


def filled(axes, color):
    """Spans that are filled in a color."""
    return [
        (round(float(path.vertices[:, 0].min()), 9), round(float(path.vertices[:, 0].max()), 9))
        for band in axes.collections
        if isinstance(band, PolyCollection) and to_rgb(band.get_facecolor()[0][:3]) == color
        for path in band.get_paths()
    ]


@pytest.mark.slow
def test_the_figure_is_drawn_of_any_team(trace):
    lost = np.zeros((len(TIME), N))
    lost[50:, 1] = 1.0
    drawn(make_trace(TIME, robots=N, q=PLACES, lost=lost), "knowledge")  # no covariance, nobody heard
    canvas = drawn(make_trace(TIME, robots=70, heard_from=[[1, 2]], target_covariance=np.eye(2)), "knowledge")
    assert "median robot" in words(canvas)
    silent = drawn(trace.drop_vars("heard_from"), "knowledge")
    assert len(silent.axes) == 3 and "team in parts" not in words(silent)
    drawn(trace.isel(time=[0]), "knowledge")
    assert "knowledge" not in plots_of(make_trace(TIME, truth=False))


def test_a_narrow_figure_holds_all_its_words(trace):
    assert_words_inside(drawn(trace, "knowledge", width="column", font_size=6.5))


@pytest.mark.parametrize("axes", [2, 3, 4])
def test_paths_show_sight_estimates_and_who_hears_whom(trace, axes):
    wide = {"q": np.pad(PLACES, ((0, 0), (0, axes - 2))), "target_seen": [1, 0, 0, 0]}
    wide["target_estimate"] = np.pad([[0.6, 0.8]], ((0, 0), (0, axes - 2)))
    team = (
        trace if axes == 2 else make_trace(TIME, N, axes, heard_from=[[2, 0], [0, 0], [0, 0], [3, 0]], **wide)
    )
    canvas = drawn(team, "paths")
    assert {"sees the target", "estimate of the target", "hear each other"} <= words(canvas)
    if axes != 2:
        return
    plan = canvas.axes[0]
    (links,) = [one for one in plan.collections if isinstance(one, LineCollection)]
    ends = {tuple(map(tuple, np.round(segment, 9))) for segment in links.get_segments()}
    assert ends == {tuple(map(tuple, PLACES[[i, i + 1]])) for i in range(3)}
    ghosts = [line for line in plan.lines if line.get_marker() == "+"]
    assert [tuple(map(float, line.get_xydata()[0])) for line in ghosts] == [(0.0, 0.0)] * 3 + [(0.6, 0.8)]
    (sight,) = [line for line in plan.lines if np.array_equal(line.get_xydata(), [PLACES[0], [0.0, 0.0]])]
    assert sight.get_color() == palette.robot_colors(N)[0]


def test_paths_of_a_team_that_knows_show_neighbors(trace):
    assert not words(drawn(make_trace(TIME, robots=N, q=PLACES, truth=False), "paths")) & {"hear each other"}
