"""The page of a run: whole in one file, and a replay that shows what was recorded, in a real browser."""

import base64
import json
import re
import shutil
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from escort_mj import palette
from escort_mj.errors import RenderError
from escort_mj.record.folder import read_run
from escort_mj.record.outcome import Outcome
from escort_mj.report.pages.html import Table, asset, page
from escort_mj.report.pages.replay_data import replay_data
from escort_mj.report.pages.run_page import SCRIPTS, write_run_page
from escort_mj.report.pages.signals_data import signals_data
from escort_mj.report.video.replay import replay_of
from tests.report.browser import Page, look, needs_browser
from tests.synthetic import make_verdict

TIMES = (0.0, 1.23, 3.07, 5.9)


def whole(data: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(data), dtype=kind)


@pytest.fixture(scope="module")
def folder(drawn_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = Path(shutil.copytree(drawn_run, tmp_path_factory.mktemp("page") / "run"))
    (path / "verdicts.json").write_text(json.dumps([verdict(), verdict(False, "none", 2.5)]))
    write_run_page(path)
    return path


def verdict(passed: bool = True, demanded: str = "completed", time: float | None = None) -> dict:
    return asdict(
        make_verdict(
            metric="contacts" if time else "outcome",
            demanded=demanded,
            time=time,
            passed=passed,
            message=f"robot 1 & <friends> did {demanded}",
        )
    )


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    return (folder / "report.html").read_text()


def test_the_page_holds_everything_itself(text: str) -> None:
    page = Page(text)
    assert not page.open
    sources = [a["src"] for tag in ("img", "script", "video") for a in page.all(tag) if "src" in a]
    assert len(sources) == 6 and all(source.startswith("data:image/png;base64,") for source in sources)
    assert [a["href"] for a in page.all("link")] == ["data:,"]
    assert "@import" not in text and "url(" not in text
    assert len(text) < 3e6


def test_what_scripts_read_cannot_end_their_element() -> None:
    trace = SimpleNamespace(attrs={}, sizes={"body": 1}, axis=SimpleNamespace(values=list("wxyz")))
    parts = dict.fromkeys(("title", "well", "ending", "file", "folder", "figures", "video"), "")
    parts |= dict.fromkeys(("verdicts", "contacts", "metrics", "facts"), Table("", [], []))
    hostile = ["</script><script>alert()</script>", "<!--", "'&>"]
    parts |= {"run": SimpleNamespace(trace=trace, scenario_yaml=""), "replay": hostile, "signals": [1.5]}
    text = page("run.html", parts)
    data = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text)
    assert json.loads(data[0]) == hostile and "<!--" not in data[0] and data[1] == "[1.5]"
    assert "along x, y, z of the axes w, x, y, z." in text


def test_verdicts_come_first_and_lead_to_their_moment(text: str) -> None:
    assert text.index("What was expected") < text.index('id="replay"') < text.index("<h2>Figures")
    assert 'class="banner ill"' in text and '<span class="bad">FAIL</span>' in text
    assert 'data-seek="2.5"' in text
    assert "robot 1 &amp; &lt;friends&gt;" in text and "<friends>" not in text and "<b> &" not in text


def test_the_scenario_and_how_to_run_it_again(folder: Path, text: str) -> None:
    assert "escort-mj run scenario.yaml --out again" in text and f"escort-mj rerun {folder.name}" in text
    assert "name: a &lt;b&gt; &amp; c" in text


def test_every_script_is_part_of_the_package(text: str) -> None:
    assert all(asset(script) in text for script in SCRIPTS)


