"""Radios of plugins: both forms, the bits of one that ships, and wrong ones."""

import re
from pathlib import Path

import numpy as np
import pytest

from escort_mj import Run, load_scenario, run
from escort_mj.conformance import check_plugin
from escort_mj.errors import PluginError, ScenarioError
from escort_mj.radios import RADIOS, Radio, radio
from escort_mj.record.outcome import Outcome

SCENARIO = """
duration: 1.5
target: {position: [0.3*t, 0]}
plugins: [own.py]
knowledge: {target: {robots: [1]}, initial: {position: 0.5}}
communication: {radio: own, range: 9, delay: [0.02, 0.06], loss: {mean: 0.3, burst: 3}}
"""
FADING = '''
import math
from typing import Any, ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.plugins import Memory, Radio, Values


class Fading(Radio):
    """Sends in every step; the farther, the more is lost, never two in a row."""

    radio: Literal["own"] = "own"
    decay: PositiveFloat | None = 10.0
    """Distance at which a third passes [m]."""
    passed: ClassVar[Memory] = Memory("1", "messages that passed since one was lost")

    def sends(self, r: Values) -> Any:
        """Return the time of a message."""
        return r.number * r.timestep

    def passed_next(self, r: Values) -> Any:
        """Count on, or begin anew."""
        if r.passed > 0.0 and r.draw > math.exp(-r.distance / self.decay):
            return 0.0
        return r.passed + 1.0

    def loses(self, r: Values) -> Any:
        """Return whether it is lost."""
        return r.passed == 0.0
'''
COMPILED = '    radio: Literal["own"] = "own"\n    compiled: ClassVar[bool] = True\n'
HEARD = ("q", "messages_sent", "messages_heard", "messages_lost", "heard_from", "target_estimate")


def flown(folder: Path, text: str, *changes: str) -> Run:
    (folder / "own.py").write_text(text)
    (folder / "own.yaml").write_text(SCENARIO)
    return run(load_scenario(folder / "own.yaml", changes))


def bits(found: Run) -> list[bytes]:
    return [found.trace[name].values.tobytes() for name in HEARD]


@pytest.mark.parametrize("kind", RADIOS)
def test_what_ships_is_a_plugin_with_the_same_text(compiled: None, tmp_path: Path, kind: type[Radio]) -> None:
    """The file itself, with the name changed, compiled and in Python: the same bits."""
    name = kind.model_fields["radio"].default
    text = (Path(radio.__file__).parent / f"{name}.py").read_text()
    text = text.replace(f'"{name}"', '"own"').replace("escort_mj.radios.radio", "escort_mj.plugins")
    shipped = bits(flown(tmp_path, text, f"communication.radio={name}"))
    assert bits(flown(tmp_path, text)) == shipped
    assert bits(flown(tmp_path, text.replace('    radio: Literal["own"] = "own"\n', COMPILED))) == shipped


def test_numbers_of_its_own_and_a_distance(compiled: None, tmp_path: Path) -> None:
    found = flown(tmp_path, FADING)
    lost, heard = (found.trace[name].values[-1].sum() for name in ("messages_lost", "messages_heard"))
    assert 0.2 < lost / (lost + heard) < 0.5
    text = FADING.replace('    radio: Literal["own"] = "own"\n', COMPILED)
    assert bits(flown(tmp_path, text)) == bits(found)
    none = flown(tmp_path, text, "communication.decay=null")
    assert none.trace["messages_lost"].values.max() == 0.0, "null is no limit"
    slow = text.replace("def loses", "def delays(self, r):\n        return 0.07\n\n    def loses")
    later = flown(tmp_path, slow)
    assert later.trace["messages_heard"].values.max() == 0.0, "what takes more than longest is lost"


