"""Pictures of teams: robots have the color of the team that they are in at the moment."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from escort_mj import Run, Scenario, palette, run
from escort_mj.report.figures.knowledge import DRIFT, SIGHT, knowledge
from escort_mj.report.figures.links import links
from escort_mj.report.figures.paths import plan_view
from escort_mj.report.video.replay import replay_of

ONE, TWO = palette.team_color(0), palette.team_color(1)


@pytest.fixture(scope="module")
def flown() -> Run:
    """Robot 3 changes over after half of the run."""
    return fly()


@pytest.fixture(scope="module")
def knowing() -> Run:
    """The same with robots that know only what they see and hear; robots 1 and 4 see."""
    return fly(knowledge={"target": {"robots": [1, 4]}, "estimator": "kalman"}, communication={"range": 6})


def fly(**keys: object) -> Run:
    """Five robots in two teams."""
    teams = [
        {"name": name, "robots": robots, "radius": 2.0, "demand": [{"after": after, "robots": count}],
         "targets": [{"name": f"of_{name}", "position": [x, 0]}]}
        for name, robots, x, after, count in (("one", [1, 2, 3], 0, 0.0, 2), ("two", [4, 5], 8, 1.0, 3))
    ]  # fmt: skip
    places = [[-2, 0], [0, 2], [2.5, 0], [8, 2], [8, -2]]
    behaviors = [{"behavior": "avoid_obstacles", "safe_distance": 0.3}, "vertices", "surface"]
    return run(Scenario(
        duration=2.0, target=None, teams=teams, robots={"positions": places},
        mission={"behaviors": behaviors}, **keys,
    ))  # fmt: skip


def test_ways_have_the_color_of_their_team(flown: Run) -> None:
    figure = Figure()
    plan_view(figure, flown.trace)
    (axes,) = figure.axes
    last = np.array([robot[-1] for robot in flown.trace["q"].values.swapaxes(0, 1)])
    ways = {
        (to_hex(line.get_color()), tuple(np.round(np.asarray(line.get_xydata())[-1], 9)))
        for line in axes.lines
        if line.get_linewidth() == 1.3
    }
    for robot, color in enumerate((ONE, ONE, TWO, TWO, TWO)):
        assert (to_hex(color), tuple(np.round(last[robot], 9))) in ways
    assert sum(color == to_hex(ONE) for color, _ in ways) == 3  # robot 3 has two parts
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["one", "two", "target", "start", "end"]


def test_targets_have_the_color_of_their_team() -> None:
    """One target joins the other team at 1 s, and leaves it at 1.5 s."""
    escorts = [{"after": 1.0, "team": "two"}, {"after": 1.5, "team": None}]
    gift = {"name": "gift", "position": ["0.5*t", 0.6], "escorted_by": escorts}
    teams = [
        {"name": "one", "robots": [1, 2], "radius": 3.0,
         "targets": [{"name": "of_one", "position": [0, 0]}, gift]},
        {"name": "two", "robots": [3], "radius": 3.0, "targets": [{"name": "of_two", "position": [2, 0]}]},
    ]  # fmt: skip
    trace = run(Scenario(
        duration=2.0, target=None, teams=teams, robots={"positions": [[-4, 0], [0, 4], [7, 0]]},
        mission={"behaviors": ["surface"]}, recording={"rate": 50},
    )).trace  # fmt: skip
    replay, gray = replay_of(trace), palette.OBSTACLE
    assert replay.targets == ("of_one", "gift", "of_two")
    assert [replay.target_colors(row)[1] for row in (0, 49, 50, 74, 75, 100)] == [
        ONE,
        ONE,
        TWO,
        TWO,
        gray,
        gray,
    ]
    figure = Figure()
    plan_view(figure, trace)
    (axes,) = figure.axes
    marks = [line for line in axes.lines if line.get_marker() == "D" and len(line.get_xdata()) == 1]
    found = [(to_hex(line.get_color()), round(float(line.get_xdata()[0]), 2)) for line in marks]
    assert found == [(to_hex(ONE), 0.0), (to_hex(TWO), 0.5), (to_hex(gray), 0.75), (to_hex(gray), 1.0),
                     (to_hex(TWO), 2.0)]  # fmt: skip
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["one", "two", "target", "without a team", "start", "end"]


def test_links_are_between_members(flown: Run) -> None:
    before, after = links(flown.trace)
    assert before[0] == 0 and {*map(tuple, before[1].tolist())} <= {(0, 1), (0, 2), (1, 2), (3, 4)}
    assert {*map(tuple, after[1].tolist())} <= {(0, 1), (2, 3), (2, 4), (3, 4)}


def test_the_video_paints_robots_as_they_change_over(flown: Run) -> None:
    replay = replay_of(flown.trace)
    assert replay.colors(0) == [ONE, ONE, ONE, TWO, TWO]
    assert replay.colors(-1) == [ONE, ONE, TWO, TWO, TWO]
    assert replay.team_radius[0].tolist() == [2.0, 2.0]
    assert np.allclose(replay.team_centers[:, :, :2], flown.trace["team_center"].values)


def test_estimates_and_lines_of_sight_are_of_the_own_team(knowing: Run) -> None:
    """Estimates have the color of the team, and no line leads from one target to another."""
    figure = Figure()
    plan_view(figure, knowing.trace)
    (axes,) = figure.axes
    ghosts = [line for line in axes.lines if line.get_marker() == "+"]
    found = [(to_hex(line.get_color()), *np.round(line.get_xydata()[0], 6)) for line in ghosts]
    assert found[-5:] == [(to_hex(ONE), 0.0, 0.0)] * 2 + [(to_hex(TWO), 8.0, 0.0)] * 3
    ways = [
        np.asarray(line.get_xydata()) for line in axes.lines if line.get_linewidth() == DRIFT["linewidth"]
    ]
    assert max(float(np.ptp(way[:, 0])) for way in ways) < 0.1
    seen = [
        np.asarray(line.get_xydata())[-1] for line in axes.lines if line.get_linewidth() == SIGHT["linewidth"]
    ]
    assert np.allclose(seen[-2:], [[0.0, 0.0], [8.0, 0.0]])
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"one", "two", "sees the target", "estimate of the target", "hear each other"} <= words


def test_the_figure_of_knowledge_measures_errors_from_the_own_target(knowing: Run) -> None:
    figure = Figure()
    knowledge(figure, knowing.trace)
    errors = figure.axes[0]
    assert max(float(np.nanmax(np.abs(line.get_ydata()))) for line in errors.lines) < 0.5
    assert figure.axes[3].get_title().startswith("(d) Robots heard")


def test_the_video_shows_what_robots_of_teams_know(knowing: Run) -> None:
    replay = replay_of(knowing.trace)
    for time, who in ((0.0, [0, 0, 0, 1, 1]), (2.0, [0, 0, 1, 1, 1])):
        assert np.allclose(replay.aims(replay.at(time))[:, 0], 8.0 * np.array(who))
    assert replay.ghost_radius == pytest.approx(0.8 * 0.3)
