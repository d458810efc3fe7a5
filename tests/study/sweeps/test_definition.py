"""Study files: what they say, and every fault with its place."""

import re
from pathlib import Path

import pytest

from escort_mj.api import scenarios_folder
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.study.sweeps.definition import Steps, cells_of, load_study, values_of
from escort_mj.study.sweeps.design import Design

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


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("seeds: 3", "seeds: 0"), "5:8: seeds: found 0; expected at least 1"),
        (("seeds: 3", "seed: 3"), '5:1: seed: is not a key; allowed are study'),
        (("study: mass", "study: ../mass"), "2:8: study: found"),
        (("low: 0.5", "low: 5"), "12:31: vary.robots.mass.high: found 2; expected more than low, 5"),
        (("low: 0.5", "low: -1"), "12:22: vary.robots.mass.low: found -1; a logarithmic"),
        (("count: 3", "cuont: 3"), '12:36: vary.robots.mass.cuont: is not a key; allowed are'),
        (("[apd_smc, pd]", "3"), "11:15: vary.controller: found 3; expected a list"),
        (("[apd_smc, pd]", "[]"), "11:15: vary.controller: has no values"),
        (("[apd_smc, pd]", "[apd_smc, dp]"), "11:25: vary.controller[1]: with controller = dp: "),
        (("robots.mass", "robots.maas"), "12:16: vary.robots.maas: with robots.maas = 0.5: "),
        (("robots.mass", "robots..mass"), "12:3: vary.robots..mass: is no key path of a scenario"),
        (("robots.mass", "seed"), "12:3: vary.seed: seed cannot be varied; seeds and first_seed say which"),
        (("sensing.position.noise", "robots.mass"), "13:52: sample.over.robots.mass: is given"),
        (("{low: 0, high: 0.1}", "[]"), "13:76: sample.over.sensing.position.noise: has no values"),
        (("{low: 0, high: 0.1}", "[0.1, -1]"), "13:76: sample.over.sensing.position.noise: with sensing.pos"),
        (("sample: {method: latin_hypercube, count: 4, over: {sensing.position.noise: {low: 0, high: 0.1}}",
          "parameters: {push: 1}\nsample: {count: 4, over: {push: [1, much]}"),
         "14:33: sample.over.push: is a parameter; expected numbers"),
        (("scenario: main", "scenario: mian"), '3:11: scenario: found mian; there is no such file'),
        (("scenario: main", "scenario: " + "x" * 100_000), f"3:11: scenario: found {'x' * 200}... (1000"),
        (("sample:", "tune: {over: {robots.mass: {low: 1, high: 2}}, objectives: [{metric: energy}],\n"
          "  bounds: [{metric: contacts, at_most_own: null}]}\nsample:"), "14:12: tune.bounds[0]: has no"),
        (("anti_windup", "anti_winding"), "8:36: cases.wound.controller.anti_winding: with"),
        (("duration: 2", "duration: -2"), "4:17: set.duration: with duration = -2: duration: found -2"),
        (("duration: 2,", "duration: 2, controller: pd,"), "11:3: vary.controller: is given in set too"),
        (("duration: 2,", "duration: 2, sensing.position.noise: 1,"), "13:52: sample.over.sensing.position."),
        (("plain: {}", "plain: {controller.anti_windup: false}"), "9:3: cases.plain: says the same as the"),
        (("plain: {}", '"pl\\u202Eain": {}'), "9:18: cases.pl?ain: found"),
        (("[apd_smc, pd]", "[apd_smc, pd, apd_smc]"), '11:29: vary.controller[2]: found "apd_smc" again'),
        (("study: mass", 'study: "ma\\u202Ess"'), '2:8: study: found "ma?ss"; expected 1 to 80 visible'),
        (("latin_hypercube", "nope"), '13:18: sample.method: found "nope"; allowed are sobol'),
        (("sobol", "sobol"), ""),
    ],
)  # fmt: skip
def test_faults_have_their_place(tmp_path: Path, change: tuple[str, str], expected: str) -> None:
    if not expected:
        assert len(Design(load_study(written(tmp_path, GOOD)), scenarios_folder())) == 144
        return
    assert change[0] in GOOD
    found = faults_of(tmp_path, GOOD.replace(*change))
    assert any(fault.startswith(expected) for fault in found), found


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


def test_an_override_of_what_is_varied_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="vary.controller: is given in set too"):
        load_study(written(tmp_path, GOOD), ["controller=pd"])


