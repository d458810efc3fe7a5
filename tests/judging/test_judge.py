"""Logs judged as runs are: what a run exports comes back as the same metrics and verdicts."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest

import escort_mj
from escort_mj.api.runs import Run
from escort_mj.errors import LogError, UsageError
from escort_mj.mission import fly
from escort_mj.scenario import Scenario
from tests.corpus import assert_said, missions, read
from tests.test_examples import example

FINE = 1e-9
BETWEEN = {"obstacle_clearance_min": 1e-3, "robot_clearance_min": 1e-3, "tunneling": 0.02}
BETWEEN |= {"kinetic_energy_max": 0.04, "tracking_error_rms": 0.01, "radius_error_max": 0.01}
"""Watched at every physics step of the run, of which its export has samples only: relative differences."""
MISSIONS = missions(__file__)
LATE = '''"""Fails at 1.5 s."""

from typing import Literal

from escort_mj.plugins import Behavior, Robots, Task, keep, unit_axis


class Late(Behavior):
    """Fail after a while."""

    behavior: Literal["late"] = "late"

    def task(self, r: Robots) -> Task:
        """Return the task."""
        if r.time > 1.501:
            raise ValueError("too late")
        return keep(r.q[0], 0.0, unit_axis(r.q, 0), 1.0)
'''


OF_THE_LAW = {
    "tracking_error_rms", "tracking_error_max", "tracking_time", "true_error_rms", "true_error_max",
    "outer_update_rate",
}  # fmt: skip


@pytest.fixture(scope="module")
def run(compiled: None) -> Run:
    return Run(fly(mission("judged")))


@pytest.fixture(scope="module")
def exported(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported")
    for suffix in ("csv", "parquet", "mcap"):
        pytest.importorskip({"csv": "csv", "parquet": "pyarrow", "mcap": "mcap"}[suffix])
        if suffix == "mcap":
            run.save(folder / "run")
            example("foxglove").convert(folder / "run", folder / "run.mcap")
        else:
            run.export(folder / f"run.{suffix}")
    return folder


SECOND = 50  # the row of 1 s


def positions(run: Run) -> pandas.DataFrame:
    """What robots would log of a run: positions alone."""
    table = {"time": run.trace["time"].values.round(9)}
    for k, robot in enumerate(run.trace["robot"].values):
        for axis in "xy":
            table[f"robot_{robot}.{axis}"] = run.trace["q"].sel(axis=axis).values[:, k]
    for axis in "xy":
        table[f"target.{axis}"] = run.trace["target_position"].sel(axis=axis).values
    return pandas.DataFrame(table)


@pytest.mark.slow_cases("csv")
@pytest.mark.parametrize("suffix", ["csv", "parquet", "mcap"])
def test_an_exported_run_is_judged_alike(run: Run, exported: Path, suffix: str) -> None:
    judged = escort_mj.judge(exported / f"run.{suffix}", run.scenario)
    law = OF_THE_LAW if suffix == "mcap" else set()
    sums = {"force_rms", "chattering", "energy", "saturated_share"} if suffix == "mcap" else set()
    for name, value in run.values.items():
        found = judged.values[name]
        if name in law:
            assert math.isnan(found) and "does not contain" in judged.metrics[name]["reason"]
        elif name in BETWEEN:
            assert found == pytest.approx(value, rel=BETWEEN[name]), name
        elif name not in sums:
            assert found == pytest.approx(value, rel=FINE, abs=FINE, nan_ok=True), name
    for then, now in zip(run.verdicts, judged.verdicts, strict=True):
        missing = then.metric == "sanity" or then.metric in law
        assert bool(now.skip) == missing and now.passed == then.passed, now.message
    assert judged.verdicts[1].message.endswith("none, by geometry")


def test_forces_sum_up_as_in_the_loop(compiled: None, tmp_path: Path) -> None:
    scenario = mission("judged", recording={"rate": 500}, duration=0.4, expect=[])
    run = Run(fly(scenario))
    table = positions(run)
    for signal, letter in (("v", "v"), ("force", "f")):
        for k in range(3):
            for axis in "xy":
                values = run.trace[signal].sel(axis=axis).values[:, k]
                table[f"robot_{k + 1}.{letter}{axis}"] = values
    judged = judged_of(table, tmp_path, scenario)
    for name in ("force_rms", "chattering", "energy", "saturated_share"):
        assert judged.values[name] == pytest.approx(run.values[name], rel=0.02, abs=1e-6), name


def test_positions_alone_tell_where_bodies_were(run: Run, tmp_path: Path) -> None:
    wide = positions(run)
    wide["time"] += 1.7e9
    wide.to_csv(tmp_path / "wide.csv", index=False)
    rows = [
        pandas.DataFrame(
            {"time": wide["time"], "name": called, "x": wide[f"{name}.x"], "y": wide[f"{name}.y"]}
        )
        for name, called in (("robot_1", "a"), ("robot_2", "b"), ("robot_3", "robot_3"), ("target", "target"))
    ]
    pandas.concat(rows).sort_values("time").to_csv(tmp_path / "long.csv", index=False)
    first = escort_mj.judge(tmp_path / "wide.csv", run.scenario)
    second = escort_mj.judge(tmp_path / "long.csv", run.scenario, names={"robot_1": "a", "robot_2": "b"})
    assert first.values == pytest.approx(second.values, nan_ok=True)
    for name in ("radius_error_max", "spacing_error_max", "energy_ratio", "hull_margin"):
        assert first.values[name] == pytest.approx(run.values[name], rel=1e-5), name
    speeds = first.trace["v"].values - run.trace["v"].values
    assert np.median(np.abs(speeds)) < 2e-3  # central differences of positions
    unknown = first.trace.attrs["not_logged"].split()
    assert {"e", "s", "tau", "rho_hat", "force"} <= set(unknown) and "v_d" not in unknown
    assert [bool(one.skip) for one in first.verdicts] == [False, False, False, False, True, True, True, False]


def test_bodies_log_at_their_own_times(run: Run, tmp_path: Path) -> None:
    table = positions(run)
    table = table[_even(table["time"].values)].reset_index(drop=True)
    table.loc[::2, ["robot_1.x", "robot_1.y"]] = np.nan  # as tables that were joined have it
    judged = judged_of(table, tmp_path, run.scenario)
    assert judged.trace.attrs["log_start"] == pytest.approx(0.02)
    seen, there = (one.trace["q"].values[_even(one.trace["time"].values)] for one in (judged, run))
    off = seen - there[1:-1]
    assert np.abs(off[:, 1:]).max() < 1e-9 and np.abs(off[::2]).max() < 1e-9
    assert 1e-7 < np.abs(off[1::2, 0]).max() < 5e-3  # between two of its stamps


def judged_of(table: pandas.DataFrame, folder: Path, scenario: Scenario) -> Run:
    """The judgment of a log that a table is written to."""
    return escort_mj.judge(written(table, folder), scenario)


def written(table: pandas.DataFrame, folder: Path) -> Path:
    table.to_csv(folder / "log.csv", index=False)
    return folder / "log.csv"


def _even(time: np.ndarray) -> np.ndarray:
    """Which samples are those of the rate, and not of a window."""
    return np.abs(time / 0.02 - np.rint(time / 0.02)) < 1e-6


def test_forces_of_touches_are_not_judged(compiled: None, tmp_path: Path) -> None:
    run = Run(fly(mission("smash")))
    outcome, bounds, none, force = judged_of(positions(run), tmp_path, run.scenario).verdicts
    assert run.values["contacts"] == 1.0
    assert outcome.passed and not outcome.skip
    assert bounds.skip and force.skip and "knows no force" in force.message
    assert not none.skip and not none.passed  # there was a touch, whatever its force


def test_a_log_in_a_folder_is_a_run(run: Run, exported: Path, one_figure: None, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    escort_mj.judge(written(positions(run), tmp_path), run.scenario, folder, report=True)
    stored = escort_mj.open_run(folder)
    assert stored.message == "log of real robots: 3 s of log.csv" and stored.passed
    assert "forces" not in stored.figures and (folder / "figures" / "panels.png").is_file()
    page = (folder / "report.html").read_text()
    assert "log of real robots" in page and "tracking error |e|" not in page
    assert escort_mj.open_run(folder).values == pytest.approx(stored.values, nan_ok=True)
    from escort_mj.study.sweeps.rerun import rerun_folder

    with pytest.raises(UsageError, match="cannot be repeated"):
        rerun_folder(folder)
    stored.export(tmp_path / "again.csv")
    again = escort_mj.judge(tmp_path / "again.csv", run.scenario)
    assert again.values["radius_error_max"] == pytest.approx(stored.values["radius_error_max"], rel=FINE)


WRONG = {case["what"]: case for case in read(Path(__file__).with_name("wrong.yaml"))}


def spoiled(table: pandas.DataFrame, case: dict[str, Any]) -> pandas.DataFrame:
    """A log as `wrong.yaml` says: columns dropped, named, added and scaled, cells of one row, fewer rows."""
    table = table.drop(columns=case.get("drop", [])).rename(columns=case.get("rename", {}))
    table = table.assign(**case.get("columns", {}))
    for start, factor in case.get("scale", {}).items():
        table[[name for name in table if name.startswith(start)]] *= factor
    for name, value in case.get("cells", {}).items():
        table.loc[table.index[case.get("at", SECOND)], name] = value
    return table.assign(time=table["time"] + case["later"]) if "later" in case else table[: case.get("rows")]


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_log(run: Run, tmp_path: Path, what: str) -> None:
    case = WRONG[what]
    with pytest.raises(LogError) as caught:
        judged_of(spoiled(positions(run), case), tmp_path, run.scenario)
    assert_said(caught.value, case["said"])


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_signal_without_any_number_is_not_logged(run: Run, tmp_path: Path) -> None:
    empty = {f"e.robot_{k}.{x}": math.nan for k in (1, 2, 3) for x in "xy"}
    judged = judged_of(positions(run).assign(**empty), tmp_path, run.scenario)
    assert judged.verdicts[4].skip == "the log does not contain e" and judged.outcome == "completed"


def passing(tmp_path: Path, *gaps: tuple[float, float], who: tuple[int, ...] = (1, 2)) -> Path:
    """A log of two robots that drive through each other, at 1 m/s from 4 m apart, with gaps."""
    time = 0.02 * np.arange(201.0)
    table = {"time": time + 50.0}
    for robot, way in ((1, time - 2.0), (2, 2.0 - time)):
        for start, end in gaps if robot in who else ():
            way = np.where((time > start) & (time < end), np.nan, way)
        table |= {f"robot_{robot}.x": way, f"robot_{robot}.y": np.where(np.isnan(way), np.nan, 0.0)}
    return written(pandas.DataFrame(table), tmp_path)


@pytest.mark.parametrize("who", [(1, 2), (2,)])
def test_a_log_is_judged_around_its_gaps(compiled: None, tmp_path: Path, who: tuple[int, ...]) -> None:
    scenario = mission("passing")
    whole = escort_mj.judge(passing(tmp_path), scenario)
    assert [one.passed for one in whole.verdicts] == [True, False, False, False, True]
    met = escort_mj.judge(passing(tmp_path, (3.0, 3.6), who=who), scenario)  # a gap elsewhere
    assert [one.passed for one in met.verdicts] == [one.passed for one in whole.verdicts]
    assert met.verdicts[1].time == whole.verdicts[1].time and met.verdicts[1].value == whole.verdicts[1].value
    missed = escort_mj.judge(passing(tmp_path, (1.5, 2.5), who=who), scenario)
    bodies = "all bodies" if len(who) == 2 else "robot 2"
    told = f"not logged, and not judged, for 1 s: from 1.5 to 2.5 s ({bodies})"
    assert missed.message.endswith(told)
    words = "; not judged from 1.5 to 2.5 s, which the log lacks"
    outcome, touches, inside, apart, before = missed.verdicts
    assert touches.passed and touches.message.endswith(words) and words not in outcome.message
    assert inside.skip == "the log has no positions from 1.5 to 2.5 s" and not inside.near_miss
    assert apart.passed and apart.message.endswith(words)  # its window begins in the gap
    assert apart.value == pytest.approx(2 * 0.5 - 2 * 0.2) and apart.time == 2.5  # and not 2.1
    assert not before.skip and words not in before.message
    time = missed.trace["time"].values
    assert not ((time > 1.5) & (time < 2.5)).any() and {1.5, 2.5} <= set(time.round(9))


def test_a_gap_counts_for_no_time(compiled: None, tmp_path: Path) -> None:
    """Means and rates are those of the two parts, by how long they are."""
    time = 0.02 * np.arange(301.0)
    table = {"time": time}
    for robot in (1, 2):
        table |= {f"robot_{robot}.x": np.full(301, 2.0 * robot - 3.0), f"robot_{robot}.y": 0.0 * time}
        table |= {f"robot_{robot}.fx": np.where(time < 1.0, 3.0, 1.0), f"robot_{robot}.fy": 0.0 * time}
    log, log_path = pandas.DataFrame(table), tmp_path / "log.csv"
    log[(log.time <= 2.0) | (log.time >= 5.0)].to_csv(log_path, index=False)
    scenario = mission("passing", duration=6, target={"position": [0, 1]}, expect=[])
    found = escort_mj.judge(log_path, scenario)
    assert found.values["force_rms"] ** 2 == pytest.approx((9.0 * 1.0 + 1.0 * 2.0) / 3.0, rel=0.02)
    judged = escort_mj.judge(log_path, scenario.replace({"target.position": ["t", 1]}))
    error = np.abs(np.sqrt(1.0 + (judged.trace["target_position"].values[:, 0] - [[1], [-1]]) ** 2) - 1.0)
    known = judged.trace["time"].values
    parts = [(known <= 2.0, 2.0), (known >= 5.0, 1.0)]
    expected = sum(np.trapezoid(error[:, part].mean(axis=0), known[part]) for part, _ in parts) / 3.0
    window = {"metric": "radius_error_mean", "at_most": 100}
    mean = escort_mj.judge(log_path, judged.scenario.replace({"expect": [window]})).verdicts[1]
    assert mean.value == pytest.approx(expected, rel=0.01)


def test_a_mission_begins_and_ends_outside_of_gaps(compiled: None, tmp_path: Path) -> None:
    scenario = mission("passing", expect=[])
    log = pandas.read_csv(passing(tmp_path, (0.0, 0.8), (3.2, 5.0), who=(2,)))
    log.loc[0, ["robot_1.x", "robot_1.y"]] = np.nan  # logged from 50.02 s on, in the gap of robot 2
    found = judged_of(log, tmp_path, scenario)
    assert found.trace.attrs["log_start"] == pytest.approx(50.8)
    assert found.trace["time"].values[-1] == pytest.approx(2.4) and "not judged" not in found.message
    with pytest.raises(LogError, match=r"--start 50.5: the log has no position of robot 2 from 50 to 50.8 s"):
        escort_mj.judge(tmp_path / "log.csv", scenario, start=50.5)
    never = pandas.read_csv(passing(tmp_path, (0.0, 2.0), who=(1,)))
    never.loc[never.time > 51.9, ["robot_2.x", "robot_2.y"]] = np.nan
    with pytest.raises(LogError, match="no time at which all bodies are logged"):
        judged_of(never, tmp_path, scenario)


def test_all_faults_at_once(run: Run, tmp_path: Path) -> None:
    table = positions(run)[lambda t: t.time < 1.5]
    table = table.rename(columns={"robot_1.x": "robot_9.x"}).drop(columns=["robot_3.x", "robot_3.y"])
    with pytest.raises(LogError) as error:
        judged_of(table, tmp_path, run.scenario)
    assert len(error.value.faults) == 3, error.value.faults  # robot_9, robot_1 without x, robot_3
    table = table.drop(columns=[name for name in table if name.startswith("robot_")])
    table = table.assign(**{"e.robot_1.x": 0.0, "e.robot_1.y": 0.0})
    with pytest.raises(LogError, match=r"robot_1: no columns robot_1\.x, robot_1\.y"):
        judged_of(table, tmp_path, run.scenario)


def test_no_log_at_all(run: Run, tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("time")
    (tmp_path / "log.csv").write_bytes(b"\x00\xff")
    (tmp_path / "log.mcap").write_bytes(b"no mcap")
    pyarrow = pytest.importorskip("pyarrow")
    latin = pyarrow.array([b"B\xf6b"]).cast(pyarrow.string(), safe=False)
    table = pyarrow.table({"time": [0.0], "name": latin, "x": [0.0], "y": [0.0]})
    pytest.importorskip("pyarrow.parquet").write_table(table, tmp_path / "log.parquet")
    for name, words in (
        ("none.csv", "no such file"),
        ("log.parquet", "log.parquet: cannot be read as a table"),
        ("log.txt", "is no log"),
        ("log.mcap", "cannot be read"),
        (f"{'x' * 300}.csv", "no such file"),
    ):
        with pytest.raises(UsageError, match=words):
            escort_mj.judge(tmp_path / name, run.scenario)
    with pytest.raises(UsageError, match="log.csv: "):
        escort_mj.judge(tmp_path / "log.csv", run.scenario)
    with pytest.raises(UsageError, match='no such body; did you mean "robot_1"'):
        escort_mj.judge(tmp_path / "log.csv", run.scenario, names={"robot1": "a"})


def test_obstacles_that_move_are_judged_where_they_are_logged(compiled: None, tmp_path: Path) -> None:
    scenario = mission("walker")
    run = Run(fly(scenario))
    table = positions(run)
    here = judged_of(table, tmp_path, scenario)
    table["walker.x"], table["walker.y"] = 9.0, 0.0
    there = judged_of(table, tmp_path, scenario)
    assert math.isnan(here.values["obstacle_clearance_min"]) and run.values["obstacle_clearance_min"] < 2.3
    assert there.values["obstacle_clearance_min"] > 5.0


def test_the_work_of_drives_is_not_judged(compiled: None, tmp_path: Path) -> None:
    """What drives the target in the scenario says nothing of what drove it in the log."""
    driven = MISSIONS["judged"]["target"] | {"body": {"mass": 5.0}}
    run = Run(fly(mission("judged", target=driven, expect=[])))
    judged = judged_of(positions(run), tmp_path, run.scenario)
    assert run.values["target_energy"] > 0.0 and math.isnan(judged.values["target_energy"])
    assert "does not contain mover_work" in judged.metrics["target_energy"]["reason"]


@pytest.mark.slow
def test_the_example(compiled: None) -> None:
    judged = escort_mj.judge(Path(__file__).parents[2] / "examples" / "logs" / "main.csv", "main")
    assert judged.passed and len(judged.verdicts) == 5 and not any(one.skip for one in judged.verdicts)
    assert isinstance(judged.scenario, Scenario)


REST = [*[f"{0.1 * k:.2f},2,0,-2,0" for k in range(41)]]
COLUMNS = "time,robot_1.x,robot_1.y,robot_2.x,robot_2.y"


def mission(name: str, **keys: Any) -> Scenario:
    return escort_mj.load_scenario(MISSIONS[name] | keys)


def resting(folder: Path, rows: list[str] | None = None, columns: str = COLUMNS) -> Path:
    """The log of two robots that rest."""
    (folder / "log.csv").write_text("\n".join([columns, *(REST if rows is None else rows)]) + "\n")
    return folder / "log.csv"


@pytest.mark.parametrize("case", MISSIONS["unseen"])
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_what_nobody_logged_is_not_judged(one_figure: None, tmp_path: Path, case: str) -> None:
    unseen = MISSIONS["unseen"][case]
    expected, body = unseen["expect"], unseen["body"]
    kept = tmp_path / "run" if body == "cart" else None
    judged = escort_mj.judge(resting(tmp_path), mission("rest", **unseen["keys"], expect=expected), kept)
    assert [one.message for one in judged.verdicts[1:] if not one.skip] == [
        f"judged at least 1 expectation: 0 of {len(expected)}"
    ]
    assert not judged.passed
    assert all("the log does not contain" in one.skip for one in judged.verdicts[1:-1])
    assert (f"{body} not in the log" in judged.message) == bool(body)
    assert kept is None or escort_mj.open_run(kept).verdicts == judged.verdicts


def test_a_touch_of_bodies_that_are_logged_fails_whatever_is_not(compiled: None, tmp_path: Path) -> None:
    expected = [{"contacts": "none"}, {"contacts": ["robot_1", "opponent_1"]}]
    expected.insert(1, {"clearance": ["robots", "robots"], "at_least": 0.1})
    keys = MISSIONS["unseen"]["opponents"]["keys"] | {"target": {"position": [0, 9]}}
    scenario = mission("rest", **keys, expect=expected)
    rows = [f"{0.1 * k:.2f},{2 - 0.05 * k},0,{0.05 * k - 2},0" for k in range(41)]
    _, none, clear, pair = escort_mj.judge(resting(tmp_path, rows), scenario).verdicts
    assert not none.skip and not none.passed and "robots 1 and 2" in none.message
    assert not clear.skip and not clear.passed
    assert pair.skip


class TestShortLogs:
    def test_it_says_how_little_was_judged(self, compiled: None, tmp_path: Path) -> None:
        judged = escort_mj.judge(resting(tmp_path, REST[:2]), mission("rest", expect=MISSIONS["short"]))
        assert judged.message == "log of real robots: 0.1 s of log.csv, 2.5 % of the scenario's 4 s"
        assert [one.skip for one in judged.verdicts] == [
            "the log ends at 0.1 s of 4 s",
            "",
            "the log ends at 0.1 s, inside the window",
            "the log ends at 0.1 s, before the window",
            "the log ends at 0.1 s, before the window",
        ]

    def test_what_failed_before_the_end_failed(self, compiled: None, tmp_path: Path) -> None:
        rows = [f"{0.1 * k:.2f},{2 - 0.2 * k},0,-2,0" for k in range(11)]
        short = mission("rest", expect=MISSIONS["short"])
        found = escort_mj.judge(resting(tmp_path, rows), short).verdicts
        held = [(bool(one.skip), one.passed) for one in found[1:]]
        assert held == [(False, False), (False, False), (True, True), (False, False)]


def test_names_and_columns_that_are_taken(compiled: None, tmp_path: Path) -> None:
    scenario = mission("rest")
    with pytest.raises(UsageError, match="robot_1 and robot_2 would both be robot_2 in the log"):
        escort_mj.judge(resting(tmp_path), scenario, names={"robot_1": "robot_2"})
    with pytest.raises(
        UsageError, match="names: found a table of keys; expected a mapping from a text to a text or None"
    ):
        escort_mj.judge(resting(tmp_path), scenario, names={1: 2})  # type: ignore[dict-item]
    twice = resting(tmp_path, [f"{row},0" for row in REST], f"{COLUMNS},robot_1.x")
    with pytest.raises(LogError, match=r"found two columns robot_1\.x; expected one"):
        escort_mj.judge(twice, scenario)


def test_a_plugin_that_fails_in_a_log_fails_it(run: Run, tmp_path: Path) -> None:
    (tmp_path / "late.py").write_text(LATE)
    changes = {"mission.behaviors": ["vertices", {"behavior": "late"}], "expect": [{"contacts": "none"}]}
    scenario = escort_mj.load_scenario(MISSIONS["judged"], changes, [str(tmp_path / "late.py")])
    judged = judged_of(positions(run), tmp_path, scenario)
    assert not judged.passed and judged.outcome is escort_mj.Outcome.FAILED
    assert "a plugin raised an error at 1.50 s" in judged.message and "too late" in judged.message
    assert float(judged.trace["time"][-1]) == pytest.approx(1.5)
    ends = escort_mj.judge(tmp_path / "log.csv", scenario.replace({"expect": [{"outcome": "diverged"}]}))
    assert not ends.verdicts[0].passed and ends.outcome is escort_mj.Outcome.FAILED
