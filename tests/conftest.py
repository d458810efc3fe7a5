"""What tests of several floors share."""

import os

# Pytest's workers have the cores already; threads of BLAS would wait for each other there, and burn time so.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from escort_mj.world.callback import callbacks


@pytest.fixture(scope="session")
def compiled() -> None:
    """The native callbacks of planar missions, compiled or read from the cache once for the whole session."""
    callbacks(2)
