"""The contact log in a trace: sorted, typed, saved; and what readers ask of it."""

import numpy as np
import pytest
import xarray

from escort_mj.record.episodes import apart_from, during, pair, touched
from escort_mj.record.trace import load_recording, save_trace
from escort_mj.signals import EPISODE as COLUMNS

TIME = 0.02 * np.arange(6)  # samples; a physics step is 2 ms


def episode(first: int, second: int, start: float, steps: int, peak: float = 5.0) -> list[float]:
    """A touch of so many physics steps."""
    lasts = 0.002 * steps
    return [first, second, start, start + lasts, lasts, peak, start, peak * lasts, 1e-4, 0.3]


@pytest.fixture
def trace(make_trace):
    """Two robots, target, one obstacle, floor; given in another order than they began."""
    rows = [
        episode(0, 4, 0.0, 51),  # robot 1 on the floor, all the time
        episode(1, 3, 0.05, 1),  # robot 2 at rock 1, one step between two samples
        episode(0, 1, 0.03, 5),  # robots 1 and 2, from 30 to 38 ms
    ]
    return make_trace(TIME, robots=2, obstacles=1, episodes=rows)


def test_every_column_is_a_variable_in_order_of_the_first_touch(trace) -> None:
    for column in COLUMNS:
        assert trace[column.name].dims == ("episode",)
        assert trace[column.name].attrs == {"units": column.unit, "long_name": column.meaning}
    assert trace["episode_start"].values.tolist() == [0.0, 0.03, 0.05]
    assert trace["episode_first"].dtype == np.int32
    names = trace["body"].values
    assert [(names[a], names[b]) for a, b in zip(trace.episode_first, trace.episode_second, strict=True)] == [
        ("robot_1", "floor"),
        ("robot_1", "robot_2"),
        ("robot_2", "rock 1"),
    ]
    assert pair(trace, 2) == ("robot_2", "rock 1")


def test_a_file_gives_the_episodes_back(trace, tmp_path) -> None:
    save_trace(trace, tmp_path / "trace.nc")
    xarray.testing.assert_identical(load_recording(tmp_path / "trace.nc").to_dataset(), trace)


def test_a_window_has_the_episodes_with_a_step_in_it(trace) -> None:
    def starts(start: float, end: float) -> list[float]:
        return during(trace, start, end)["episode_start"].values.tolist()

    assert starts(0.0, 0.1) == [0.0, 0.03, 0.05]
    assert starts(0.038, 0.05) == [0.0, 0.03, 0.05]
    assert starts(0.04, 0.048) == [0.0]  # the robots' last step is at 38 ms
    assert starts(0.052, 0.1) == [0.0]


def test_groups_can_be_left_out(trace) -> None:
    assert apart_from(trace, "floor").tolist() == [False, True, True]
    assert apart_from(trace, "obstacles", "floor").tolist() == [False, True, False]


def test_a_robot_touches_in_the_sample_after_each_step(trace) -> None:
    flags = touched(trace)
    assert flags[:, 0].tolist() == [False, False, True, False, False, False]
    assert flags[:, 1].tolist() == [False, False, True, True, False, False]


def test_a_touch_after_the_last_sample_has_no_sample(make_trace) -> None:
    trace = make_trace(TIME, robots=2, episodes=[episode(0, 1, 0.104, 2)])
    assert not touched(trace).any()


def test_a_run_without_contacts_has_an_empty_log(make_trace) -> None:
    trace = make_trace(TIME)
    assert trace.sizes["episode"] == 0 and not touched(trace).any()
