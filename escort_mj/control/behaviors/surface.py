"""Stay on the circle or sphere around the target (paper eq. 5)."""

from __future__ import annotations

from typing import Literal

from pydantic import PositiveFloat

from escort_mj.control.parameters import Parameters


class Surface(Parameters):
    """Brings each robot to the mission's radius from the target."""

    behavior: Literal["surface"] = "surface"
    gain: PositiveFloat = 0.8
    """Gain of the task's error [1/s] (paper: Lambda_3)."""
