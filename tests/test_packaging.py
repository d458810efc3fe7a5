"""What packaging says twice is the same: the conda recipe, the citation and the project's own metadata."""

import re
import tomllib
from pathlib import Path

import escort_mj

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
RECIPE = (ROOT / "packaging" / "meta.yaml").read_text()


def plain(requirement: str) -> str:
    return requirement.split(";")[0].replace(" ", "")


def test_the_recipe_asks_for_what_the_project_asks_for() -> None:
    section = RECIPE[RECIPE.index("  run:\n") : RECIPE.index("\ntest:")]
    asked = {re.sub("#.*", "", plain(line)) for line in re.findall(r"^    - (.+)$", section, re.MULTILINE)}
    compiler = PROJECT["optional-dependencies"]["compile"]
    wanted = {plain(one) for one in [*PROJECT["dependencies"], *compiler]}
    assert asked == wanted | {"python" + PROJECT["requires-python"], "ffmpeg"}


def test_versions_are_one() -> None:
    assert f'set version = "{escort_mj.__version__}"' in RECIPE
    assert f"\nversion: {escort_mj.__version__}\n" in (ROOT / "CITATION.cff").read_text()
