"""What `make size` counts."""

import importlib.util
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[1] / ".ci" / "size.py"


@pytest.fixture(scope="module")
def size() -> ModuleType:
    spec = importlib.util.spec_from_file_location("size", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_lines_with_nothing_but_words_or_imports_are_no_code(size: ModuleType, tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '"""Text\nof two lines."""\n\nimport os\nfrom os import (\n    path,\n)\n\n# words\nA = 1  # one\n'
        '"""What A is."""\n\n\ndef f(\n    x: int,\n) -> str:\n    """Do."""\n    return """a\n\nb"""\n'
    )
    assert size.code_lines(module) == 1 + 3 + 3


def test_a_room_beyond_its_budget_or_without_one_is_told(
    size: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    budgets = tomllib.loads((size.ROOT / "pyproject.toml").read_text())["tool"]["size"]
    found = {room: (budget, budget) for room, budget in budgets.items()}
    monkeypatch.setattr(size, "sizes", lambda: found)
    assert size.main() == 0
    found |= {"laws": (budgets["laws"] + 10_000, 0), "new": (1, 1)}
    del found["metrics"]
    assert size.main() == 1
    told = capsys.readouterr().err
    assert f"laws: found {budgets['laws'] + 10_000:,} lines of code; the budget is" in told
    assert "new: found 1 lines of code; the budget is 0" in told
    assert "metrics: has a budget, and there is no such room" in told
