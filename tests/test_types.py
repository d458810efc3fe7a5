"""Types of the public names: a program that uses them all passes mypy's strict checks."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
STRICT = """
[mypy]
python_version = 3.11
check_untyped_defs = True
disallow_incomplete_defs = True
ignore_missing_imports = True
warn_redundant_casts = True
warn_unused_ignores = True

[mypy-user_program]
disallow_any_generics = True
disallow_subclassing_any = True
disallow_untyped_calls = True
disallow_untyped_defs = True
disallow_untyped_decorators = True
warn_return_any = True
no_implicit_reexport = True
strict_equality = True
extra_checks = True
"""


@pytest.mark.slow
def test_a_user_s_program_passes_strict_checks(tmp_path: Path) -> None:
    """With the settings of the project for the package itself, so that its cache serves."""
    from mypy import api

    (tmp_path / "mypy.ini").write_text(STRICT)
    program = tmp_path / "user_program.py"
    shutil.copyfile(ROOT / "tests" / "user_program.py", program)
    cache = ("--cache-dir", str(ROOT / ".mypy_cache"))
    out, err, code = api.run(["--config-file", str(tmp_path / "mypy.ini"), *cache, str(program)])
    assert code == 0, out + err
