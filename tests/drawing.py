"""Tests that draw with MuJoCo run where that is possible, which a worker finds out once."""

import pytest

from escort_mj import gl

BACKEND, REASON = gl.choose_backend()
needs_gl = pytest.mark.skipif(BACKEND is None, reason=f"nothing can be drawn here: {REASON}")
