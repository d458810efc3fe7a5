"""Behaviors that ship, copied to a plugin's file as they are but for their names: they do the same there."""

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.behaviors import BEHAVIORS

STACKS: dict[str, list[Any]] = {
    "boundary": [{"behavior": "boundary", "point": [3.0, 0.0], "normal": [-1.0, 0.3]}, "surface"],
    "connect": [{"behavior": "connect", "distance": 3.0}, "surface"],
    "guard": ["guard", "surface"],
    "intercept": [{"behavior": "intercept", "quarry": "opponents", "speed": 1.0}, "surface"],
    "orbit": ["surface", "orbit"],
    "repulsion": ["surface", "repulsion"],
    "spacing": ["surface", "spacing"],
    "surface": ["surface", "vertices"],
    "vertices": ["surface", "vertices"],
}
"""Priority stacks with a behavior whose file reads nothing but what every behavior is given."""


def own_name(behavior: Any) -> str:
    return behavior["behavior"] if isinstance(behavior, dict) else behavior


def renamed(behavior: Any) -> dict[str, Any]:
    keys = behavior if isinstance(behavior, dict) else {}
    return {**keys, "behavior": f"own_{own_name(behavior)}"}


@pytest.mark.parametrize("name", STACKS)
def test_a_copy_does_the_same(tmp_path: Path, compiled: None, name: str) -> None:
    (shipped,) = (each for each in BEHAVIORS if each.own_name() == name)
    text = Path(inspect.getfile(shipped)).read_text()
    mine = text.replace(f'Literal["{name}"] = "{name}"', f'Literal["own_{name}"] = "own_{name}"')
    assert mine != text
    (tmp_path / "copied.py").write_text(mine)
    copied = [each if own_name(each) != name else renamed(each) for each in STACKS[name]]
    keys: dict[str, Any] = {"duration": 1.0, "target": {"position": ["0.3*t", "0.1*t"]}, "seed": 3}
    keys["opponents"] = [{"policy": "straight"}] if name in ("guard", "intercept") else []
    flown = [
        escort_mj.run(keys | {"mission": {"behaviors": stack}} | more, figures=False, video=False).trace
        for stack, more in ((STACKS[name], {}), (copied, {"plugins": [str(tmp_path / "copied.py")]}))
    ]
    for signal in ("q", "v_d", "task_wish"):
        np.testing.assert_allclose(flown[1][signal], flown[0][signal], rtol=0, atol=1e-12)
    assert np.abs(flown[0]["q"].values[-1] - flown[0]["q"].values[0]).max() > 0.1
