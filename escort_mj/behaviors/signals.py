"""What behaviors record beside their tasks."""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Recorded


class RadiusSignals(Fields):
    """How far from the target robots stay; recorded where that may change, by a behavior `surface`."""

    kept_radius: Annotated[
        Array, "resized", Recorded("m", "distance that the robot keeps from the target at this time")
    ]
