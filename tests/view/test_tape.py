"""What a viewer reads: the same samples live as recorded, at any time that there is."""

import numpy as np
import pytest

from escort_mj import api
from escort_mj.errors import RunFolderError
from escort_mj.mission import fly
from escort_mj.record.folder import RunFolder
from escort_mj.scenario import parse_scenario
from escort_mj.view.tape import Live, Stored, _rows

MISSION = """
name: seen
duration: 2
robots: {count: 3, positions: [[0, 3], [3, 0], [-3, 0]]}
target: {position: ["0.2*t", 0]}
obstacles: [{position: [6, 0], radius: 0.5}]
expect: [{contacts: none}]
"""


@pytest.fixture(scope="module")
def recorded(compiled, tmp_path_factory):
    scenario = parse_scenario(MISSION)
    with RunFolder.create(tmp_path_factory.mktemp("run") / "seen") as folder:
        return scenario, folder.path, fly(scenario, folder)


def test_live_samples_are_those_of_a_run(recorded) -> None:
    scenario, _, run = recorded
    tape = Live(scenario)
    assert tape.reached == 0.0 and not tape.ending and tape.end == pytest.approx(2.0)
    tape.advance(0.5, np.inf)
    assert tape.reached == pytest.approx(0.5) and not tape.verdicts
    tape.advance(99.0, np.inf)
    part, _ = tape.around(2.0, 2.0, 10_000)
    for name in ("time", "q", "force", "qpos", "clearance", "ruling"):
        np.testing.assert_array_equal(part[name].values, run.trace[name].values)
    assert tape.ending == "completed 2 s" and tape.well
    assert tape.verdicts == run.verdicts


def test_live_samples_where_a_window_begins_and_the_run_ends(compiled) -> None:
    window = {"contacts": "none", "after": 0.051, "before": 0.1}
    scenario = parse_scenario(MISSION, "s", {"duration": 0.213, "expect": [window]})
    run = fly(scenario)
    tape = Live(scenario)
    tape.advance(99.0, np.inf)
    part, _ = tape.around(2.0, 2.0, 10_000)
    assert tape.reached == pytest.approx(0.212) and tape.end == pytest.approx(0.212)
    assert tape.ending == run.message == "completed 0.212 s" and tape.verdicts == run.verdicts
    assert part["time"].values[[3, 4, -1]] == pytest.approx([0.05, 0.052, 0.212])
    np.testing.assert_array_equal(part["clearance"].values, run.trace["clearance"].values)


def test_what_is_moved_is_there_in_the_next_sample(recorded) -> None:
    tape, untouched = Live(recorded[0]), Live(recorded[0])
    assert tape.movable == ("target", "obstacle_1")
    assert Live(recorded[0].replace({"target": {"policy": "flee"}})).movable == ("obstacle_1",)
    tape.advance(0.5, np.inf)
    tape.move("target", np.array([1.0, 2.0, 0.4]))
    tape.move("obstacle_1", np.array([0.0, -4.0, 0.4]))
    for each in (tape, untouched):
        each.advance(1.0, np.inf)
    part, _ = tape.around(1.0, 1.0, 10_000)
    np.testing.assert_allclose(part["target_position"].values[[25, 26]], [[0.1, 0.0], [1.0, 2.0]], atol=1e-12)
    np.testing.assert_array_equal(part["obstacle_position"].values[26], [[0.0, -4.0]])
    assert tape.model.body("obstacle_1").pos[:2].tolist() == [0.0, -4.0]
    other = untouched.around(1.0, 1.0, 10_000)[0]
    np.testing.assert_array_equal(part["q"].values[:26], other["q"].values[:26])
    assert np.abs(part["q"].values[-1] - other["q"].values[-1]).max() > 0.05


def test_a_small_budget_goes_a_small_way(recorded) -> None:
    tape = Live(recorded[0])
    tape.advance(2.0, 0.0)
    assert tape.reached == 0.0


def test_a_recorded_run_is_all_there(recorded) -> None:
    _, path, run = recorded
    tape = Stored(path)
    assert tape.reached == tape.end == pytest.approx(2.0) and tape.title == "seen"
    assert [one.message for one in tape.verdicts] == [one.message for one in run.verdicts]
    assert tape.ending == "completed 2 s"
    part, replay = tape.around(1.0, 0.5, 10_000)
    assert part["time"].values[0] == pytest.approx(0.5) and part["time"].values[-1] == pytest.approx(1.02)
    moment = replay.at(1.01)
    at = [run.trace["q"].values[k] for k in (50, 51)]
    np.testing.assert_allclose(moment.robots[:, :2], np.mean(at, axis=0), atol=1e-9)


def test_rows_end_with_two_neighbors_and_are_not_too_many() -> None:
    times = np.arange(1000) / 100
    rows = _rows(times, 5.004, 3.0, 50)
    assert rows[-2:].tolist() == [500, 501] and len(rows) <= 52 and rows[0] >= 199
    assert _rows(times, 99.0, 0.05, 50).tolist()[-1] == 999
    assert _rows(times, 0.0, 3.0, 50).tolist() == [0, 1]
    assert _rows(times[:1], 0.0, 3.0, 50).tolist() == [0]


def test_a_mission_that_diverges_ends_with_its_outcome(compiled) -> None:
    tape = Live(api.load_scenario("faults/blown_away"))
    tape.advance(60.0, np.inf)
    assert "m from the target" in tape.ending and tape.reached < tape.end
    assert [verdict.passed for verdict in tape.verdicts] == [True, True]
    assert tape.around(tape.reached, 1.0, 100)[1].end == tape.reached


def test_folders_that_hold_nothing_to_see(tmp_path) -> None:
    with pytest.raises(RunFolderError, match="is this a run folder"):
        Stored(tmp_path)
