import numpy as np
import pytest

from escort_mj.record.folder import read_run
from escort_mj.report.video.camera import Insets, Viewpoint, frame, plan_shot
from escort_mj.report.video.replay import replay_of
from tests.report.video.projecting import project

SIZE = (320, 180)
FIELD = 45.0
INSETS = Insets(side=0.05, top=0.2, bottom=0.1)


@pytest.mark.parametrize("azimuth", [90.0, 75.0, -30.0])
@pytest.mark.parametrize("elevation", [-90.0, -55.0, -20.0, 10.0])
@pytest.mark.parametrize("stretch", [(1, 1, 1), (30, 1, 0), (1, 30, 5)])
def test_the_nearest_camera_sees_every_point_and_leaves_the_rims_free(azimuth, elevation, stretch):
    points = np.random.default_rng(1).standard_normal((200, 3)) * stretch + [3, -8, 2]
    view = frame(points, azimuth, elevation, FIELD, SIZE[0] / SIZE[1], INSETS)
    column, row = project(view, points, SIZE, FIELD).T
    left, right = 0.05 * SIZE[0], 0.95 * SIZE[0]
    top, bottom = 0.2 * SIZE[1], 0.9 * SIZE[1]
    assert column.min() > left - 1e-6 and column.max() < right + 1e-6
    assert row.min() > top - 1e-6 and row.max() < bottom + 1e-6
    tight_across = column.min() == pytest.approx(left) and column.max() == pytest.approx(right)
    tight_down = row.min() == pytest.approx(top) and row.max() == pytest.approx(bottom)
    assert tight_across or tight_down  # else it could come nearer


def test_a_point_behind_the_camera_has_no_pixel():
    view = frame(np.zeros((1, 3)), 90.0, -90.0, FIELD, 1.0, INSETS)
    assert np.isnan(project(view, np.array([[0.0, 0.0, 1e6]]), SIZE, FIELD)).all()


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("camera", ["overview", "top"])
def test_everyone_is_in_the_picture_at_every_time(make_run, axes, camera):
    replay = replay_of(read_run(make_run(axes=axes)).trace)
    shot = plan_shot(replay, camera, FIELD, 16 / 9, 4.0)
    for time in np.linspace(0, replay.end, 9):
        moment = replay.at(time)
        everything = np.vstack([moment.robots, moment.target, moment.obstacles])
        column, row = project(shot.view(time), everything, SIZE, FIELD).T
        assert column.min() > 0 and column.max() < SIZE[0] and row.min() > 0 and row.max() < SIZE[1]


def test_following_keeps_the_target_in_the_middle(make_run):
    replay = replay_of(read_run(make_run()).trace)
    shot = plan_shot(replay, "follow", FIELD, 16 / 9, 0.0)
    for time in (0.0, 2.5, replay.end):
        place = project(shot.view(time), replay.at(time).target, SIZE, FIELD)
        np.testing.assert_allclose(place, np.array(SIZE) / 2, atol=20)


def test_a_camera_goes_behind_a_robot(make_run):
    replay = replay_of(read_run(make_run(axes=3)).trace)
    for robot in range(replay.count):
        shot = plan_shot(replay, "robot", FIELD, 16 / 9, 0.0, Viewpoint(robot=robot))
        for time in (1.0, 2.5):
            view, here = shot.view(time), replay.at(time).robots[robot]
            np.testing.assert_allclose(project(view, here, SIZE, FIELD), np.array(SIZE) / 2, atol=20)
            step = (replay.at(time + 0.05).robots[robot] - replay.at(time - 0.05).robots[robot])[:2]
            ahead = np.array([np.cos(np.radians(view.azimuth)), np.sin(np.radians(view.azimuth))])
            assert step @ ahead > 0.95 * np.linalg.norm(step)


def test_behind_a_robot_that_stands_the_camera_keeps_its_direction(make_run):
    trace = read_run(make_run()).trace
    trace["q"][:, 0] = trace["q"][0, 0].values
    still = plan_shot(replay_of(trace), "robot", FIELD, 16 / 9, 0.0)
    assert {still.view(time).azimuth for time in (0.0, 2.0)} == {90.0}
    trace["q"][:, 0, 0] += np.minimum(trace["time"].values, 1.0)
    stops = plan_shot(replay_of(trace), "robot", FIELD, 16 / 9, 0.0)
    assert all(abs(stops.view(time).azimuth) < 1e-6 for time in (0.0, 0.5, 2.0, 4.0))


def test_a_long_way_is_followed_rather_than_shrunk(make_run):
    trace = read_run(make_run()).trace
    trace["target_position"] = trace["target_position"] * 100
    trace["q"] = trace["q"] + trace["target_position"] * 0.99
    replay = replay_of(trace)
    start, end = (plan_shot(replay, "overview", FIELD, 16 / 9, 0.5).view(t) for t in (0.0, replay.end))
    assert end.distance < 10 * replay.radius
    assert end.look_at[0] - start.look_at[0] > 200


def test_a_robot_that_flies_off_does_not_shrink_the_picture(make_run):
    trace = read_run(make_run(obstacles=0)).trace
    calm = plan_shot(replay_of(trace), "overview", FIELD, 16 / 9, 1.0).view(0.0).distance
    trace["q"][-5:, 0] = 1e7
    wild = plan_shot(replay_of(trace), "overview", FIELD, 16 / 9, 1.0).view(0.0).distance
    assert wild == pytest.approx(calm, rel=0.1)


@pytest.mark.parametrize("camera", ["overview", "follow", "top"])
def test_the_camera_stands_where_the_user_says(make_run, camera):
    replay = replay_of(read_run(make_run(axes=3)).trace)
    for time in (0.0, replay.end):
        view = plan_shot(replay, camera, FIELD, 16 / 9, 0.0, Viewpoint(azimuth=30.0, elevation=-70.0)).view(
            time
        )
        assert (view.azimuth, view.elevation) == (30.0, -70.0)
        target = project(view, replay.at(time).target, SIZE, FIELD)
        assert (target > 0).all() and (target < SIZE).all()
        stand = Viewpoint(distance=123.0, look_at=(1.0, 2.0, 3.0))
        far = plan_shot(replay, camera, FIELD, 16 / 9, 0.0, stand).view(time)
        assert far.distance == 123.0 and far.look_at.tolist() == [1.0, 2.0, 3.0]
        if camera == "top":
            assert far.elevation == -90.0


def test_a_part_of_a_run_is_shown_from_nearer(make_run):
    replay = replay_of(read_run(make_run(obstacles=0)).trace)
    part = replay.between(2.03, 2.97)
    assert part.time[0] <= 2.03 < part.time[1] and part.time[-2] < 2.97 <= part.time[-1]
    whole, near = (
        plan_shot(one, "overview", FIELD, 16 / 9, 1.0).view(2.5).distance for one in (replay, part)
    )
    assert near < whole
    moment = part.at(2.5)
    np.testing.assert_allclose(moment.robots, replay.at(2.5).robots)
