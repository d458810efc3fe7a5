"""The text of components that ship is that of plugins: in a file of its own it does the same."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.conformance import check_plugin
from escort_mj.mission.batch import fly_many
from tests.docs.pages import ROOT

WIND = {"gusts": 1.5, "heading": 0.5, "common": False}
MISSIONS: dict[str, tuple[str, Any]] = {
    "disturbances/wind_shear": (
        "wind_shear",
        lambda name: {"uncertainty.disturbances": [{"disturbance": name} | WIND]},
    ),
    "disturbances/downwash": (
        "worlds/downwash",
        lambda name: {"uncertainty.disturbances": [name]},
    ),
    "laws/disturbance_observer": (
        "observer",
        lambda name: {"controller": {"law": name, "bandwidth": 8.0}},
    ),
    "estimators/fixed_gain": (
        "main",
        lambda name: {
            "knowledge": {"target": {"robots": [1, 2], "noise": {"position": 0.02}}, "estimator": name},
            "communication": {"delay": 0.1},
        },
    ),
}
"""Scenario, and the keys that name the component."""


def text_as_plugin(path: str, compiled: bool) -> str:
    """Return what a file says, as a plugin: with a name of its own, and what it imports from one place."""
    text = (ROOT / "escort_mj" / f"{path}.py").read_text()
    names = re.findall(r"^from escort_mj[\w.]* import (.*)$", text, re.MULTILINE)
    imports = f"from escort_mj.plugins import {', '.join(names)}\n"
    text = re.sub(r"(^from escort_mj.*\n)+", imports, text, flags=re.MULTILINE)
    text = text.replace(f'Literal["{Path(path).name}"] = "{Path(path).name}"', 'Literal["mine"] = "mine"')
    line = r"\n    compiled: ClassVar[bool] = True\1"
    return re.sub(r"(\n    \w+: ClassVar)", line, text, count=1) if compiled else text


def flown(path: str, name: str, plugins: list[str]) -> Any:
    """Return the trace of a short mission with the component of a name."""
    scenario, keys = MISSIONS[path]
    short = {"duration": 0.5, "expect": [], "plugins": plugins}
    (flight,) = fly_many([escort_mj.load_scenario(scenario, short | keys(name))], 1, traces=True)
    assert flight.outcome.good, flight.message
    return flight.trace


@pytest.mark.parametrize("path", MISSIONS)
@pytest.mark.parametrize("compiled", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_same_text_as_a_plugin_does_the_same(tmp_path: Path, path: str, compiled: bool) -> None:
    """Compiled, to the bit."""
    file = tmp_path / "mine.py"
    file.write_text(text_as_plugin(path, compiled))
    shipped, own = flown(path, Path(path).name, []), flown(path, "mine", [str(file)])
    for name in {"q", "tau", "disturbance", "component_memory", "target_estimate"} & {*shipped.variables}:
        most = 0.0 if compiled else 1e-9
        np.testing.assert_allclose(own[name].values, shipped[name].values, rtol=0.0, atol=most)
    if compiled:
        assert not [row for row in check_plugin(str(file)) if not row.held]
