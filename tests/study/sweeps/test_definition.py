"""Study files: what they say, and every fault with its place."""

from pathlib import Path
from typing import Any

import pytest

from escort_mj.api import scenarios_folder
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.study.sweeps.definition import cells_of, load_study, values_of
from escort_mj.study.sweeps.design import Design
from escort_mj.study.sweeps.values import Steps
from tests.corpus import assert_said, wrong

GOOD = """
study: mass
scenario: main
set: {duration: 2, expect: []}
seeds: 3
first_seed: 10
cases:
  wound: {controller.anti_windup: false}
  plain: {}
vary:
  controller: [apd_smc, pd]
  robots.mass: {low: 0.5, high: 2, count: 3, scale: log}
sample: {method: latin_hypercube, count: 4, over: {sensing.position.noise: {low: 0, high: 0.1}}}
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "study.yaml"
    path.write_text(text)
    return path


def faults_of(folder: Path, text: str) -> list[str]:
    path = written(folder, text)
    with pytest.raises(ScenarioError) as caught:
        Design(load_study(path), scenarios_folder())
    return [str(fault).removeprefix(f"{path}:") for fault in caught.value.faults]


def test_a_study_says_what_it_varies(tmp_path: Path) -> None:
    study = load_study(written(tmp_path, GOOD)).study
    assert (study.study, study.scenario, study.seeds, study.first_seed) == ("mass", "main", 3, 10)
    assert study.vary["controller"] == ("apd_smc", "pd")
    assert study.vary["robots.mass"] == Steps(low=0.5, high=2, count=3, scale="log")
    assert study.traces == "none"


def test_the_study_that_others_change_is_right(tmp_path: Path) -> None:
    assert len(Design(load_study(written(tmp_path, GOOD)), scenarios_folder())) == 144


def test_all_faults_of_a_file_at_once(tmp_path: Path) -> None:
    found = faults_of(
        tmp_path, GOOD.replace("[apd_smc, pd]", "[apd, dp]").replace("duration: 2", "duratoin: 2")
    )
    assert {fault.partition(": ")[0] for fault in found if "vary.controller" in fault} == {"11:16", "11:21"}
    assert sum("set.duratoin" in fault for fault in found) == 1


def test_cases_that_differ_in_a_flag_or_a_list_are_no_equals(tmp_path: Path) -> None:
    cases = "{a: {robots.count: 1}, b: {robots.count: true}, c: {x.y: [1, 2]}, d: {x.y: [1]}, e: {}}"
    text = f"study: s\nscenario: main\ncases: {cases}\n"
    assert len(load_study(written(tmp_path, text)).study.cases) == 5
    with pytest.raises(ScenarioError, match="cases.b: says the same as the case a"):
        load_study(written(tmp_path, text.replace("true", "1.0")))


def test_what_is_no_study_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="is no study"):
        load_study(written(tmp_path, "scenario: main\n"))
    with pytest.raises(UsageError, match="there is no such file"):
        load_study(tmp_path / "nothing.yaml")


def test_faults_of_cells_and_of_what_chooses_them_come_together(tmp_path: Path) -> None:
    more = "vary: {robots.masss: [1, 2]}\nexpect: [{claim: c, where: {robots.mas: 1}}]\n"
    found = faults_of(tmp_path, f"study: s\nscenario: main\n{more}")
    assert {fault[:2] for fault in found} == {"3:", "4:"}


@pytest.mark.parametrize("case", wrong(Path(__file__).with_name("large")))
def test_a_study_that_is_too_large_is_not_laid_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: dict[str, Any]
) -> None:
    monkeypatch.setattr("escort_mj.study.sweeps.design._cells", lambda *_: 1 / 0)
    (fault,) = faults_of(tmp_path, case["text"])
    assert_said(fault, case["said"])


def test_whole_numbers_are_counted_once(tmp_path: Path) -> None:
    text = "study: s\nscenario: main\nvary: {robots.count: {low: 3, high: 5, count: 10000, whole: true}}\n"
    study = load_study(written(tmp_path, text)).study
    assert cells_of(study) == 3 and values_of(study.vary["robots.count"]) == [3, 4, 5]


def test_overrides_are_added_to_what_is_set(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text("study: s\nscenario: main\nset: {duration: 5}\n")
    file = load_study(path, ["robots.mass=2", "duration=3", "expect=[]"])
    assert file.study.set == {"duration": 3, "robots.mass": 2, "expect": ()}
    assert load_study(yaml_of(file.text, tmp_path)).study == file.study, "what is kept says it, too"
    with pytest.raises(ScenarioError, match=r"--set robots: expected key.path=value"):
        load_study(path, ["robots"])


def yaml_of(text: str, folder: Path) -> Path:
    (folder / "kept.yaml").write_text(text)
    return folder / "kept.yaml"
