"""The browser viewer: driven from its server and in a real headless browser, and looked at."""

import io
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from escort_mj import api
from escort_mj.cli import app
from escort_mj.errors import UsageError
from escort_mj.palette import robot_colors
from escort_mj.report.video.marks import LAYERS, marks
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario import parse_scenario
from escort_mj.view.stage import linear
from escort_mj.view.tape import Live, Stored, failures
from escort_mj.view.viewer import Viewer
from tests.report.browser import needs_browser
from tests.synthetic import make_trace
from tests.view.devtools import Browser, wait

pytest.importorskip("viser")

MISSION = """
name: watched
duration: 2
robots: {count: 5, radius: 0.4}
target: {position: ["0.2*t", 0]}
obstacles: [{position: [4, 0], radius: 0.5}]
expect: [{contacts: none}]
"""


@pytest.fixture
def tape(compiled):
    return Live(parse_scenario(MISSION))


@pytest.fixture
def viewer(tape, monkeypatch):
    monkeypatch.setattr("escort_mj.view.viewer.BUDGET", np.inf)  # however busy the machine is
    with Viewer(tape, port=0) as made:
        yield made


FAILING = (
    MISSION.partition("expect")[0]
    + """expect:
  - {metric: radius_error_max, at_most: 0.001, after: 1}
  - {metric: robot_distance_min, at_least: 90, after: 0.6, before: 0.9}
  - {metric: radius_error_max, at_most: 1.0e-9, xfail: they start elsewhere}
"""
)


def test_the_camera_follows_only_what_leaves_the_picture(compiled, tmp_path) -> None:
    for path, followed in ((0, "nobody"), ("60*t", "target")):
        target = {"target.position": [path, 0, 0], "axes": 3, "obstacles": ()}
        api.run(parse_scenario(MISSION, "s", target), tmp_path / followed, figures=False, video=False)
        with Viewer(Stored(tmp_path / followed), port=0) as viewer:
            assert viewer.panel.camera.value == followed


def test_a_run_that_failed_opens_at_its_failure(compiled, tmp_path, monkeypatch) -> None:
    scenario = parse_scenario(FAILING)
    run = api.run(scenario, tmp_path / "failed", figures=False, video=False)
    moments = sorted(one.time for one in run.verdicts if not one.passed)
    assert len(moments) == 2 and moments[0] > 0.0
    tape = Stored(tmp_path / "failed")
    assert [one.time for one in failures(tape.verdicts)] == moments
    with Viewer(tape, port=0) as viewer:
        assert viewer.panel.failures.visible
        viewer.stop_at(moments[1])
        assert viewer.now == pytest.approx(moments[1]) and not viewer.panel.playing
        viewer.tick(0.2)
        assert viewer.now == pytest.approx(moments[1])
    opened = []
    monkeypatch.setattr(Viewer, "run", lambda self, ended: opened.append((self.now, self.panel.playing)))
    view = CliRunner().invoke
    said = view(app, ["view", str(tmp_path / "failed"), "--port", "0"]).output
    assert said.startswith(f"opens at {moments[0]:.2f} s: ")
    view(app, ["view", str(tmp_path / "failed"), "--port", "0", "--at", "0.5"])
    api.run(parse_scenario(MISSION), tmp_path / "passed", figures=False, video=False)
    assert "opens at" not in view(app, ["view", str(tmp_path / "passed"), "--port", "0"]).output
    assert opened == [(pytest.approx(moments[0]), False), (pytest.approx(0.5), False), (0.0, True)]


def test_time_goes_at_the_pace_asked_for(viewer, tape) -> None:
    viewer.tick(0.1)
    assert viewer.now == pytest.approx(0.1) and tape.reached < 0.2, "it simulates what is seen, no more"
    viewer.panel.pace.value = "4"
    viewer.tick(0.1)
    assert viewer.now == pytest.approx(0.5)
    viewer.panel.set_playing(False)
    viewer.tick(0.1)
    assert viewer.now == pytest.approx(0.5)
    viewer.panel.seek(0.2)
    viewer.tick(0.1)
    assert viewer.now == pytest.approx(0.2) and tape.reached >= 0.5, "what was simulated stays"


