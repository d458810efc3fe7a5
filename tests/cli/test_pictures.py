import json
from pathlib import Path

import pytest

from escort_mj.cli import pictures
from tests.test_cli import call


def test_options_are_the_keys_of_a_scenarios_video(make_run):
    folder = make_run()
    assert pictures._video(folder, {}) is None
    video = pictures._video(folder, {"azimuth": 30.0, "start": 1.0, **pictures._sides("640x360")})
    assert (video.azimuth, video.start, video.width, video.height) == (30.0, 1.0, 640, 360)
    assert pictures._video(folder, pictures._point("0,-3,1.5")).look_at == (0.0, -3.0, 1.5)


def test_the_format_follows_from_the_file_or_names_it(tmp_path):
    assert pictures._file(tmp_path, None, None) == tmp_path / "video.mp4"
    assert pictures._file(tmp_path, None, "webp") == tmp_path / "video.webp"
    assert pictures._file(tmp_path, tmp_path / "a.webp", "webp") == tmp_path / "a.webp"


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
