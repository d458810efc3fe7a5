"""Missions stepped from Python: plain runs if untouched; snapshots repeat bit for bit."""

import copy

import numpy as np
import pytest

import escort_mj
from escort_mj.errors import UsageError
from escort_mj.record.outcome import Outcome

SHORT = {"duration": 1.0, "expect": []}
FREE = SHORT | {"robots.force_limit": None, "uncertainty": {}, "sensing": {}}


def test_untouched_it_is_the_plain_run() -> None:
    plain = escort_mj.run(escort_mj.load_scenario("main", SHORT))
    mission = escort_mj.start("main", SHORT)
    assert mission.time == 0.0 and mission.outcome is Outcome.RUNNING
    for seconds in (0.1, 0.333, None, 0.007, 5.0):
        mission.step(seconds)
    run = mission.run()
    assert mission.outcome is run.outcome is Outcome.COMPLETED and run.message == plain.message
    assert set(run.trace.data_vars) == set(plain.trace.data_vars)
    for name in plain.trace.data_vars:
        np.testing.assert_array_equal(run.trace[name].values, plain.trace[name].values, err_msg=str(name))
    with pytest.raises(UsageError, match="the mission has ended: completed 1 s"):
        mission.step()


def test_state_is_what_is_recorded_at_that_time() -> None:
    mission = escort_mj.start("main", SHORT).step(0.4)
    assert mission.time == pytest.approx(0.4)
    trace = mission.run().trace
    assert float(trace["time"][-1]) == mission.time
    state = mission.state
    for name in ("q", "v", "tau", "target_position", "task_error"):
        np.testing.assert_array_equal(state[name], trace[name].values[-1])
    state["q"][:] = 0.0
    assert mission["q"].any(), "what users get is a copy"
    with pytest.raises(UsageError, match='did you mean "tau"'):
        mission["tauu"]


def test_a_look_at_the_run_leaves_a_push_as_it_is() -> None:
    watched, alone = (escort_mj.start("main", FREE).step(0.1) for _ in range(2))
    for mission in (watched, alone):
        mission.push(2, [60.0, 0.0], seconds=0.2)
    assert float(watched.run().trace["time"][-1]) == watched.time == pytest.approx(0.1), "it does not go on"
    for mission in (watched, alone):
        mission.step(0.1)
    assert watched["v"][1, 0] > escort_mj.start("main", FREE).step(0.2)["v"][1, 0] + 1.0
    watched.run()
    for mission in (watched, alone):
        mission.step(0.3)
    np.testing.assert_array_equal(watched.run().trace["q"].values, alone.run().trace["q"].values)


def test_a_push_is_a_force_for_its_time() -> None:
    """Robot 2, left alone otherwise, gains the impulse divided by its mass."""
    pushed, free = (escort_mj.start("main", FREE) for _ in range(2))
    for mission in (pushed, free):
        mission.change({"controller": {"law": "pd", "proportional_gain": 0, "derivative_gain": 0}})
    pushed.push(2, [5.0, -2.0], seconds=0.05)
    for mission in (pushed, free):
        mission.step(0.2)
    gained = pushed["v"] - free["v"]
    mass = float(pushed.run().trace["robot_mass"][1])
    np.testing.assert_allclose(gained[1], np.array([5.0, -2.0]) * 0.05 / mass, rtol=1e-9)
    np.testing.assert_allclose(np.delete(gained, 1, axis=0), 0.0, atol=1e-12)
    assert "robot 2 is pushed by [5.0, -2.0] N for 0.05 s" in pushed.run().trace.attrs["interventions"]


def test_a_change_of_nothing_changes_no_bit() -> None:
    plain, changed = (escort_mj.start("main", SHORT).step(0.25) for _ in range(2))
    changed.change()
    runs = [mission.step(0.75).run().trace for mission in (plain, changed)]
    for name, values in runs[0].data_vars.items():
        np.testing.assert_array_equal(runs[1][name].values, values.values, err_msg=str(name))


def test_changed_gains_act_from_the_next_step_on() -> None:
    mission = escort_mj.start("main", SHORT).step(0.2)
    before = mission["tau"]
    mission.change({"controller.derivative_gain": 0.0, "controller.proportional_gain": 0.0})
    np.testing.assert_array_equal(mission["tau"], before)
    assert np.abs(mission.step()["tau"] - before).max() > 1.0
    assert mission.scenario.controller.derivative_gain == 0.0  # type: ignore[union-attr]


