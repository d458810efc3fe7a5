"""Kernels of plugins in the cache: found by later processes, unless damaged, never read as pickles."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from escort_mj.native import artifacts, cache
from tests.plugged import COMPILED, LAW

PLAIN = LAW + COMPILED
PRINT = "            print('begins', r.time)\n"
# Functions of NumPy become lanes; printing needs an object of Python's.
VARIANTS = {
    "functions": ("return r.rho_hat", "return np.clip(np.tanh(r.s), -0.5, 0.5) + r.rho_hat"),
    "choices": ("return r.rho_hat", "return np.where(r.s > 0.0, np.sqrt(np.abs(r.s)), -r.s) + r.rho_hat"),
    "prints": ("return r.rho_hat", f"if r.time < 0.001:\n{PRINT}        return r.rho_hat"),
}
PROGRAM = """
import hashlib, sys
from escort_mj import api
for law in sys.argv[2:]:
    scenario = api.load_scenario(sys.argv[1], [f"controller={law}"])
    tau = api.run(scenario).trace["tau"].values
    print(law, hashlib.sha256(tau.tobytes()).hexdigest(), "escort_mj.native.compiler.plugged" in sys.modules)
"""


@pytest.fixture
def folder(compiled: None, tmp_path: Path) -> Iterator[Path]:
    """Scenario and plugin files with laws that no other test has; what they leave in the cache goes."""
    before = set(kept())
    (tmp_path / "pid.py").write_text(f"{PLAIN}\n# {tmp_path}")
    for name, change in VARIANTS.items():
        text = PLAIN.replace(*change).replace('"pid"', f'"{name}"')
        text = text.replace("class Pid", f"class {name.title()}")
        (tmp_path / f"{name}.py").write_text(f"import numpy as np\n{text}\n# {tmp_path}")
    files = ", ".join(f"{name}.py" for name in ("pid", *VARIANTS))
    (tmp_path / "own.yaml").write_text(f"duration: 0.1\nplugins: [{files}]\ncontroller: pid\n")
    yield tmp_path
    for path in set(kept()) - before:
        path.unlink()


def kept() -> list[Path]:
    return list(cache.kernels.folder.glob("plugin.*"))


def flown(folder: Path, *laws: str) -> list[tuple[str, str, bool]]:
    """What a fresh process finds: law, digest of its forces, and whether it compiled."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, folder / "own.yaml", *laws],
        check=True, stdout=subprocess.PIPE, text=True, env={**os.environ, "NUMBA_DEBUG_CACHE": "0"},
    )  # fmt: skip
    lines = [line.split() for line in done.stdout.splitlines() if not line.startswith("begins")]
    return [(law, digest, compiled == "True") for law, digest, compiled in lines]


@pytest.mark.slow
def test_a_kernel_is_found_by_the_next_process_and_not_when_damaged(folder: Path) -> None:
    before = set(kept())
    ((_, first, compiles),) = flown(folder, "pid")
    assert compiles
    (file,) = set(kept()) - before
    whole = file.read_bytes()
    assert b"run" in whole and file.stat().st_mode & 0o777 == 0o600
    assert flown(folder, "pid") == [("pid", first, False)], "the same bits, not compiled again"
    name = file.name.removeprefix("plugin.").removesuffix(".o")
    assert artifacts.kept_plugged(name) is not None
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert artifacts.kept_plugged(name) is None, "damaged: as if it were not there"
    assert not [path for path in cache.kernels.folder.rglob("*law*force*")], "numba's own cache has pickles"


@pytest.mark.slow
def test_a_damaged_kernel_is_mended(folder: Path) -> None:
    before = set(kept())
    first = flown(folder, "pid")
    (file,) = set(kept()) - before
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert flown(folder, "pid") == first
    assert len(file.read_bytes()) == len(whole)


@pytest.mark.slow
def test_kernels_with_functions_are_kept_and_those_with_objects_are_not(folder: Path) -> None:
    before = set(kept())
    first = flown(folder, *VARIANTS)
    assert len(set(kept()) - before) == 2, "all but the one that prints"
    assert [each[:2] for each in flown(folder, *VARIANTS)] == [each[:2] for each in first]
    assert len({digest for _, digest, _ in first}) == 3
