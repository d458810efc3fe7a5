"""YAML and Python of the pages: what is a scenario is checked as one, what is marked to run is run."""

import io
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from escort_mj.api import scenarios_folder
from escort_mj.scenario.reader.load import parse_scenario
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.study.sweeps.definition import Study, load_study
from escort_mj.study.sweeps.design import Design
from tests.docs.pages import Block, blocks, write_files

FOLLOWED = "docs/plugins.md"  # word by word, in test_plugins_page.py
YAMLS, PYTHONS = (
    [block for block in blocks(kind) if not block.place.startswith(FOLLOWED)] for kind in ("yaml", "python")
)
FOREIGN = {"jobs", "missions"}  # keys that only other programs' files have


def study(text: str, folder: Path) -> None:
    """Reads a study, and checks its cells where its scenario is a shipped one."""
    path = folder / "study.yaml"
    path.write_text(text)
    file = load_study(path)
    if "/" in file.study.scenario or file.study.scenario == "main":
        assert len(Design(file, scenarios_folder())) > 0


@pytest.mark.parametrize("block", YAMLS, ids=[block.place for block in YAMLS])
def test_yaml(block: Block, tmp_path: Path) -> None:
    keys = set(YAML(typ="safe").load(io.StringIO(block.text)))
    if keys <= set(Scenario.model_fields):
        write_files(block.place.partition(":")[0], tmp_path)
        parse_scenario(block.text, str(tmp_path / block.place.replace("/", "-")))
    elif "study" in keys:
        study(block.text, tmp_path)
    elif keys <= set(Study.model_fields):
        study(f"study: some\nscenario: main\n{block.text}", tmp_path)
    else:
        assert keys & FOREIGN, f"{keys} are no keys of scenarios or studies"


@pytest.mark.parametrize("block", PYTHONS, ids=[block.place for block in PYTHONS])
def test_python(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = compile(block.text, block.place, "exec")
    if block.runs:
        monkeypatch.chdir(tmp_path)
        exec(code, {"__name__": "__main__"})


def test_there_is_something_to_test() -> None:
    assert len(YAMLS) > 10 and sum(block.runs for block in PYTHONS) >= 2
