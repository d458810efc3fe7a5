"""Plugins that tests share, as text, and how to check them in little time."""

from pathlib import Path

import pytest

from escort_mj.conformance import behaviors, estimators, missions, repeats, stand
from tests.corpus import documents, read

WRONG = Path(__file__).parent / "components" / "wrong"


def plugin(kind: str, *files: str) -> tuple[str, str]:
    """Return a plugin that is right, and a scenario that takes it from files of some names."""
    head = documents(WRONG / f"{kind}.yaml")[0]
    return head["plugin"], head["scenario"].replace("own.py", ", ".join(files) or "own.py")


def hurry(patch: pytest.MonkeyPatch) -> None:
    """Let checks of plugins draw a few times and fly shortly; slow tests check all that ships in full."""
    for module in (behaviors, estimators, repeats):
        patch.setattr(module, "DRAWS", 6)
    patch.setattr(stand, "SIZES", ((5, 2), (1, 3), (3, 5)))
    patch.setattr(missions, "DURATION", 0.3)
    patch.setattr(missions, "TIMES", 1)


LAW, SCENARIO = plugin("law", "own_law.py")
ESTIMATOR, _ = plugin("estimator")
BEHAVIOR, METRIC, EXPECTATION, KIND = read(Path(__file__).with_name("plugins.yaml")).values()
COMPILED = """
    compiled: ClassVar[bool] = True
"""
