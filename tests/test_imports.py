"""What is not needed to simulate is not imported before it is."""

import doctest
import json
import subprocess
import sys
from importlib.metadata import version

import pytest

import escort_mj

DRAWING = {"matplotlib", "mediapy", "imageio_ffmpeg", "PIL", "jinja2"}
STORAGE = {"xarray", "h5netcdf", "h5py", "pandas", "sqlite3"}
SEARCHES = {"optuna", "cmaes", "distributed", "dask"}
HEAVY = {"numpy", "mujoco", "pydantic"}
COMPILING = {"numba", "dm_control", "scipy"}


def imported(module: str) -> set[str]:
    """Packages that a fresh process has after one import."""
    program = f"import json, sys, {module}; print(json.dumps([name.split('.')[0] for name in sys.modules]))"
    found = subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.PIPE)
    return set(json.loads(found.stdout))


@pytest.mark.parametrize("module", ["escort_mj", "escort_mj.cli"])
def test_the_package_and_its_command_line_import_next_to_nothing(module: str) -> None:
    assert not imported(module) & (DRAWING | STORAGE | SEARCHES | HEAVY | COMPILING)


def test_what_runs_missions_neither_draws_nor_stores_nor_compiles() -> None:
    found = imported("escort_mj.api")
    assert HEAVY <= found, "the test looks for names that nobody has"
    assert not found & (DRAWING | STORAGE | SEARCHES | COMPILING)


def test_linear_algebra_of_a_command_has_one_thread() -> None:
    program = """
import os, sys
os.environ.pop("OPENBLAS_NUM_THREADS", None)
from escort_mj.__main__ import main
try:
    main()
except SystemExit:
    import numpy.linalg, scipy.linalg
    print(len(os.listdir("/proc/self/task")))
"""
    found = subprocess.run([sys.executable, "-c", program, "--help"], check=True, stdout=subprocess.PIPE)
    assert found.stdout.splitlines()[-1] == b"1"


def test_completion_lists_the_public_names() -> None:
    assert sorted(dir(escort_mj)) == sorted([*escort_mj.__all__, "__version__"])
    assert escort_mj.__version__ == version("escort-mj")


def test_the_example_of_the_package_works_as_printed(compiled: None) -> None:
    found = doctest.testmod(escort_mj)
    assert found.attempted >= 3 and not found.failed


@pytest.mark.parametrize("name", escort_mj.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(escort_mj, name).__name__ == name
    assert name in vars(escort_mj), "each use would load it again"