def test_the_target_goes_where_it_is_moved() -> None:
    mission = escort_mj.start("main", SHORT).step(0.2)
    mission.move_target([3.0, -1.0], velocity=[0.5, 0.0])
    mission.step(0.002)
    np.testing.assert_allclose(mission["target_position"], [3.0, -1.0], atol=1e-12)
    mission.step(0.4)
    np.testing.assert_allclose(mission["target_position"], [3.2, -1.0], atol=1e-9)
    np.testing.assert_allclose(mission["target_velocity"], [0.5, 0.0], atol=1e-12)


def test_a_snapshot_repeats_bit_for_bit_past_changes() -> None:
    mission = escort_mj.start("main", SHORT).step(0.3)
    then = mission.snapshot()
    first = mission.step(0.3)["q"]
    mission.change({"mission.radius": 3.0})
    mission.push(1, [9.0, 0.0])
    other = mission.step(0.3)["q"]
    mission.restore(then)
    assert mission.time == pytest.approx(0.3) and not mission.notes
    np.testing.assert_array_equal(mission.step(0.3)["q"], first)
    assert np.abs(mission.step(0.3)["q"] - other).max() > 1e-3


def test_watchers_see_each_sample_and_may_intervene() -> None:
    seen: list[float] = []

    def watch(mission: escort_mj.LiveMission) -> None:
        seen.append(mission.time)
        if len(seen) == 3:
            mission.push(1, [1.0, 0.0], 0.01)

    mission = escort_mj.start("main", SHORT)
    mission.on_sample(watch)
    mission.step(0.2)
    assert seen == pytest.approx(np.arange(0.02, 0.201, 0.02))
    assert mission.notes == ["0.06 s: robot 1 is pushed by [1.0, 0.0] N for 0.01 s"]


@pytest.mark.parametrize(
    ("do", "words"),
    [
        (lambda m: m.push(6, [0, 0]), "robot: found 6; expected a number from 1 to 5"),
        (lambda m: m.push(1, [0, 0, 0]), "force: found the shape \\(3,\\); expected 2 components"),
        (lambda m: m.push(1, [0, 0], seconds=0), "seconds: found 0"),
        (lambda m: m.step(-1), "seconds: found -1"),
        (lambda m: m.step(float("nan")), "seconds: found NaN"),
        (lambda m: m.step("x"), 'seconds: found "x"'),
        (lambda m: m.step(1e308), "seconds: found 1e\\+308; expected a time above 0 and of at most 1e\\+09"),
        (lambda m: m.step(True), "seconds: found true"),
        (lambda m: m.push(1.5, [1, 0]), "robot: found 1.5; expected a number from 1 to 5"),
        (lambda m: m.push(True, [1, 0]), "robot: found true"),
        (lambda m: m.push(1, "x"), 'force: found "x"; expected 2 components'),
        (lambda m: m.push(1, [1e308, 0]), "force: found 1e\\+308 at \\[0\\]; every number must be between"),
        (lambda m: m.push(1, [1j, 0]), "force: found"),
        (lambda m: m.release(99), "robot: found 99"),
        (lambda m: m.state["qq"], 'qq: is not a signal of this mission; did you mean "q"'),
        (lambda m: m[0], "signal: found 0; expected the name of a signal"),
        (lambda m: m.change(None), "changes: found None; expected values by key path"),
        (lambda m: m.change([3]), "changes: found \\[3\\]"),
        (lambda m: m.restore(5), "snapshot: found 5; expected a Snapshot"),
        (
            lambda m: m.restore(escort_mj.start("main", SHORT | {"duration": 2.0}).snapshot()),
            "snapshot: is that of another mission",
        ),
        (copy.deepcopy, "LiveMission: cannot be copied or pickled; make another, and `restore` there"),
        (lambda m: m.on_sample(5), "watcher: found 5; expected a function"),
        (lambda m: m.move_target([1]), "position: found"),
        (lambda m: m.change({"robots.count": 6}), "the number of robot entries becomes 6; it is 5"),
        (lambda m: m.step(0.3).change(duration=0.1), "duration becomes 0.1 s; expected more than 0.3 s"),
        (lambda m: m.step(0.3).change(duration=0.3), "the duration becomes 0.3 s; expected more than 0.3 s"),
        (lambda m: m.change({"physics.timestep": 0.001}), "the timestep and the rate of recording"),
    ],
)
def test_wrong_calls_are_one_clear_error(do: object, words: str) -> None:
    mission = escort_mj.start("main", SHORT)
    with pytest.raises(UsageError, match=words):
        do(mission)  # type: ignore[operator]
    assert mission.step(0.1).outcome is Outcome.RUNNING
