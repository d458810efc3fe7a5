"""What components say themselves of the mission that they are to take part in, plugins' too."""

from pathlib import Path

import pytest

import escort_mj
from escort_mj.errors import EscortError

PLUGIN = """
from typing import Any, Literal

from escort_mj.plugins import Behavior, Law, Misfit, keep

class Crowded(Behavior):
    behavior: Literal["crowded"] = "crowded"
    least: int = 7

    def task(self, r: Any) -> Any:
        return keep(r.q[0], 0.0, r.q, 1.0)

    def misfits(self, mission: Any) -> Any:
        if mission.robots < self.least:
            yield Misfit(f"found {mission.robots} robots; expected {self.least} or more", "least")

class Planar(Law):
    law: Literal["planar"] = "planar"

    def force(self, r: Any) -> Any:
        return -r.s

    def misfits(self, mission: Any) -> Any:
        if mission.axes > 2:
            yield Misfit("is made for the plane")
"""
KEYS = {"mission.behaviors": ["crowded", "surface"], "controller": {"law": "planar"}, "expect": []}


def loaded(folder: Path, text: str = PLUGIN, **more: object) -> escort_mj.Scenario:
    (plugin := folder / "own.py").write_text(text)
    return escort_mj.load_scenario("main", {**KEYS, **more}, [str(plugin)])


def test_each_kind_of_component_refuses_what_does_not_fit_it(tmp_path: Path) -> None:
    with pytest.raises(EscortError) as caught:
        loaded(tmp_path)
    assert "mission.behaviors[0].least: found 5 robots; expected 7 or more" in str(caught.value)
    assert "controller: is made for the plane" not in str(caught.value)
    space = {"axes": 3, "target.position": [0.0, 0.0, 1.0], "robots.positions": None}
    with pytest.raises(EscortError) as caught:
        loaded(tmp_path, **space)
    assert "least: found 5" in str(caught.value) and "controller: is made for the plane" in str(caught.value)


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ("yield 3", r"own\.py:\d+: TypeError: misfits yielded 3; expected Misfit\(words, \.\.\.\)"),
        ("yield mission.nothing", r"own\.py:15: AttributeError: .*nothing"),
    ],
)
def test_what_a_plugin_says_of_it_is_looked_at(tmp_path: Path, told: str, words: str) -> None:
    text = PLUGIN.replace("if mission.robots < self.least:", "if True:")
    start = text.index("yield Misfit(f")
    end = text.index("\n", start)
    with pytest.raises(EscortError, match=words):
        loaded(tmp_path, text[:start] + told + text[end:])
