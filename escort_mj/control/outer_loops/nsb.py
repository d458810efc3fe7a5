"""Null-space-based composition, the paper's outer loop; its kernel is `control/nsb.py`."""

from __future__ import annotations

from typing import Literal

from escort_mj.components.parameters import Parameters


class Nsb(Parameters):
    """Behaviors strictly by priority: each acts only where those above it leave room (paper eq. 2)."""

    loop: Literal["nsb"] = "nsb"
