"""Handles in the browser by which the target and obstacles of a live mission are dragged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

SIZE = 0.35  # of a handle, of the mission's radius


class Grips:
    """Arrows on bodies, which browsers drag.

    Args:
        server: Viser's.
        names: Of the bodies.
        planar: Whether bodies stay at their height.
        radius: Of the mission [m].
    """

    def __init__(self, server: viser.ViserServer, names: Sequence[str], planar: bool, radius: float) -> None:
        self._controls: dict[str, Any] = {}
        self._dragged: dict[str, Array] = {}
        for name in names:
            control = server.scene.add_transform_controls(
                f"/grips/{name}",
                scale=SIZE * radius,
                active_axes=(True, True, not planar),
                disable_rotations=True,
                visible=False,
            )
            self._controls[name] = control

            @control.on_update
            def _(event: Any, name: str = name) -> None:
                if event.client is not None:  # not what the viewer itself writes
                    self._dragged[name] = np.array(event.target.position, dtype=float)

    def show(self, shown: bool) -> None:
        """Show or hide all handles."""
        for control in self._controls.values():
            control.visible = shown

    def take(self) -> dict[str, Array]:
        """Return where bodies were dragged since this was last called, shape (3,) each [m]."""
        taken, self._dragged = self._dragged, {}
        return taken

    def follow(self, places: dict[str, Array]) -> None:
        """Put handles where their bodies are now, but for those that are being dragged.

        Args:
            places: Position of each body, shape (3,) [m].
        """
        for name, control in self._controls.items():
            if name not in self._dragged and np.abs(control.position - places[name]).max() > 1e-9:
                control.position = places[name]
