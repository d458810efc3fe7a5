"""`escort-mj check`: many scenarios side by side, reports for people and machines, exit codes."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from escort_mj import api, mission
from escort_mj.study.engine import parallel
from escort_mj.study.engine.backends import here
from tests.test_cli import command  # noqa: F401  a fixture: one command in a folder of its own

BODY = """\
duration: 2
robots: {positions: [[5, 0], [-5, 0]]}
mission: {radius: 5, behaviors: [surface]}
expect:
"""
FILES = {
    "s/good.yaml": "  - {contacts: none}\n  - {metric: radius_error_max, at_most: 0.5}\n",
    "s/fails.yaml": "  - {contacts: none}\n\n  - {metric: force_rms, at_least: 5}\n",
    "s/near.yaml": "  - {metric: robot_distance_min, at_most: 10.1}\n",
    "s/known.yaml": "  - {metric: force_rms, at_least: 5, xfail: 'no, never: 100 %'}\n",
    "s/strict.yaml": "  - {contacts: none, xfail: they touch}\n",
    "s/deep/bad.yaml": "  - {contacts: nobody}\nrobotos: {}\n",
    "s/diverges.yaml": "  - {contacts: none}\n",
    "s/study.yaml": None,
}


@pytest.fixture
def check(command, tmp_path, monkeypatch):  # noqa: F811
    """Checks files in this process: to start others takes as long as what is tested here."""
    monkeypatch.setattr(parallel.Workers, "compute", lambda pool, *given: here(*given))
    monkeypatch.setattr("escort_mj.study.engine.parallel.parent_of_workers", lambda: None)
    return check_elsewhere(command, tmp_path)


def check_elsewhere(command, tmp_path):  # noqa: F811
    for name, expectations in FILES.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        text = "vary: {}\n" if expectations is None else BODY + expectations
        if "diverges" in name:
            text = text.replace("surface]", "surface]}\nuncertainty: {disturbance: [0, 1000]")
        file.write_text(text)
    return lambda *arguments: command("check", *arguments, "--workers", "1", "--no-video")


def test_one_that_passes_leaves_no_run(check, tmp_path: Path) -> None:
    code, out, err = check("s/good.yaml")
    assert (code, err) == (0, "")
    assert "pass   s/good  3 of 3 verdicts" in out and "1 scenario: 1 passed" in out
    left = {path.name for path in (tmp_path / "renders").rglob("*.*")}
    assert left == {"design.json", "results.sqlite"}
    assert check("s/good.yaml", "--keep", "--out", "all")[0] == 0
    assert (tmp_path / "all" / "s" / "good" / "trace.nc").is_file()


def test_a_folder_with_everything_in_it(check, tmp_path: Path, monkeypatch) -> None:
    code, out, err = check("s", "nosuch", "--junit", "j.xml", "--github")
    assert code == 3 and err == ""
    assert "8 scenarios: 3 passed, 2 failed, 2 cannot run, 1 broke" in out
    for words in (
        "FAIL: force_rms at least 5 N: ",
        "near: robot_distance_min at most 10.1 m: 10 m",
        "xfail: force_rms at least 5 N",
        "XPASS: contacts none: none; passed, but failure was expected: they touch",
        "s/deep/bad.yaml:6:1: robotos: is not a key; allowed are",
        's/deep/bad.yaml:5:16: expect[0].contacts: found "nobody"; expected none, any',
        "nosuch: there is no such file or shipped scenario",
        "kept: renders/check/s/fails",
    ):
        assert words in out, words
    kept = {path.parent.name for path in (tmp_path / "renders").rglob("outcome.json")}
    assert kept == {"fails", "strict", "diverges"}


def test_junit(check, tmp_path: Path) -> None:
    check("s", "--junit", "j.xml")
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert root.tag == "testsuites"
    suites = {suite.get("name"): suite for suite in root}
    assert set(suites) == {
        f"s/{name}" for name in ("deep/bad", "diverges", "fails", "good", "known", "near", "strict")
    }
    counts = {
        name.removeprefix("s/"): tuple(
            int(suite.get(key)) for key in ("tests", "failures", "errors", "skipped")
        )
        for name, suite in suites.items()
    }
    assert counts == {
        "deep/bad": (1, 0, 1, 0),
        "diverges": (2, 0, 1, 0),
        "fails": (3, 1, 0, 0),
        "good": (3, 0, 0, 0),
        "known": (2, 0, 0, 1),
        "near": (2, 0, 0, 0),
        "strict": (2, 1, 0, 0),
    }
    assert [int(root.get(key)) for key in ("tests", "failures", "errors", "skipped")] == [15, 2, 2, 1]
    failed = suites["s/fails"].find("testcase[failure]")
    assert (failed.get("file"), failed.get("line")) == ("s/fails.yaml", "7")
    assert failed.get("name") == "force_rms at least 5 N"
    assert "[[ATTACHMENT|renders/check/s/fails]]" in failed.find("failure").text


def test_json(check, tmp_path: Path) -> None:
    _, out, err = check("s", "--json", "--github")
    assert "::error file=s/fails.yaml,line=7" in err
    found = json.loads(out, parse_constant=pytest.fail)
    assert (found["passed"], found["exit_code"]) == (False, 3)
    scenarios = {one["label"].removeprefix("s/"): one for one in found["scenarios"]}
    codes = {name: one["exit_code"] for name, one in scenarios.items()}
    assert codes == {"deep/bad": 2, "diverges": 3, "fails": 1, "good": 0, "known": 0, "near": 0, "strict": 1}
    assert scenarios["deep/bad"]["faults"][0]["line"] == 5
    verdict = scenarios["fails"]["verdicts"][2]
    assert (verdict["metric"], verdict["passed"], verdict["line"]) == ("force_rms", False, 7)
    assert verdict["margin"] == pytest.approx(verdict["value"] - 5.0)
    assert scenarios["diverges"]["outcome"] == "diverged"


def test_github_annotations(check) -> None:
    _, out, _ = check("s", "--github")
    lines = [line for line in out.splitlines() if line.startswith("::")]
    assert (
        "::error file=s/fails.yaml,line=7,title=s/fails%3A force_rms::force_rms at least 5 N: "
        in "\n".join(lines)
    )
    assert any(line.startswith("::warning file=s/near.yaml,line=5,") for line in lines)
    assert any(line.startswith("::error file=s/deep/bad.yaml,line=6,") for line in lines)
    assert not any("known" in line for line in lines)
    assert len(lines) == 6


HOSTILE = r"no\n::error::a\n::stop-commands::b\u2028##[error]c\u202e"  # what the reader does not refuse


def test_text_of_users_gives_no_orders_to_runners_and_terminals(check, tmp_path: Path) -> None:
    (tmp_path / "s" / "fails.yaml").rename(file := tmp_path / "s" / "::error::e\n::error::f.yaml")
    file.write_text(file.read_text().replace("at_least: 5", f'at_most: 5, xfail: "{HOSTILE}"'))
    for options in ((), ("--github",), ("--json",)):
        code, out, _ = check(str(file), "nosuch\n::error::g", *options)
        assert code == 2 and "stop-commands" in out
        assert all(char == "\n" or char.isprintable() for char in out)
        orders = [line for line in map(str.strip, out.split("\n")) if line.startswith("::")]
        assert len(orders) == (2 if options == ("--github",) else 0), orders
        assert all(order.startswith("::error file=") for order in orders)
        assert "##[" not in out


def test_a_run_is_named_by_its_seed(check, tmp_path: Path) -> None:
    (tmp_path / "s" / "good.yaml").write_text("seed: 7\n" + (tmp_path / "s" / "good.yaml").read_text())
    options = ("--seeds", "2", "--set", "mission.radius=8", "--junit", "j.xml")
    code, out, _ = check("s/good.yaml", "s/fails.yaml", *options)
    assert code == 1
    names = ["s/good-seed-7", "s/good-seed-8", "s/fails-seed-0", "s/fails-seed-1"]
    for name in names:
        assert f"  FAIL   {name} " in out and f"kept: renders/check/{name}\n" in out
        resolved = (tmp_path / "renders" / "check" / name / "resolved.yaml").read_text()
        assert f"\nseed: {name.rpartition('-')[2]}\n" in resolved
    assert "again: escort-mj run s/good.yaml --set mission.radius=8 --set seed=8\n" in out
    suites = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert [suite.get("name") for suite in suites] == names
    assert {case.get("classname") for case in suites.iter("testcase")} == set(names)
    seeds = [one.get("value") for one in suites.iterfind("testsuite/properties/property[@name='seed']")]
    assert seeds == ["7", "8", "0", "1"]
    assert "--set seed=1" in suites[3].find("testcase/failure").text
    given = ("s/good.yaml", "--seeds", "2", "--json")
    for override, expected in (("seed=20", [20, 21]), ("seed=null", [0, 1]), ("seed=-1", [])):
        found = json.loads(check(*given, "--set", override)[1])["scenarios"]
        assert [one["seed"] for one in found if one["seed"] is not None] == expected


NEAR_OF_SEEDS = """\
duration: 1
robots: {count: 2, placement: {within: 5, least_gap: 0.6}}
mission: {radius: 5, behaviors: [surface]}
expect:
  - {metric: robot_distance_min, at_least: 4}
  - {metric: robot_distance_min, at_least: 3.999, xfail: they start together}