def test_a_time_ahead_is_simulated_first(viewer, tape) -> None:
    viewer.panel.seek(1.8)
    wait(lambda: viewer.tick(0.0) or viewer.now >= 1.8, "the time asked for")
    assert viewer.now == pytest.approx(1.8) and not viewer.panel.verdicts.content
    viewer.panel.seek(99.0)
    wait(lambda: viewer.tick(0.01) or tape.ending, "the end")
    viewer.tick(0.1)
    viewer.tick(0.1)
    assert viewer.now == pytest.approx(2.0) and not viewer.panel.playing
    assert "**pass** contacts" in viewer.panel.verdicts.content


def test_a_dragged_target_is_where_it_was_left(viewer, tape) -> None:
    viewer.tick(0.1)
    grip = viewer._grips._controls["target"]
    assert not grip.visible, "handles are shown when asked for"
    viewer.panel.layers["handles"].value = True
    wait(lambda: viewer.panel.changed, "a change")
    viewer.tick(0.0)
    assert grip.visible
    np.testing.assert_allclose(grip.position, [0.02, 0.0, 0.4], atol=0.01)
    viewer._grips._dragged["target"] = np.array([1.0, 1.0, 0.4])
    viewer.tick(0.1)
    assert tape.mission["target_position"].tolist() == [1.0, 1.0]


def test_layers_are_switched(viewer) -> None:
    stage = viewer._stage
    viewer.tick(0.1)
    seen = {name[0] for name, node in stage._nodes.items() if node.visible}
    assert seen == {"trails", "velocities", "safe", "links", "escort", "numbers"}
    for layer, box in viewer.panel.layers.items():
        if layer not in LAYERS:
            continue
        box.value = not stage.shown[layer]
    wait(lambda: viewer.panel.changed, "a change")
    time.sleep(0.1)  # callbacks come one by one
    viewer.tick(0.0)
    assert not any(node.visible for node in stage._nodes.values())
    assert not any(stage.shown[layer] for layer in LAYERS)


def test_bodies_are_where_the_run_has_them(viewer, tape) -> None:
    viewer.panel.seek(1.01)  # halfway between two samples
    wait(lambda: viewer.tick(0.0) or viewer.now >= 1.01, "the time asked for")
    part, replay = tape.around(1.01, 0.0, 1)
    moment = replay.at(1.01)
    bodies = np.concatenate([handle.batched_positions for _, handle in viewer._stage._bodies])
    for place in (*moment.robots, moment.target, *moment.obstacles):
        assert np.abs(bodies - place).max(axis=1).min() < 1e-5
    arrows = viewer._stage._nodes["velocities", "arrows"].points
    np.testing.assert_allclose(arrows[:, 0], moment.robots, atol=1e-5)
    along = (arrows[:, 1] - arrows[:, 0])[:, :2]
    np.testing.assert_allclose(along, 3.0 * part["v_d"].values[moment.sample], atol=1e-4)


def test_what_robots_know_is_seen(viewer) -> None:
    stage, places = viewer._stage, 3.0 * np.eye(5, 2)
    known = {"target_seen": [0, 1, 0, 0, 0], "target_estimate": [1.0, 2.0]}
    ends = []
    for heard in ([[2], [0], [0], [0], [0]], 0):
        trace = make_trace([0.0, 1.0], robots=5, q=places, heard_from=heard, **known)
        replay = replay_of(trace)
        stage._draw_marks(marks(replay, replay.at(0.5)))
        links = stage._nodes["links", "lines", "1.5"]
        ends.append((links.points[..., :2].copy(), links.visible))
    np.testing.assert_allclose(ends[0][0], places[None, :2], atol=1e-6)
    assert ends[0][1] and not ends[1][1], "none that was there before"
    sight = stage._nodes["knowledge", "lines", "2"]
    np.testing.assert_allclose(sight.points[0, 0, :2], places[1], atol=1e-6)
    np.testing.assert_array_equal(sight.colors[0, 0], linear(np.array(robot_colors(5)[1])))
    ghosts = stage._nodes["knowledge", "balls"]
    np.testing.assert_allclose(ghosts.batched_positions[:, :2], np.tile([1.0, 2.0], (5, 1)))
    assert (ghosts.batched_scales > 0.1).all()


