"""When samples are taken."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.errors import ScenarioError
from escort_mj.scenario.geometry.steps import Schedule, first_step, last_step, schedule_of
from escort_mj.scenario.reader.load import parse_scenario


@settings(max_examples=60)
@given(
    stride=st.integers(1, 9),
    last=st.integers(0, 60),
    extra=st.sets(st.integers(1, 60), max_size=8),
    data=st.data(),
)
def test_a_schedule_is_the_list_of_its_steps(stride, last, extra, data):
    extra = tuple(sorted(step for step in extra if step <= last and step % stride))
    schedule = Schedule(stride, last, extra)
    steps = sorted({*range(0, last + 1, stride), *extra})
    assert [schedule.step(sample) for sample in range(schedule.count)] == steps
    step = data.draw(st.integers(0, last + 1))
    assert schedule.before(step) == sum(one < step for one in steps)
    assert schedule.step(schedule.count) > last


@pytest.mark.parametrize("timestep", [0.002, 1e-3, 1 / 240, 0.1])
def test_sums_of_timesteps_are_at_their_steps(timestep):
    times = np.cumsum(np.full(100_000, timestep))
    for step in (1, 7, 4321, 100_000):
        for time in (times[step - 1], step * timestep):
            assert first_step(time, timestep) == last_step(time, timestep) == step
        assert first_step(times[step - 1] + 0.5 * timestep, timestep) == step + 1


def scheduled(**keys):
    return schedule_of(parse_scenario("duration: 10", "s", keys))


class TestOfAScenario:
    def test_the_last_step_is_sampled(self):
        assert scheduled(duration=5.0190) == Schedule(10, 2509, (2509,))
        assert scheduled(duration=5.02) == Schedule(10, 2510)

    def test_ends_of_windows(self):
        force = {"metric": "force_rms", "at_most": 9, "after": 4}
        assert scheduled(expect=[force, {"settled": 1.0, "by": 4.001, "before": 4.9}]).extra == (2001,)

    @pytest.mark.parametrize(
        "expect",
        [
            {"clearance": ["robots", "robots"], "at_least": 0.3},
            {"metric": "robot_clearance_min", "at_least": 0.3},
            {"sanity": "all"},
            {"contacts": "none"},
        ],
    )
    def test_the_step_before_a_window_of_what_is_watched_between_samples(self, expect):
        assert scheduled(expect=[expect | {"after": 4.0, "before": 4.95}]).extra == (1999, 2475)
        assert scheduled(expect=[expect]).extra == ()

    @pytest.mark.parametrize(("after", "before"), [(4.0005, 4.0015), (0.0001, 0.0019)])
    def test_a_window_between_two_steps_is_refused(self, after, before):
        with pytest.raises(ScenarioError, match="its window holds no physics step: after"):
            scheduled(expect=[{"contacts": "none", "after": after, "before": before}])

    def test_a_run_of_less_than_a_step_is_refused(self):
        with pytest.raises(ScenarioError, match="expected a duration at least one"):
            scheduled(duration=0.0015)
