"""What tests of several floors share."""

import pytest

from escort_mj.world.callback import callbacks


@pytest.fixture(scope="session")
def compiled() -> None:
    """The native callbacks of planar missions, compiled or read from the cache once for the whole session."""
    callbacks(2)