"""


def test_seeds_are_counted_per_scenario(check, tmp_path: Path) -> None:
    (tmp_path / "s" / "drawn.yaml").write_text(NEAR_OF_SEEDS)
    code, out, _ = check("s/drawn.yaml", "s/near.yaml", "s/deep/bad.yaml", "--seeds", "6", "--json")
    found = json.loads(out)
    closest = {
        one["seed"]: one["verdicts"][1]["value"] for one in found["scenarios"] if one["scenario"] == "s/drawn"
    }
    failing = [seed for seed, value in closest.items() if value < 4.0]
    assert code == 2 and 0 < len(failing) < 6
    counts = {one["scenario"]: (one["runs"], one["passed"]) for one in found["seeds"]}
    assert counts["s/near"] == (6, 6) and counts["s/deep/bad"] == (1, 0)
    assert counts["s/drawn"][1] == 0  # where the bound holds, the expected failure does not come
    failed = next(one["failed"] for one in found["seeds"] if one["scenario"] == "s/drawn")
    assert failed == list(range(6))
    code, out, _ = check("s/drawn.yaml", "s/near.yaml", "s/deep/bad.yaml", "--seeds", "6", "--github")
    assert "s/drawn: 0 of 6 seeds pass\n" in out and "s/near: 6 of 6 seeds pass\n" in out
    seeds = ", ".join(map(str, failing))
    words = f"seed{'s' * (len(failing) > 1)} {seeds}"
    assert f"\n  fails with {words}: robot_distance_min at least 4 m\n" in out
    assert out.count("near with seeds 0, 1, 2, 3, 4, 5; with seed 0 robot_distance_min at most 10.1 m") == 1
    assert "3 scenarios, 13 runs: 6 passed, 6 failed, 1 cannot run\n" in out
    annotations = [line for line in out.splitlines() if line.startswith("::")]
    near = [line for line in annotations if line.startswith("::warning file=s/near.yaml")]
    assert len(near) == 1 and near[0].endswith("; 6 of 6 seeds, seeds 0, 1, 2, 3, 4, 5")
    failures = [line for line in annotations if line.startswith("::error file=s/drawn.yaml,line=5")]
    assert len(failures) == 1 and failures[0].endswith(f"; {len(failing)} of 6 seeds, {words}")
    assert sum("robotos" in line for line in annotations) == 1


def test_repeats(check, monkeypatch) -> None:
    code, out, _ = check("s/good.yaml", "--repeat", "2", "--set", "sensing.position.noise=0.01")
    assert code == 0 and "1 scenario: 1 passed" in out
    flown = []

    def other_seeds(scenario, *given, **how):
        flown.append(scenario.replace(seed=scenario.seed + len(flown)))
        return mission.fly(flown[-1], *given, **how)

    monkeypatch.setattr("escort_mj.study.engine.work.fly", other_seeds)
    code, out, _ = check("s/good.yaml", "--repeat", "2", "--set", "sensing.position.noise=0.01")
    assert code == 3 and "the runs of one seed have different bits, first in q" in out and len(flown) == 2


def test_worse_outranks_bad(check) -> None:
    assert check("s/fails.yaml")[0] == 1
    assert check("s/fails.yaml", "s/deep")[0] == 2
    assert check("s/deep", "s/diverges.yaml")[0] == 3


def test_a_report_that_cannot_be_written_is_said_before_anything_runs(check, tmp_path: Path) -> None:
    code, out, err = check("s/good.yaml", "--junit", "no/such/j.xml")
    assert (code, out) == (2, "") and "there is no folder no/such" in err


def test_a_program_error_is_a_result(check, monkeypatch) -> None:
    monkeypatch.setattr("escort_mj.mission.build", lambda scenario: 1 / 0)
    code, out, _ = check("s/good.yaml", "--github")
    assert code == 3 and "the program broke" in out and "ZeroDivisionError" in out
    assert "::error file=s/good.yaml,line=1,title=s/good%3A the program broke::ZeroDivisionError" in out


CRASH = """
import ctypes
from escort_mj.plugins import metric

