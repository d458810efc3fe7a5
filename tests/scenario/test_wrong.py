"""Wrong scenarios: one fault each, with its place, what was found and what is allowed."""

from pathlib import Path
from typing import Any

import pytest

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario import dump_scenario, parse_scenario
from tests.corpus import assert_said, read, wrong

FOLDER = Path(__file__).parent


def faults_of(text: str, overrides: list[str] | None = None) -> tuple[Fault, ...]:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "s", overrides or ())
    return tuple(caught.value.faults)


@pytest.mark.parametrize("case", wrong(FOLDER / "wrong"))
def test_one_fault_with_its_place(case: dict[str, Any]) -> None:
    (fault,) = faults_of(case["text"], case.get("set"))
    assert_said(str(fault).removeprefix("s:"), case["said"])
    assert not any(word in str(fault) for word in ("pydantic", "Error", "union_", "Union", "_kind"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"robots: {{count: {'9' * 6000}}}", "1:17: robots.count: ... expected a whole number"),
        ("name: " + "[" * 5000 + "]" * 5000, "1:19: name[0] ... levels of nesting"),
        ("target: {position: [0, t" + "+t" * 200 + "]}", "1:24: target.position[1]: ... 401 characters"),
    ],
)
def test_too_much_of_anything(text: str, said: str) -> None:
    (fault,) = faults_of(text)
    assert_said(str(fault).removeprefix("s:"), said)


def test_too_long_a_key_path() -> None:
    (fault,) = faults_of("name: x", [".".join("a" * 3000) + "=1"])
    assert str(fault) == f"--set {'a.' * 38}a...: found a key path of 3000 levels; expected at most 12"


def test_all_expectations_at_once_and_in_order() -> None:
    texts = [case.values[0]["text"] for case in wrong(FOLDER / "wrong") if case.id.startswith("expectations")]
    head = texts[0][: texts[0].index("{metric")]
    alone = dict.fromkeys(text.removeprefix(head) for text in texts)
    faults = faults_of(head + "\n  - ".join(alone))
    assert [fault.line for fault in faults] == list(range(4, 4 + len(alone)))


@pytest.mark.parametrize("text", read(FOLDER / "right.yaml"))
def test_right_tables_read_back_the_same(text: str) -> None:
    scenario = parse_scenario(text)
    assert parse_scenario(dump_scenario(scenario)) == scenario


@pytest.mark.parametrize("metric", ["mass_eigenvalue_min", "skew_residual", "lyapunov_rise"])
def test_the_truth_is_recorded_where_a_metric_needs_it(metric: str) -> None:
    text = f"expect: [{{metric: {metric}, at_most: 5}}]\nrecording: {{truth: TRUTH}}\n"
    (fault,) = faults_of(text.replace("TRUTH", "false"))
    said = f"s:1:19: expect[0].metric: found {metric}, but the truth is not recorded (recording.truth)"
    assert_said(fault, said)
    assert parse_scenario(text.replace("TRUTH", "true")).recording.truth
