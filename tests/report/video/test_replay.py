from dataclasses import replace

import numpy as np
import pytest

from escort_mj import Scenario
from escort_mj.errors import RenderError
from escort_mj.mission import fly
from escort_mj.record.folder import read_run
from escort_mj.record.team import rings
from escort_mj.report.video.film import frame_times
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario.schema.scenario import Video


@pytest.fixture(scope="module")
def trace(make_run):
    return read_run(make_run()).trace


def test_between_two_samples_everything_is_straight(trace):
    replay = replay_of(trace)
    moment = replay.at(1.025)
    assert (moment.sample, round(moment.share, 9)) == (10, 0.25)
    expected = 0.75 * trace["q"].values[10] + 0.25 * trace["q"].values[11]
    np.testing.assert_allclose(moment.robots[:, :2], expected)
    np.testing.assert_allclose(moment.robots[:, 2], trace["robot_radius"].values)
    np.testing.assert_allclose(moment.qpos, expected.ravel())


@pytest.mark.parametrize(("time", "row"), [(-1.0, 0), (0.0, 0), (5.9, -1), (99.0, -1)])
def test_outside_of_the_record_its_ends_stay(trace, time, row):
    moment = replay_of(trace).at(time)
    np.testing.assert_allclose(moment.target[:2], trace["target_position"].values[row])


def test_one_sample_is_enough_and_none_is_not(trace):
    moment = replay_of(trace.isel(time=[0])).at(3.0)
    np.testing.assert_allclose(moment.robots[:, :2], trace["q"].values[0])
    with pytest.raises(RenderError):
        replay_of(trace.isel(time=[]))


def test_a_short_event_stays_visible(trace):
    flags = np.zeros((trace.sizes["time"], 5), bool)
    flags[20, 3] = True  # at 2.0 s
    replay = replace(replay_of(trace), avoiding=flags, touching=flags[:, ::-1])
    seen = [replay.lately(replay.at(t), 0.5) for t in (1.9, 2.0, 2.4, 2.6)]
    assert [bool(avoiding[3]) for avoiding, _ in seen] == [False, True, True, False]
    assert [bool(touching[1]) for _, touching in seen] == [False, True, True, False]
    avoiding, touching = replay.lately(replay.at(2.2), 0.5)
    assert avoiding.sum() == touching.sum() == 1


def test_a_trail_ends_now_and_its_points_stay_put(trace):
    replay = replay_of(trace)
    early = replay.past(replay.time, replay.at(4.03), 2.0, 10)
    late = replay.past(replay.time, replay.at(4.11), 2.0, 10)
    assert early[-1] <= 4.03 and early[0] >= 2.0
    assert set(np.round(early[1:], 9)) <= set(np.round(late, 9))
    assert len(replay.past(replay.time, replay.at(0.0), 2.0, 10)) == 0


def test_frames_are_evenly_spaced_and_end_with_the_run():
    times = frame_times(0.0, 6.0, Video(rate=30, speed=4.0))
    assert len(times) == 46 and times[0] == 0.0 and times[-1] == 6.0
    np.testing.assert_allclose(np.diff(times), 4 / 30, atol=1e-9)
    assert frame_times(0.0, 0.0, Video()).tolist() == [0.0]


def test_rings_are_those_of_the_time_each_once(compiled):
    """The robots of a phase keep another radius, which grows, and one that failed keeps none."""
    grows = {"behavior": "surface", "radius": "3 + 0.5*t"}
    scenario = Scenario(
        duration=4.0, robots={"count": 3, "failures": [{"robot": 3, "at": 2.0, "notice": 0.0}]},
        mission={"radius": 2.0, "behaviors": ["surface"],
                 "supervisor": [{"name": "out", "after": 1.0, "behaviors": [grows]}]},
    )  # fmt: skip
    replay = replay_of(fly(scenario).recording)
    assert replay.rings(replay.at(0.5)) == [2.0]
    assert replay.rings(replay.at(3.01)) == pytest.approx([4.505], abs=0.01)
    assert replay.radius == pytest.approx(5.0, abs=0.01)
    assert rings(np.array([2.0, 4.0, 2.0, 3.0]), np.array([False, False, False, True])) == [2.0, 4.0]
    goals = {"behaviors": [{"behavior": "goal", "goals": [[0, 0], [2, 0], [4, 0]]}]}
    without = replay_of(fly(scenario.replace(target=None, mission=goals)).recording)
    assert without.rings(without.at(1.0)) == []