@pytest.mark.parametrize(("count", "axes", "obstacles"), [(5, 2, 2), (3, 3, 0), (70, 2, 1)])
def test_the_replay_is_what_was_recorded(make_run, count: int, axes: int, obstacles: int) -> None:
    run = read_run(make_run(count=count, axes=axes, obstacles=obstacles))
    data, replay = replay_data(run, 2.0), replay_of(run.trace)
    json.dumps(data, allow_nan=False)
    low, high = np.array(data["low"]), np.array(data["high"])
    time = whole(data["time"], "<f4")
    tracks = whole(data["tracks"], "<u2").reshape(-1, len(time), 3) / 65535 * (high - low) + low
    exact = (high - low).max() / 65535
    np.testing.assert_allclose(time, replay.time, atol=1e-5)
    np.testing.assert_allclose(tracks[data["target"]], replay.target, atol=exact)
    solids = data["solids"]
    for robot in range(count):
        (part,) = (k for k, owner in enumerate(solids["robot"]) if owner == robot)
        np.testing.assert_allclose(tracks[solids["place"][part]], replay.robots[:, robot], atol=exact)
    assert len(tracks) == count + 1  # a robot's body is where the robot is
    places = [solids["place"][k] for k, owner in enumerate(solids["robot"]) if owner < 0]
    still = [data["still"][-1 - place] for place in places if place < 0]
    np.testing.assert_allclose(np.reshape(still, (-1, 3)), replay.obstacles[0], atol=1e-5)


def test_short_events_and_losses_survive_thinning(make_run, monkeypatch) -> None:
    lost = np.zeros((60, 4))
    lost[31:, 2] = 1.0
    run = read_run(make_run(count=4, lost=lost))
    for name in ("FEWEST", "MOST"):
        monkeypatch.setattr(f"escort_mj.report.pages.replay_data.{name}", 7)
    touching = np.zeros((60, 4), dtype=bool)
    touching[17, 1] = True
    monkeypatch.setattr("escort_mj.report.video.replay.touched", lambda trace: touching)
    data = replay_data(run, 1.0)
    time = whole(data["time"], "<f4")
    gone = whole(data["lost"], "<u1").reshape(len(time), 4)
    assert len(time) == 7 and time[-1] == pytest.approx(5.9)
    np.testing.assert_array_equal(gone.any(axis=0), [False, False, True, False])
    assert time[np.argmax(gone[:, 2])] >= 3.1
    halos = [mark for mark in data["marks"] if mark["layer"] == "contacts" and mark["kind"] == "ball"]
    (halo,) = (mark for mark in halos if mark["looks"][0][1][:3] == np.round(palette.CONTACT, 4).tolist())
    assert time[whole(halo["shown"], "<u1") > 0].tolist() == [time[np.argmax(time >= 1.7)]]
    assert halo["points"] == [data["robots"][1]], "it goes with its robot"


def test_signals_keep_the_worst_of_each_bin(make_run, monkeypatch) -> None:
    run = read_run(make_run(samples=60))
    monkeypatch.setattr("escort_mj.report.pages.signals_data.MOST", 10)
    monkeypatch.setattr("escort_mj.report.pages.signals_data.FEWEST", 10)
    data = signals_data(run.trace)
    force = next(signal for signal in data["signals"] if signal["unit"] == "N")
    curve = whole(force["curves"][3], "<f4")
    assert len(curve) == 10
    assert curve.max() == pytest.approx(float(np.linalg.norm(run.trace["force"].values, axis=2)[:, 3].max()))
    nearest = next(signal for signal in data["signals"] if signal["name"].startswith("clearance"))
    found = min(whole(one, "<f4").min() for one in nearest["curves"])
    assert found == pytest.approx(float(run.trace["clearance"].values.min()), rel=1e-6)


def test_a_run_without_samples_has_no_page(make_run) -> None:
    with pytest.raises(RenderError, match="no sample"):
        write_run_page(make_run(samples=0, outcome=Outcome.DIVERGED))


PROBE = Path(__file__).with_name("probe.js").read_text()


@needs_browser
def test_a_browser_replays_the_run(folder: Path, tmp_path: Path) -> None:
    script = f"const times = {json.dumps(TIMES)};{PROBE}"
    found, errors = look(folder / "report.html", tmp_path, script)
    assert errors == []
    replay = replay_of(read_run(folder).trace)
    expected = np.array([replay.at(time).robots for time in TIMES])
    np.testing.assert_allclose(found["places"], expected, atol=2e-3)
    assert found["sought"] == 2.5 and found["turned"] and found["error"] == 0
    assert min(found["hues"]) > 30, "every robot is seen in its color"
    assert found["curves"] == 1 and "robot 5" in found["label"]
    assert found["played"] > 2.5 + 1e-3
    assert len(found["widths"]) == 6 and min(found["widths"]) > 300
