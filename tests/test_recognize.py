"""Which YAML files are scenarios, and where their expectations stand."""

import os
from pathlib import Path
from typing import Any

import pytest

from escort_mj.recognize import is_scenario, is_scenario_name, scenario_names, scenarios_folder, scenarios_in
from escort_mj.scenario.reader.load import expectation_lines

SHIPPED = Path(__file__).parents[1] / "scenarios"
MODELINE = "# yaml-language-server: $schema="

# A file's text, and whether it is a scenario by itself, and if scenarios were asked for.
FILES = [
    (f"{MODELINE}{SHIPPED}/schema.json\nnonsense: 3\n", True, True),
    (f"{MODELINE}ours.json\n", True, True),
    (f"{MODELINE}other.json\nrobots: {{}}\nmission: {{}}\n", False, False),
    (f"{MODELINE}missing.json\nrobots: {{}}\n", False, True),
    (f"{MODELINE}https://example.org/escort_mj/schema.json\n", True, True),
    (f"{MODELINE}missing.json\nnonsense: 3\n", False, False),
    (f"{MODELINE}https://json.schemastore.org/github-workflow.json\nexpect: 3\n", False, False),
    ("duration: 3\nrobots: {count: 3}\n", False, True),
    ("name: ci\non: push\njobs: {}\n", False, False),
    ("study: laws\nvary: {}\n", False, False),
    ("services:\n  robots: 3\n", False, False),
    ("", False, False),
]


@pytest.mark.parametrize(("text", "alone", "asked"), FILES)
def test_what_is_a_scenario(tmp_path, text, alone, asked):
    (tmp_path / "ours.json").write_text((SHIPPED / "schema.json").read_text())
    (tmp_path / "other.json").write_text('{"title": "something else"}')
    file = tmp_path / "x.yaml"
    file.write_text(text)
    assert (is_scenario(file), is_scenario(file, asked=True)) == (alone, asked)
    other = file.rename(tmp_path / "x.txt")
    assert not is_scenario(other, asked=True)


def test_a_file_that_is_no_text_or_not_there(tmp_path):
    (tmp_path / "x.yaml").write_bytes(bytes(range(256)) * 40)
    assert not is_scenario(tmp_path / "x.yaml", asked=True)
    assert not is_scenario(tmp_path / "y.yaml", asked=True)


def test_every_shipped_scenario_says_what_it_is():
    files = list(scenarios_in(SHIPPED))
    assert len(files) >= 13
    assert all(is_scenario(file) for file in files)


def test_names_of_scenarios_are_told_without_reading_the_folder():
    folder = scenarios_folder()
    assert all(is_scenario_name(name, folder) for name in scenario_names(folder))
    outside = f"../{folder.name}/main", f"{folder}/main", "paper/../main", "./main", ".", "", "mian", "main\0"
    assert not any(is_scenario_name(name, folder) for name in (*outside, "studies/minute", "main.yaml"))


def test_a_folder_is_searched_in_order_but_for_what_is_hidden_or_foreign(tmp_path):
    for name in ("b/two.yaml", "a.yml", ".hidden/three.yaml", "b/.four.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("robots: {}\n")
    (tmp_path / "study.yaml").write_text("vary: {}\n")
    assert [path.relative_to(tmp_path).as_posix() for path in scenarios_in(tmp_path)] == [
        "a.yml",
        "b/two.yaml",
    ]


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("duration: 3\nexpect:\n  - {contacts: none}\n\n  - metric: energy\n    at_most: 3\n", [3, 5]),
        ("expect: [{contacts: none}, {sanity: all}]", [1, 1]),
        ("duration: 3", []),
        ("expect: 3", []),
        ("expect: [", []),
        ("- 3", []),
    ],
)
def test_where_expectations_stand(tmp_path, text, lines):
    (tmp_path / "x.yaml").write_text(text)
    assert expectation_lines(tmp_path / "x.yaml") == lines


def test_a_folder_that_goes_while_it_is_read_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("here", "gone", ".hidden"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "one.yaml").write_text("robots: {count: 2}\n")
    scan = os.scandir

    def scan_what_is_left(folder: str) -> Any:
        if Path(folder).name == "gone":
            raise FileNotFoundError(folder)
        return scan(folder)

    monkeypatch.setattr(os, "scandir", scan_what_is_left)
    assert list(scenarios_in(tmp_path)) == [tmp_path / "here" / "one.yaml"]
