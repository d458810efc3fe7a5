import json
from pathlib import Path

import pytest

from escort_mj.cli import pictures
from escort_mj.errors import ScenarioError, UsageError
from tests.test_cli import call


@pytest.mark.parametrize("size", ["640", "640x", "wide", "-640x360"])
def test_a_size_is_two_numbers(size):
    with pytest.raises(UsageError, match="--size: found .*; expected WIDTHxHEIGHT"):
        pictures._sides(size)


@pytest.mark.parametrize("point", ["1", "1,2", "1;2;3", "a,b,c", "1,2,3,4"])
def test_a_point_is_three_numbers(point):
    with pytest.raises(UsageError, match="--look-at: found .*; expected three numbers"):
        pictures._point(point)


def test_options_are_the_keys_of_a_scenarios_video(make_run):
    folder = make_run()
    assert pictures._video(folder, {}) is None
    video = pictures._video(folder, {"azimuth": 30.0, "start": 1.0, **pictures._sides("640x360")})
    assert (video.azimuth, video.start, video.width, video.height) == (30.0, 1.0, 640, 360)
    assert pictures._video(folder, pictures._point("0,-3,1.5")).look_at == (0.0, -3.0, 1.5)
    with pytest.raises(ScenarioError, match=r"video\.elevation: found 95"):
        pictures._video(folder, {"elevation": 95.0})


def test_the_format_follows_from_the_file_or_names_it(tmp_path):
    assert pictures._file(tmp_path, None, None) == tmp_path / "video.mp4"
    assert pictures._file(tmp_path, None, "webp") == tmp_path / "video.webp"
    assert pictures._file(tmp_path, tmp_path / "a.webp", "webp") == tmp_path / "a.webp"
    with pytest.raises(UsageError, match=r"expects the suffix \.mp4"):
        pictures._file(tmp_path, tmp_path / "a.webp", "mp4")


@pytest.mark.slow
def test_figures_for_a_paper(make_run, one_figure, monkeypatch, capfd):
    folder = make_run(samples=20)
    look = ("--width", "8.8cm", "--font-size", "7", "--font", "serif", "--no-title")
    options = ("--no-video", "--figure-format", "pdf", "--figure-format", "svg", *look)
    code, out, _ = call(monkeypatch, capfd, "render", str(folder), *options, "--json")
    assert code == 0
    names = {name.rsplit("/", 1)[1] for name in json.loads(out)["written"]}
    assert names == {"panels.pdf", "panels.svg"}
    assert (folder / "figures" / "panels.pdf").read_bytes().startswith(b"%PDF")
    words = (folder / "figures" / "panels.svg").read_text()
    assert 'width="249.4' in words  # points


def test_figures_are_chosen_by_name(make_run, monkeypatch, capfd):
    folder = make_run(samples=20)
    code, out, _ = call(monkeypatch, capfd, "render", str(folder), "--no-video", "--only", "paths", "--json")
    assert code == 0 and [Path(name).name for name in json.loads(out)["written"]] == ["paths.png"]


def test_nothing_is_drawn_of_what_is_no_run(tmp_path, monkeypatch, capfd):
    code, _, err = call(monkeypatch, capfd, "render", str(tmp_path), "--no-figures", "--no-video")
    assert code == 2 and "is this a run folder?" in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--only", "path"), "path: is not a figure of this run; allowed are panels, paths"),
        (("--only", "paths", "--no-figures"), "--only names figures to draw; --no-figures draws none"),
        (("--width", "wide"), "width: found wide; allowed are column, page, and lengths"),
        (("--font", "Nowhere Sans"), "font: found Nowhere Sans, which is not installed here"),
        (("--font-size", "100"), "font size: found 100; allowed are 4 to 40 pt"),
        (("--figure-format", "tiff"), "'tiff' is not one of 'png', 'pdf', 'svg'"),
    ],
)
def test_figures_that_cannot_look_so_are_errors(make_run, monkeypatch, capfd, options, words):
    code, _, err = call(monkeypatch, capfd, "render", str(make_run(samples=5)), "--no-video", *options)
    assert code == 2 and words in " ".join(err.replace("│", " ").split())
