"""Plugins that are wrong in one way each: one line says where and what, as they are loaded or as they run."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from escort_mj import load_scenario, run
from escort_mj.errors import PluginError, ScenarioError
from escort_mj.record.outcome import Outcome
from tests.corpus import assert_said, documents
from tests.plugged import COMPILED, WRONG


def cases() -> list[Any]:
    """Return the plugins with what is wrong in them, as parameters of a test."""
    return [
        pytest.param(head, case, id=f"{path.stem}-{number}")
        for path in sorted(WRONG.glob("*.yaml"))
        for head, several in [documents(path)]
        for number, case in enumerate(several)
    ]


def told(folder: Path) -> str:
    """Return what ends a scenario: an error before it runs, or a failure."""
    try:
        found = run(load_scenario(folder / "own.yaml"))
    except (PluginError, ScenarioError) as error:
        return str(error)
    assert found.outcome is Outcome.FAILED
    assert np.isfinite(found.trace["q"].values).all()
    return found.message


@pytest.mark.parametrize(("head", "case"), cases())
def test_is_told_in_one_line_with_its_place(
    compiled: None, tmp_path: Path, head: dict[str, str], case: dict[str, Any]
) -> None:
    old, new = case["change"]
    assert old in head["plugin"]
    text = case.get("before", "") + head["plugin"].replace(old, new) + case.get("more", "")
    (tmp_path / "own.py").write_text(text + (COMPILED if case.get("compiled") else ""))
    (tmp_path / "own.yaml").write_text(head["scenario"].replace(*case.get("mission", ("", ""))))
    found = told(tmp_path)
    assert_said(found, f"... {case['said']}")
    assert "\n" not in found
