"""Wrong studies: faults with their places, whatever is done with the study."""

from pathlib import Path
from typing import Any

import pytest

from escort_mj.api import scenarios_folder
from escort_mj.errors import ScenarioError
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design
from tests.corpus import is_said, wrong

SCENARIO = """
name: one
duration: 3
robots: {positions: [[5, 0], [-5, 1]]}
controller: {law: pd, proportional_gain: 2, derivative_gain: 4}
expect: [{metric: tracking_error_rms, at_most: 5}]
"""


@pytest.mark.parametrize("case", wrong(Path(__file__).with_name("wrong")))
def test_faults_have_their_place(tmp_path: Path, case: dict[str, Any]) -> None:
    (tmp_path / "one.yaml").write_text(SCENARIO)
    study = tmp_path / "study.yaml"
    study.write_text(case["text"])
    with pytest.raises(ScenarioError) as caught:
        Design(load_study(study, case.get("set", ())), scenarios_folder())
    faults = [str(fault).removeprefix(f"{study}:") for fault in caught.value.faults]
    assert any(is_said(fault, case["said"]) for fault in faults), (faults, case["said"])


def test_a_name_of_thousands_of_letters(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(f"study: few\nscenario: {'x' * 100_000}\n")
    with pytest.raises(ScenarioError, match=f"scenario: found {'x' * 200}... .1000") as caught:
        Design(load_study(tmp_path / "study.yaml"), scenarios_folder())
    assert len(str(caught.value)) < 1000


def test_one_mistake_is_one_fault_whatever_is_drawn(tmp_path: Path) -> None:
    text = "study: x\nscenario: main\nparameters: {m: 1}\nset: {uncertainty.disturbance: ['{m}*t']}\n"
    text += "sample: {method: random, count: 30, over: {m: {low: 0, high: 1}}}\n"
    (tmp_path / "study.yaml").write_text(text)
    with pytest.raises(ScenarioError, match="found 1 numbers; expected 2") as caught:
        Design(load_study(tmp_path / "study.yaml"), scenarios_folder())
    assert len(caught.value.faults) == 1
