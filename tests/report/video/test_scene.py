"""Marks of what robots know, beside the model."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from escort_mj import palette
from escort_mj.report.video.marks import marks as marks_of
from escort_mj.report.video.replay import replay_of
from escort_mj.report.video.scene import draw_marks
from tests.synthetic import make_trace

TIME = np.array([0.0, 1.0, 2.0])
PLACES = np.array([[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0]])
BALL, LINE = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_LINE


def marks(kind: int, color: palette.Color, opponents: int = 0, **given: object) -> int:
    """How many marks of a kind and color a moment has."""
    replay = replace(replay_of(make_trace(TIME, robots=3, q=PLACES, **given)), opponents=opponents)
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    scene = mujoco.MjvScene(model, 2000)
    draw_marks(scene, replay, replay.at(0.5), 8.0, None, 1280)
    inks = [geom.rgba[:3] for geom in scene.geoms[: scene.ngeom] if geom.type == kind]
    return sum(np.allclose(ink, color, atol=1e-6) for ink in inks)


@pytest.mark.parametrize(
    ("heard", "lines"), [([[0, 0], [1, 0], [0, 0]], 1), ([[2, 3], [1, 3], [1, 2]], 3), (0, 0)]
)
def test_robots_that_hear_each_other_are_linked(heard: object, lines: int) -> None:
    assert marks(LINE, palette.RADIO, heard_from=heard) == lines


def test_who_sees_the_target_has_a_line_of_sight() -> None:
    first, second, _ = palette.robot_colors(3)
    seeing = {"target_seen": [1, 0, 0]}
    assert marks(LINE, first, **seeing) > marks(LINE, second, **seeing) + 5


def test_estimates_are_ghosts_but_of_robots_that_are_left() -> None:
    color = palette.robot_colors(3)[2]
    assert marks(BALL, color) == 1
    assert marks(BALL, color, lost=[0, 0, 1]) == 0
    assert marks(BALL, color, truth=False) == 0


def test_knowledge_goes_with_the_part_that_is_shown() -> None:
    seen = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    part = replay_of(make_trace(TIME, robots=3, q=PLACES, target_seen=seen)).between(1.0, 2.0)
    np.testing.assert_array_equal(part.seen, seen[1:] > 0)
    assert len(part.estimates) == len(part.heard) == 2


def test_opponents_leave_a_trail() -> None:
    given = {"obstacles": 1, "obstacle_position": np.zeros((3, 1, 2)) + TIME[:, None, None]}
    assert marks(LINE, palette.OPPONENT, **given) == 0
    assert marks(LINE, palette.OPPONENT, opponents=1, **given) > 3


BORDER = {"borders": ["wall"], "border_point": [[0.0, 3.0]], "border_normal": [[0.0, -2.0]]}


def test_a_border_has_strokes_on_the_other_side() -> None:
    assert marks(LINE, palette.CONTACT) == 0
    assert marks(LINE, palette.CONTACT, about=BORDER) > 20
    replay = replay_of(make_trace(TIME, robots=3, q=PLACES, about=BORDER))
    (border,) = (mark for mark in marks_of(replay, replay.at(0.5)) if mark.name == "border 0")
    assert border.points[::3, 1] == pytest.approx(3.0) and border.points[1::3, 1] == pytest.approx(
        3.0 + 0.625
    )


def test_a_border_in_space_is_a_grid_and_in_four_axes_nothing() -> None:
    for axes, some in ((3, True), (4, False)):
        place, normal = np.zeros((1, axes)).tolist(), np.eye(axes)[:1].tolist()
        about = BORDER | {"border_point": place, "border_normal": normal}
        replay = replay_of(make_trace(TIME, robots=2, axes=axes, truth=False, about=about))
        lines = [mark for mark in marks_of(replay, replay.at(0.5)) if mark.name.startswith("border")]
        assert bool(lines) == some and all(np.abs(line.points[:, 0]).max() < 1e-9 for line in lines)
