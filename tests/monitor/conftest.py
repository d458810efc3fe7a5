"""Monitors are watched in the small worlds of `tests/world`."""

from tests.world.conftest import drifting, make_world, record_steps

__all__ = ["drifting", "make_world", "record_steps"]
