"""What `check-robot` says of a robot, and of files that are none."""

from pathlib import Path

import numpy as np
import pytest

from escort_mj.conformance.robot import Answer, checked_model, model_page
from tests.test_cli import call

HEXAROTOR = Path(__file__).parents[2] / "scenarios/robots/hexarotor.xml"


def test_the_page_says_what_is_found() -> None:
    lines = dict(line.split(maxsplit=1) for line in model_page(*checked_model(HEXAROTOR, None, None)))
    assert lines["drive"] == "thrust: 6 motors, of 6 actuators" and lines["base"] == "frame"
    assert lines["mass"].startswith("1.5 kg") and lines["stands"] == "on nothing: it flies, axes 2 or 3"
    assert "k_d/m is best at" in lines["bandwidth"] and lines["bandwidth"].endswith("by the drive")
    assert lines["hovers"].count("2.45") == 6, "a sixth of the weight each"


def test_an_answer_is_summed_up() -> None:
    time = np.linspace(-1.0, 9.0, 1001)
    velocity = np.where(time > 0.0, 0.5 * (1.0 - np.exp(-time.clip(0.0))), 0.0)
    answer = Answer("x", 0.5, time, velocity, 0.01)
    assert answer.rise == pytest.approx(np.log(9.0), abs=0.02), "of a lag of 1 s"
    assert answer.held and answer.overshoot == 0.0
    swung = velocity * (1.0 + 0.5 * np.exp(-((time - 3.0) ** 2)))
    assert not answer._replace(velocity=swung).held, "it ends well, but goes 45 % too far"
    assert not answer._replace(step=1.0).held and answer._replace(step=1.0).numbers["rise"] is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.xml"], "nowhere.xml: there is no such file"),
        (["/"], "cannot be read: Is a directory"),
        ([str(HEXAROTOR), "--drive", "legs"], "--drive: found legs; allowed are force"),
        ([str(HEXAROTOR), "--drive", "wheels"], "none of its 6 actuators turns what stands on the floor"),
        ([str(HEXAROTOR), "--body", "tail"], "has no body tail; found frame"),
        ([str(HEXAROTOR), "--body", ""], '--body: found ""; expected the name of a body of hexarotor.xml'),
        ([str(HEXAROTOR), "--figure", "x.foo"], "x.foo: found the suffix .foo; allowed are .png, .pdf, .svg"),
        ([str(HEXAROTOR), "--figure", "no/x.png"], "no/x.png: there is no folder no"),
    ],
)
def test_wrong_input_is_one_line(monkeypatch, capfd, arguments: list[str], words: str) -> None:
    code, _, err = call(monkeypatch, capfd, "check-robot", *arguments)
    assert code == 2 and words in err and "Traceback" not in err and len(err.strip().splitlines()) == 1


def test_a_body_of_a_file_without_bodies(monkeypatch, capfd, tmp_path: Path) -> None:
    (tmp_path / "empty.xml").write_text("<mujoco><worldbody/></mujoco>")
    code, _, err = call(monkeypatch, capfd, "check-robot", str(tmp_path / "empty.xml"), "--body", "tail")
    assert code == 2 and "has no body tail; found none" in err