def test_colors_in_linear_light() -> None:
    np.testing.assert_array_equal(linear(np.array([0.0, 0.04045, 0.5, 1.0])), [0, 1, 55, 255])


def test_it_listens_to_this_machine_only(viewer) -> None:
    assert viewer.url.startswith("http://127.0.0.1:") and not viewer.public
    port = int(viewer.url.rpartition(":")[2])
    with socket.create_server(("127.0.0.2", port)):  # another address of this machine is free
        pass
    with pytest.raises(OSError), socket.create_server(("127.0.0.1", port)):
        pass
    assert viewer._server.request_share_url() is None, "no tunnel to the outside"


@needs_browser
def test_a_browser_shows_the_run_and_steers_it(viewer, tape, tmp_path: Path) -> None:
    def turn() -> None:
        viewer.tick(0.03)
        time.sleep(0.02)

    viewer.panel.set_playing(False)
    with Browser(viewer.url, tmp_path, (800, 500)) as browser:
        wait(lambda: turn() or viewer.watched, "a browser that shows it")
        wait(lambda: turn() or "Play" in browser.ask("document.body.innerText"), "its controls")
        said = browser.ask("document.body.innerText")
        assert "watched" in said and all(name in said for name in LAYERS.values())
        assert "avoid_obstacles" in said, "what colors of arrows mean"
        press = "[...document.querySelectorAll('button')].find(b => b.innerText.trim() === '{}').click()"
        viewer.panel.seek(1.5)
        wait(lambda: turn() or viewer.now >= 1.5, "the time asked for")
        wait(lambda: turn() or "t = 1.50 s" in browser.ask("document.body.innerText"), "the time in words")
        wait(lambda: sorted(look(browser))[-2] > 60, "robots in their colors, as far as controls hide none")
        (client,) = viewer._server.get_clients().values()
        assert viewer.panel.camera.value == "target", "a mission that goes nobody knows where"
        viewer.panel.camera.value = "robot 2"
        viewer.panel.changed = True
        robot = tape.around(1.5, 0.0, 1)[1].robots[0, 1]
        viewer.tick(0.0)
        np.testing.assert_allclose(client.camera.look_at, robot, atol=1e-6)
        browser.ask(press.format("Play"))
        wait(lambda: viewer.panel.playing, "it plays again")
        wait(lambda: turn() or tape.ending and not viewer.panel.playing, "the end")
        wait(lambda: turn() or "completed 2 s" in browser.ask("document.body.innerText"), "how it ended")
        assert browser.complaints == []


def look(browser: Browser) -> list[int]:
    """Pixels of about the hue of each robot, left of the controls."""
    pixels = np.asarray(Image.open(io.BytesIO(browser.picture())).convert("RGB"), float)[:, :460] / 255
    vivid = pixels[np.ptp(pixels, axis=2) > 0.15]
    unit = vivid / np.linalg.norm(vivid, axis=1, keepdims=True)
    hues = [np.array(color) / np.linalg.norm(color) for color in robot_colors(5)]
    return [int((unit @ hue > 0.985).sum()) for hue in hues]


def test_no_viser_no_display_no_port(monkeypatch, tape) -> None:
    with pytest.raises(UsageError, match=r"--port: found 70000; allowed is 0 to 65535"):
        Viewer(tape, port=70000)
    with pytest.raises(UsageError, match="cannot listen there"):
        Viewer(tape, host="192.0.2.1")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r'pip install "escort-mj\[view\]"'):
        Viewer(tape)


@pytest.mark.slow
def test_ctrl_c_ends_in_order(compiled, tmp_path: Path) -> None:
    (tmp_path / "watched.yaml").write_text(MISSION)
    command = [sys.executable, "-m", "escort_mj", "view", "watched.yaml", "--port", "0"]
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    assert process.stdout is not None
    said = process.stdout.readline()
    assert said.startswith("watched at http://127.0.0.1:")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0 and not out and not err
