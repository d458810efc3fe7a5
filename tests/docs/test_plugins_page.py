"""docs/plugins.md, followed word by word in an empty folder: every file and every command as printed."""

import ast
import re

import pytest
from typer.testing import CliRunner

from escort_mj.cli import app
from escort_mj.conformance import check_plugin
from tests.docs.pages import ROOT
from tests.plugged import hurry

PAGE = (ROOT / "docs" / "plugins.md").read_text()
BLOCK = re.compile(r"(.*?)^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"`(\w+\.(?:py|yaml))`")
PLAIN = ["--no-figures"]  # figures are tested elsewhere, and take long


def followed(folder):
    """Writes the page's files, and gives its commands, each as soon as its turn comes."""
    for words, kind, text in BLOCK.findall(PAGE):
        if kind == "sh":
            yield from (line.removeprefix("escort-mj ").split() for line in text.splitlines())
        elif kind in ("python", "yaml"):
            file = folder / FILE.findall(words)[-1]
            inside = "At the end of" in words
            assert file.exists() == inside
            file.write_text((file.read_text() if inside else "") + text)
        elif kind == "diff":
            file = folder / FILE.findall(words)[-1]
            for part in text.split("\n\n"):
                old, new = (
                    "\n".join(line[1:] for line in part.splitlines() if line[0] in kept)
                    for kept in ("- ", "+ ")
                )
                assert file.read_text().count(old) == 1
                file.write_text(file.read_text().replace(old, new))


@pytest.fixture(scope="module")
def page(compiled, tmp_path_factory):
    """The folder, and what every command printed."""
    folder = tmp_path_factory.mktemp("newcomer")
    printed = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        hurry(patch)
        patch.setattr("escort_mj.conformance.apart.check_apart", check_plugin)  # here: a process takes 3 s
        for number, words in enumerate(followed(folder)):
            more = PLAIN if words[0] == "run" else []
            if words[0] == "compare":
                continue  # draws for long; tested in tests/study
            result = CliRunner().invoke(app, [*words, *more])
            printed[f"{number} {' '.join(words)}"] = result.output
            assert result.exit_code == 0, f"{' '.join(words)}\n{result.output}\n{result.exception}"
    return folder, printed


@pytest.mark.slow
def test_every_command_succeeds_as_printed(page):
    written = re.findall(r"^escort-mj (?!compare|schema)", PAGE, re.MULTILINE)
    assert len(page[1]) == len(written) > 20


@pytest.mark.slow
def test_nothing_that_is_checked_is_wrong(page):
    checks = [lines for command, lines in page[1].items() if "check-plugin" in command]
    assert len(checks) > 12
    assert all(line.startswith("  ok") for lines in checks for line in lines.splitlines())
    assert ["forms agree" in lines for lines in checks][:4] == [False, True, True, True]


@pytest.mark.slow
def test_verdicts_of_the_page_hold(page):
    judged = next(lines for command, lines in page[1].items() if "run judged.yaml" in command)
    assert "bearing_gap" in judged and "together" in judged


@pytest.mark.slow
@pytest.mark.parametrize("mission", ["told", "heard"])
def test_errors_are_those_of_the_page(page, mission):
    judged = next(lines for command, lines in page[1].items() if f"run {mission}.yaml" in command)
    found = re.search(r"estimate_error_rms .* ([\d.]+) m$", judged, re.MULTILINE)
    assert f"after 20 s is {1e3 * float(found[1]):.3g} mm" in PAGE


@pytest.mark.slow
def test_the_examples_are_those_of_the_page(page):
    for name in ("leaky_law.py", "storm.yaml"):
        assert (ROOT / "examples" / "plugins" / name).read_text() == (page[0] / name).read_text()


def test_each_kind_has_an_example_of_at_most_fifteen_lines():
    """Of its class, blank lines left out."""
    shortest = {}
    for _, kind, text in BLOCK.findall(PAGE):
        for made in ast.parse(text).body if kind == "python" else ():
            if isinstance(made, ast.ClassDef):
                lines = [line for line in ast.get_source_segment(text, made).splitlines() if line.strip()]
                base = made.bases[0].id
                shortest[base] = min(len(lines), shortest.get(base, len(lines)))
    assert {"Law", "Behavior", "Sensor", "Estimator", "RobotKind"} <= shortest.keys()
    assert max(shortest.values()) <= 15, shortest
