"""Runs as users have them: the same in memory and from a folder, short in text, drawn in notebooks."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from pathlib import Path

import pytest

import escort_mj
from escort_mj.api.runs import Run
from escort_mj.errors import RunFolderError, ScenarioError, UsageError
from escort_mj.measuring import measure
from escort_mj.record.folder import read_run
from escort_mj.report.video.video import ending
from escort_mj.testing import assert_no_contacts, assert_passed

TEXT = {
    "name": "two",
    "duration": 1.0,
    "robots": {"positions": [[5, 0], [-5, 0]]},
    "mission": {"radius": 5, "behaviors": ["surface"]},
    "expect": [{"contacts": "none"}, {"metric": "force_rms", "at_least": 50}, {"settled": 1e-9, "by": 0.5}],
}


@pytest.fixture(scope="module")
def made(compiled: None) -> Run:
    return escort_mj.run(TEXT)


@pytest.fixture(scope="module")
def opened(made: Run, tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("runs") / "two"
    assert made.save(folder).folder == folder
    return escort_mj.open_run(folder)


def test_a_stored_run_is_the_run_that_was_made(made: Run, opened: Run) -> None:
    assert type(made) is type(opened) is escort_mj.Run
    for name in ("name", "outcome", "message", "metrics", "verdicts", "scenario", "passed", "figures"):
        assert getattr(made, name) == getattr(opened, name), name
    assert repr(made) == repr(opened) and str(made.values) == str(opened.values)
    assert made.trace.equals(opened.trace)
    assert made.folder is None and opened.folder is not None
    assert made.to_dataframe().equals(opened.to_dataframe())


def test_the_text_is_short_and_says_what_failed(made: Run) -> None:
    first, *failed = repr(made).splitlines()
    assert first == "<Run two: completed 1 s; 2 of 4 verdicts passed>"
    assert len(failed) == 2 and failed[0].startswith("  FAIL  force_rms at least 50 N: ")


def test_what_was_not_judged_is_not_counted_as_passed(compiled: None, tmp_path: Path) -> None:
    short = escort_mj.load_scenario({**TEXT, "expect": TEXT["expect"][:1] + [{"settled": 1, "by": 0.5}]})
    run = escort_mj.run(short.replace(duration=0.1))
    assert repr(run) == "<Run two: completed 0.1 s; 2 of 2 verdicts passed, 1 not judged>"
    run.save(tmp_path / "two")
    assert ending(read_run(tmp_path / "two")) == ("completed 0.1 s, 2 verdicts passed, 1 not judged", True)


def test_a_run_of_which_nothing_was_expected_met_no_expectations(compiled: None, tmp_path: Path) -> None:
    escort_mj.run({**TEXT, "expect": []}).save(tmp_path / "two")
    assert ending(read_run(tmp_path / "two")) == ("completed 1 s", True)


def test_the_cell_of_a_notebook_has_verdicts_and_a_picture(made: Run) -> None:
    html = made._repr_html_()
    assert html.count("<tr>") == 4 and "force_rms" in html and 'src="data:image/png;base64,' in html
    assert len(html) < 100_000
    many = next(escort_mj.run_many([TEXT], 1))
    assert "<img" not in many._repr_html_(), "its trace was not kept"
    hostile = escort_mj.run(TEXT | {"name": "a<b>c", "duration": 0.1, "expect": []})
    assert "<b>c" not in hostile._repr_html_()


def test_metrics_are_numbers_and_runs_are_rows(made: Run, opened: Run) -> None:
    assert made.values["force_rms"] == made.metrics["force_rms"]["value"]
    with pytest.raises(KeyError, match='forces_rms: is not a metric of this run; did you mean "force_rms"'):
        made.values["forces_rms"]
    never = escort_mj.run(
        TEXT | {"duration": 0.1, "mission": {"radius": 4, "behaviors": ["surface"]}, "expect": []}
    )
    assert never.metrics["settling_time"]["value"] is None and never.values["settling_time"] == math.inf
    assert math.isnan(made.values["obstacle_clearance_min"])
    rows = escort_mj.table([made, opened])
    assert list(rows.columns[:4]) == ["name", "seed", "outcome", "passed"]
    assert rows["force_rms"].dtype == float and rows["passed"].tolist() == [False, False]
    assert dict(made.summary())["force_rms"] == rows["force_rms"][0]


def test_metrics_over_a_window_of_runs(made: Run, opened: Run) -> None:
    table = escort_mj.table([made, opened], ["force_rms", "settling_time"], after=0.5)
    values = measure("force_rms", made.trace, 0.5).value
    assert table["force_rms_after_0.5"].tolist() == [values, values] != [made.values["force_rms"]] * 2
    assert table.attrs["units"]["settling_time_after_0.5"] == "s" and len(table.columns) == 8
    every = made.summary(over="tail")
    assert every["radius_error_mean_over_tail"] == made.values["radius_error_mean"]
    assert "settling_time_over_tail" not in every and "obstacle_clearance_min_over_tail" not in every
    for wrong, words in {
        "forc_rms": 'forc_rms: is not a metric of .*; did you mean "force_rms"',
        "force_rms": "after 2: the run ends at 1 s",
    }.items():
        with pytest.raises(UsageError, match=words):
            made.summary(wrong, after=2)
    with pytest.raises(UsageError, match="not kept"):
        next(escort_mj.run_many([TEXT], 1)).summary(over="whole")


def test_signals_are_chosen(made: Run) -> None:
    frame = made.to_dataframe(["q", "target_speed_max"])
    assert list(frame.columns) == [f"q.robot_{i}.{x}" for i in (1, 2) for x in "xy"] + ["target_speed_max"]
    assert frame.index.name == "time" and len(frame) == 52  # and in the step before the window of `settled`
    with pytest.raises(UsageError, match='tauu: is not a signal over time; did you mean "tau"'):
        made.to_dataframe("tauu")


def test_figures_are_drawn_of_runs_in_memory(made: Run) -> None:
    assert made.plot()._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(UsageError, match="path: is not a figure of this run; allowed are panels, paths"):
        made.plot("path")


def test_the_video_of_a_folder_is_drawn_once(opened: Run, tmp_path: Path, monkeypatch) -> None:
    drawn = []

    def render(folder: Path, video, out: Path) -> Path:
        drawn.append(video)
        out.write_bytes(b"film")
        return out

    monkeypatch.setattr("escort_mj.report.video.video.render_video", render)
    assert opened.video().path == opened.folder / "video.mp4"
    copy = opened.video(tmp_path / "copy.mp4")
    assert Path(copy).read_bytes() == b"film" and "ZmlsbQ==" in copy._repr_html_()
    assert drawn == [opened.scenario.video]
    opened.video(speed=8, camera="top")
    assert (drawn[1].speed, drawn[1].camera) == (8.0, "top")
    with pytest.raises(escort_mj.ScenarioError, match="video.camera: found "):
        opened.video(camera="side")
    picture = opened.video(tmp_path / "part.webp", start=0.5)
    assert drawn[2].start == 0.5 and picture._repr_html_().startswith("<img ")


def test_a_page_of_a_run_in_memory(made: Run, one_figure: None, tmp_path: Path) -> None:
    page = made.report(tmp_path / "page.html")
    assert str(page) == str(tmp_path / "page.html") and 'id="replay"' in page.path.read_text()
    assert page._repr_html_().startswith('<a href="file:///')
    assert made.folder is None
    with pytest.raises(UsageError, match=r"page.pdf: found the suffix .pdf; a page is HTML"):
        made.report(tmp_path / "page.pdf")
    with pytest.raises(UsageError, match="page.html: there is no folder"):
        made.report(tmp_path / "no" / "page.html")
    with pytest.raises(UsageError, match='path: found ""; expected a text that is not empty, a path or None'):
        made.report("")


def test_a_run_is_viewed_until_it_is_interrupted(made: Run, monkeypatch, capsys) -> None:
    class Viewer:
        url = "http://here"

        def __init__(self, tape: object, *where: object) -> None:
            assert tape.title == "two" and where == ("127.0.0.1", 8080, 2.0)

        def __enter__(self):
            return self

        def __exit__(self, *error: object) -> None:
            print("stopped")

        def run(self, ended: object) -> None:
            raise KeyboardInterrupt

    monkeypatch.setattr("escort_mj.view.viewer.Viewer", Viewer)
    monkeypatch.setattr("escort_mj.view.viewer.require_viser", lambda: None)
    made.view(speed=2.0)
    assert capsys.readouterr().out == "two at http://here\nstopped\n"


def test_a_cell_is_shown_without_a_picture_where_none_can_be_drawn(made: Run, monkeypatch) -> None:
    monkeypatch.setattr("escort_mj.report.figures.figures.thumbnail_of", lambda trace: 1 / 0)
    run = Run(made._source)
    assert "<img" not in run._repr_html_() and "force_rms" in run._repr_html_()


def test_runs_are_exported(made: Run, tmp_path: Path) -> None:
    assert made.export(tmp_path / "run.csv").read_text().startswith("time [s],q.robot_1.x [m],")
    assert made.export(tmp_path / "run.xml").read_text().startswith("<mujoco")
    with pytest.raises(UsageError, match="found the suffix .*; allowed are .xml, .csv"):
        made.export(tmp_path / "run.doc")


def test_a_saved_run_stays(made: Run, opened: Run) -> None:
    assert opened.folder is not None
    with pytest.raises(UsageError, match="holds a run already"):
        made.save(opened.folder)
    assert made.save(opened.folder, overwrite=True).folder == opened.folder
    with pytest.raises(UsageError, match="ask for traces"):
        next(escort_mj.run_many([TEXT], 1)).save(opened.folder.with_name("other"))


def test_what_is_read_only_says_what_is_done_in_place(opened: Run) -> None:
    with pytest.raises(AttributeError, match=r"^Scenario.duration: cannot be set: .*; scenario.replace"):
        opened.scenario.duration = 3.0
    with pytest.raises(AttributeError, match=r"^ApdSmc.own: cannot be set: .* keep is a ClassVar\[Memory\]"):
        opened.scenario.controller.own = 3.0
    assert {"duration", "replace"} <= {*dir(opened.scenario)} and "parse_obj" not in dir(opened.scenario)
    assert str(inspect.signature(escort_mj.Scenario)).startswith("(*, version=Ellipsis, name=Ellipsis")
    with pytest.raises(RunFolderError, match=r"trace.nc: is a file; expected a run folder, such as \S*two$"):
        escort_mj.open_run(opened.folder / "trace.nc")
    with pytest.raises(UsageError, match=r"^x+.*characters.: File name too long$"):
        escort_mj.open_run("x" * 5000)


def test_the_folder_of_a_study_is_no_run(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text("study: one\n")
    with pytest.raises(
        RunFolderError, match=r"is the folder of a study; its kept runs are in \S+runs, and escort-mj rep"
    ):
        escort_mj.open_run(tmp_path)


def test_keys_are_set_by_calls_as_on_the_command_line(compiled: None) -> None:
    run = escort_mj.run(TEXT, overrides=["mission.radius=4", "seed=2"], duration=0.1, seed=3, expect=[])
    assert (run.scenario.mission.radius, run.scenario.duration, run.scenario.seed) == (4.0, 0.1, 3)
    scenario = run.scenario
    assert escort_mj.load_scenario(scenario) is scenario
    assert escort_mj.load_scenario(scenario, seed=5) == scenario.replace(seed=5)
    with pytest.raises(ScenarioError, match="duration: found -1"):
        escort_mj.run(TEXT, duration=-1)


@pytest.mark.parametrize("function", [escort_mj.run, escort_mj.start, escort_mj.compare])
def test_a_wrong_key_of_a_call_is_told_the_nearest(function: Callable[..., object]) -> None:
    with pytest.raises(UsageError, match='duraton is neither an argument .* did you mean "duration"'):
        function(TEXT, duraton=3)


def test_a_wrong_argument_of_a_call_is_told_the_nearest() -> None:
    with pytest.raises(UsageError, match='overwrit is neither an argument .* did you mean "overwrite"'):
        escort_mj.run(TEXT, overwrit=True)
    with pytest.raises(UsageError, match=r"runs\[0\]: found 3; expected a Run"):
        escort_mj.table(iter([3]))  # type: ignore[list-item]
    for one in (assert_passed, assert_no_contacts):
        with pytest.raises(UsageError, match="run: found 3; expected a Run"):
            one(3)


def test_a_table_of_runs_has_units(made: Run) -> None:
    table = escort_mj.table([made])
    assert set(table.attrs["units"]) == {"simulated_time", "wall_time", *made.values}
    assert table.attrs["units"]["force_rms"] == made.metrics["force_rms"]["unit"] == "N"