@pytest.mark.slow  # docs/plugins.md has a radio whose checks are run each time
def test_it_passes_its_checks(compiled: None, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(FADING)
    wrong = [check for check in check_plugin(str(tmp_path / "own.py")) if not check.held]
    assert not wrong


@pytest.mark.crossed
@pytest.mark.parametrize("form", ["Python", "compiled"])
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("        return r.passed == 0.0", "        return 1.0 / (r.time < 0.5)"),
            r"own.py:\d+: ZeroDivisionError: ",
        ),
        (
            ("return r.number * r.timestep", "return r.timestep * (r.number if r.number < 99 else math.inf)"),
            r"own.py:\d+: Fading gave a message of robot 1 a time that is not a finite number",
        ),
        (
            ("return r.number * r.timestep", "return r.timestep * abs(r.number - 9.0)"),
            r"own.py:\d+: Fading gave message 1 of robot 1 the time 0.016 s, no later than",
        ),
        (
            ("return r.number * r.timestep", "return 0.5"),
            r"own.py:\d+: Fading gave message 1 of robot 1 the time 0.5 s, no later than",
        ),
        (
            ("return r.number * r.timestep", "return r.number * r.timestep - 1.0"),
            r"own.py:\d+: Fading gave message 0 of robot 1 the time -1 s, no later than",
        ),
        (
            ("        return r.passed == 0.0", "        return 0.25"),
            r"own.py:\d+: Fading gave message 0 of robot 1 the loss 0.25; expected True or False",
        ),
        (
            ("def loses", "def delays(self, r):\n        return -0.1\n\n    def loses"),
            r"own.py:\d+: Fading gave message 0 of robot 1 a delay of -0.1 s; expected 0 or more",
        ),
    ],
    ids=["raises", "infinite", "back", "the same", "before the start", "a number", "a negative delay"],
)  # fmt: skip
def test_what_it_does_wrong_ends_the_run_with_its_place(
    compiled: None, tmp_path: Path, change: tuple[str, str], said: str, form: str
) -> None:
    text = FADING.replace(*change)
    if form == "compiled":
        if "Zero" in said:
            return  # in kernels, what is divided by zero is infinite
        text = text.replace('    radio: Literal["own"] = "own"\n', COMPILED)
    found = flown(tmp_path, text)
    assert found.outcome is Outcome.FAILED
    assert re.search(said, found.message), found.message
    assert np.isfinite(found.trace["q"].values).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("def sends", "def sent"), "has no sends(self, r); did you mean"),
        (("def loses", "def loose"), 'found loose (line 28), of which nothing knows; did you mean "loses"?'),
        (("def loses", "def relay"), 'found relay (line 28), of which nothing knows; did you mean "delay"?'),
        (("def sends(self, r: Values)", "def sends(self)"), "takes (self); it is called with (self, r)"),
        (("def passed_next", "def pased_next"), "has no passed_next(self, r)"),
        (("passed: ClassVar[Memory]", "number: ClassVar[Memory]"), "number (line 16) has no number_next"),
        (("PositiveFloat | None", "str | None"), "decay: found"),
        (('Literal["own"]', "str"), "does not say its name"),
        (('"own"', '"periodic"'), "the radio periodic is there already"),
        (
            ("passed_next(", "period(self, timestep, robots):\n        return -1.0\n\n    def passed_next("),
            "own.py:22: ValueError: period returned -1.0; expected 0 or more",
        ),
        (
            ("passed_next(", "period(self, timestep, robots):\n        return 1 / 0\n\n    def passed_next("),
            "own.py:23: ZeroDivisionError",
        ),
    ],
)
def test_a_wrong_one_is_one_message(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    assert change[0] in FADING
    (tmp_path / "own.py").write_text(FADING.replace(*change))
    (tmp_path / "own.yaml").write_text(SCENARIO)
    with pytest.raises((PluginError, ScenarioError)) as caught:
        load_scenario(tmp_path / "own.yaml")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("pass", "loses returned None; expected a number"),
        ("r.bad = 1.0", "bad cannot be set: equations return their values"),
        ("import random; return random.random() < 0.5", "seeds or draws shared random numbers"),
    ],
)
def test_what_it_may_not_do_is_told(compiled: None, tmp_path: Path, line: str, said: str) -> None:
    found = flown(tmp_path, FADING.replace("return r.passed == 0.0", line))
    assert found.outcome is Outcome.FAILED
    assert said in found.message