@metric(unit="m")
def crash(trace):
    \"\"\"Crashes.\"\"\"
    ctypes.string_at(0)
"""


def test_a_scenario_that_crashes_costs_its_own_row(command, tmp_path: Path) -> None:  # noqa: F811
    check = check_elsewhere(command, tmp_path)
    (tmp_path / "crash.py").write_text(CRASH)
    crashing = BODY.replace("expect:", "plugins: [{file: ../crash.py}]\nexpect:")
    (tmp_path / "s" / "crashes.yaml").write_text(crashing + FILES["s/good.yaml"])
    code, out, err = check("s/crashes.yaml", "s/good.yaml", "s/near.yaml")
    assert (code, err) == (3, "")
    assert "BROKE  s/crashes  the program broke" in out and "killed by SIGSEGV" in out
    assert "3 scenarios: 2 passed, 1 broke" in out


def test_each_once_under_a_label_of_its_own(check, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "there").mkdir()
    monkeypatch.chdir(tmp_path / "there")
    cases = api.cases(["../s", "../s/good.yaml", "main", "../s/deep", tmp_path / "s" / "near.yaml"])
    assert [case.label for case in cases] == [
        "bad",
        "diverges",
        "fails",
        "good",
        "known",
        "near",
        "strict",
        "main",
    ]
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "good.yaml").write_text(BODY + "  []\n")
    labels = [case.label for case in api.cases(["../s/good.yaml", "../other/good.yaml", "../empty"])]
    assert labels[:2] == ["good", "good-2"]
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    for none in (tmp_path / "loop.yaml", "x" * 300):
        assert api.cases([none])[0].label
    (empty,) = api.cases([tmp_path / "there"])
    assert "holds no scenario" in empty.fault


def test_what_runs_and_studies_left_is_no_scenario(check, tmp_path: Path) -> None:
    assert check("s/fails.yaml", "--seeds", "2", "--out", "s/deep/kept")[0] == 1
    assert len([*(tmp_path / "s" / "deep" / "kept").rglob("*.yaml")]) == 4
    (mine := tmp_path / "s" / "deep" / "kept" / "s" / "fails-seed-0" / "mine.yaml").write_text(
        BODY + "  []\n"
    )
    labels = ["bad", "mine", "diverges", "fails", "good", "known", "near", "strict"]
    assert [case.label.rpartition("/")[2] for case in api.cases([tmp_path / "s"])] == labels
    (case,) = api.cases([mine.parent / "scenario.yaml"])  # by its name
    assert not case.fault
    mine.unlink()
    code, out, _ = check("s/deep/kept/s/fails-seed-0")
    assert code == 2 and "this folder holds no scenario" in out


def test_a_folder_without_scenarios_is_named(check, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    for given in (".", "../empty", str(tmp_path / "empty")):
        (case,) = api.cases([given])
        assert (case.label, case.fault) == ("empty", f"{given}: this folder holds no scenario")
    code, out, err = check(".", "../s/good.yaml")
    assert (code, err) == (2, "") and "2 scenarios: 1 passed, 1 cannot run" in out


def test_a_run_that_no_check_has_made_stays(check, tmp_path: Path) -> None:
    api.run(tmp_path / "s" / "fails.yaml", tmp_path / "runs" / "s" / "fails", figures=False, video=False)
    clip = tmp_path / "runs" / "s" / "fails" / "clip.mp4"
    clip.write_text("of that run")
    for _ in range(2):
        code, out, _ = check("s/fails.yaml", "--out", "runs")
        assert code == 1 and "kept: runs/s/fails-2" in out
    assert clip.is_file() and sorted(path.name for path in clip.parents[1].iterdir()) == ["fails", "fails-2"]
