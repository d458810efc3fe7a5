"""What commands print for programs, as docs/json.md says."""

import inspect
import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from escort_mj.cli import app
from escort_mj.cli.app import Answer, finish
from escort_mj.cli.streams import OUTPUT
from tests.plugged import LAW
from tests.test_cli import QUIET, command

__all__ = ["command"]

WITHOUT = {"schema", "view"}  # one prints JSON anyway, one shows things until it is stopped
PAGE = Path(__file__).parents[1] / "docs" / "json.md"
ROWS = re.findall(r"^\| `([\w-]+)` \| (.*) \|$", PAGE.read_text(), re.MULTILINE)
KEYS = {name: set(re.findall(r"`(\w+)`", re.sub(r": .*", "", keys))) for name, keys in ROWS}
STUDY = "study: few\nscenario: five.yaml\nseeds: 2\n"


@pytest.fixture
def answer(command):
    """The document that a command prints, told from everything else."""

    def ask(*arguments: str) -> dict:
        code, out, _ = command(*arguments, "--json")
        document = json.loads(out, parse_constant=pytest.fail)
        assert (document.pop("command"), document.pop("exit_code")) == (arguments[0], code)
        assert set(document) == KEYS[arguments[0]]
        return document

    return ask


def test_a_run_and_what_is_done_with_it(answer, one_figure, tmp_path: Path) -> None:
    ran = answer("run", "five.yaml", *QUIET)
    assert ran["outcome"] == "completed" and ran["folder"] == "renders/five"
    assert all((tmp_path / ran["folder"] / name).is_file() for name in ran["written"])
    shown = answer("show", ran["folder"])
    assert (shown["samples"], shown["robots"]) == (101, 5)
    assert shown["verdicts"] == ran["verdicts"]
    assert answer("rerun", ran["folder"])["same_bits"]
    assert answer("export", ran["folder"], "five.csv") == {"written": ["five.csv"]}
    written = answer("render", ran["folder"], "--no-video")["written"]
    assert written and all((tmp_path / path).is_file() for path in written)


def test_checks_with_one_that_fails(answer, tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text("name: bad\nrobotos: {count: 5}\n")
    found = answer("check", "five.yaml", "bad.yaml", "--github", "--no-video")
    assert [one["exit_code"] for one in found["scenarios"]] == [0, 2]
    assert found["scenarios"][1]["faults"][0]["line"] == 2


def test_many_runs(answer, undrawn, tmp_path: Path) -> None:
    (tmp_path / "few.yaml").write_text(STUDY)
    swept = answer("sweep", "few.yaml", "--workers", "1")
    assert (swept["runs"], swept["made"], swept["failed"]) == (2, 2, 0)
    page = answer("report", swept["folder"])["page"]
    assert (tmp_path / page).is_file()
    short = "--laws", "pd", "--set", "duration=1", "--workers", "1"
    compared = answer("compare", "five.yaml", *short)
    assert compared["result"]["scenario"] == "five"


def test_a_reproduction(answer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "expect.json").write_text('[{"claim": 1}]')
    made = SimpleNamespace(lines=["one line"], written=["expect.json"], passed=True, folder=tmp_path)
    monkeypatch.setattr("escort_mj.api.studies.reproduce", lambda *_, **__: made)
    assert answer("reproduce", "--out", ".")["result"] == [{"claim": 1}]


def test_around_runs(answer) -> None:
    assert answer("new", "mine.yaml") == {"written": ["mine.yaml", "schema.json"]}
    assert {finding["state"] for finding in answer("doctor")["findings"]} <= {"good", "warning", "bad"}


def test_what_is_found_out(answer, tmp_path: Path) -> None:
    metrics = answer("list", "metrics")["found"]["metrics"]
    assert {"name": "radius_error_mean", "unit": "m"}.items() <= metrics[0].items()
    (tmp_path / "few.yaml").write_text(STUDY)
    (tmp_path / "bad.yaml").write_text("name: bad\nrobotos: {count: 5}\n")
    files = {one["label"]: one for one in answer("validate", "five.yaml", "few.yaml", "bad.yaml")["files"]}
    assert files["five"]["summary"].startswith("5 robots, 2 axes") and not files["five"]["faults"]
    assert files["few.yaml"]["summary"] == "1 cells, 2 seeds: 2 runs"
    assert [fault["line"] for fault in files["bad"]["faults"]] == [2]


def test_every_command_is_on_the_page() -> None:
    commands = {info.name: info.callback for info in app.registered_commands}
    with_json = {name for name, call in commands.items() if "json" in inspect.signature(call).parameters}
    assert with_json == set(KEYS)
    assert set(commands) - with_json <= WITHOUT, "a command prints results, but no JSON"


def test_what_json_has_no_word_for(capfd, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OUTPUT, "json", True)
    with pytest.raises(Exception):  # noqa: B017  typer's own Exit
        finish("run", Answer([], {"value": float("nan"), "path": Path("a"), "pair": (1, 2)}, 1))
    document = {"command": "run", "exit_code": 1, "value": None, "path": "a", "pair": [1, 2]}
    assert json.loads(capfd.readouterr().out) == document


def test_a_run_that_breaks_off_before_its_first_sample_says_why(answer, one_figure, tmp_path: Path) -> None:
    (tmp_path / "own_law.py").write_text(LAW)
    law = "controller={law: pid, fails_at: -1}"
    told = answer("run", "five.yaml", "--plugin", "own_law.py", "--set", law, "--no-video")
    assert told["outcome"] == "failed" and "a plugin raised an error at 0.00 s" in told["message"]