def test_what_is_no_study_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="is no study"):
        load_study(written(tmp_path, "scenario: main\n"))
    with pytest.raises(UsageError, match="there is no such file"):
        load_study(tmp_path / "nothing.yaml")


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (
            "vary: {robots.mass: {low: 1, high: 2, count: 10000}, robots.radius: [1, 2]}",
            "3:7: vary: the study has 20,000 cells; allowed are 10,000",
        ),
        (
            "sample: {count: 10001, over: {robots.mass: {low: 1, high: 2}}}",
            "3:17: sample.count: found 10001",
        ),
        (
            "seeds: 100000\nvary: {robots.mass: {low: 1, high: 2, count: 11}}",
            "3:8: seeds: 11 cells with 100,000 seeds each take 1,100,000 runs; allowed are 1,000,000",
        ),
    ],
)
def test_a_study_that_is_too_large_is_not_laid_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, more: str, expected: str
) -> None:
    monkeypatch.setattr("escort_mj.study.sweeps.design._cells", lambda *_: 1 / 0)
    (fault,) = faults_of(tmp_path, f"study: large\nscenario: main\n{more}\n")
    assert fault.startswith(expected)


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


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("seeds=5", "--set seeds=5: seeds: is not a key; allowed are "),
        ("robots.masss=5", "--set robots.masss=5: robots.masss: is not a key; allowed are "),
        ("duration=-3", "--set duration=-3: duration: found -3; expected more than 0"),
        ("video={speed: a}", '--set video={speed: a}: video.speed: found "a"; expected a number'),
        ("name=x", "--set name=x: name: name cannot be varied; seeds and first_seed say which"),
        ("target.position=['{a}', 0]", "--set target.position=['{a}', 0]: target.position: found {a}; "),
        ("duration=[1", "--set duration=[1: duration: "),
    ],
)
@pytest.mark.parametrize("own", ["", "set: {duration: 5, robots.mass: 2}\n"])
def test_faults_of_overrides_name_the_override(
    tmp_path: Path, own: str, override: str, expected: str
) -> None:
    text = f"study: s\nscenario: main\nparameters: {{b: 1}}\n{own}"
    with pytest.raises(ScenarioError) as found:
        Design(load_study(written(tmp_path, text), [override]), scenarios_folder())
    assert str(found.value).startswith(expected)


def yaml_of(text: str, folder: Path) -> Path:
    (folder / "kept.yaml").write_text(text)
    return folder / "kept.yaml"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("[enrgy]", "quantities[0].metric: found 'enrgy'; the metrics are .*did you mean \"energy\""),
        ("[{metric: energy, over: tial}]", "quantities[0].over: .*tail"),
        (
            "[{metric: energy, over: tail, after: 3}]",
            "quantities[0]: found over and after; a window is given by over",
        ),
        (
            "[{metric: energy, after: 5, before: 5}]",
            "quantities[0]: its window is empty: after 5 s and before 5 s",
        ),
        ("[{metric: energy, after: 60}]", "quantities[0]: found 60 s; the run ends at 60 s"),
        ("[{metric: energy, by: 5}]", "quantities[0].by: is not a key"),
        ("[energy, energy]", "quantities[1]: energy is in the list already"),
        (
            "[{metric: settling_time, over: tail}]",
            "quantities[0].over: found tail; settling_time is a moment",
        ),
        ("[{over: tail}]", "quantities[0].metric: is missing"),
    ],
)
def test_windows_that_are_none(tmp_path: Path, given: str, words: str) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(f"study: few\nscenario: main\nset: {{expect: []}}\nquantities: {given}\n")
    with pytest.raises(ScenarioError) as error:
        Design(load_study(path), scenarios_folder())
    assert re.search(re.escape(words).replace(r"\.\*", ".*"), str(error.value)), str(error.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("parameters: {1x: 2}", "parameters.1x: found"),
        ("vary: {robots.mass: [1, 2, 1]}", r"vary.robots.mass\[2\]: found 1 again"),
        ("vary: {seed: [1, 2]}", "cannot be varied"),
        ("vary: {robots.count: {low: 1.2, high: 3, count: 2, whole: true}}", "whole numbers are whole"),
        ("parameters: {a: 1}\nvary: {a: [1, 2]}", "vary.a: changes nothing"),
    ],
)
def test_what_means_nothing(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(ScenarioError, match=expected):
        load_study(written(tmp_path, f"study: s\nscenario: main\n{text}\n"))
