"""Pictures of a simulation, drawn by the report's child process."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from escort_mj.environments.simulation import Simulation
from escort_mj.errors import UsageError
from escort_mj.report.video.live import TRAIL, Painter, Picture, Subject
from escort_mj.scenario.arguments import Count, Words
from escort_mj.world.labels import facts_of

SIZE = 640, 360  # width and height [pixel]
Size = Annotated[tuple[Count, Count], Words("width and height in pixels, such as (640, 360)")]
RenderMode = Literal["rgb_array"]


class Camera:
    """Draws a simulation as it goes, through the camera of its scenario's `video`."""

    def __init__(self, simulation: Simulation, size: Size = SIZE) -> None:
        """Prepare; the child process starts with the first picture.

        Args:
            simulation: What to draw.
            size: Width and height [pixel].
        """
        self._simulation = simulation
        self._painter = Painter((int(size[0]), int(size[1])))
        self._shown: object = None
        self._drawn = 0

    def picture(self) -> Picture:
        """Return the mission as it is now, shape (height, width, 3).

        Raises:
            UsageError: If the mission was not started.
            RenderError: If nothing can be drawn on this machine, or the child has failed.
        """
        simulation = self._simulation
        if not simulation.commands:
            raise UsageError("there is nothing to draw yet: call reset")
        if self._shown != (id(simulation.world), simulation.restored):
            world, scenario = simulation.world, simulation.scenario
            self._painter.show(
                Subject(
                    world.xml,
                    world.sizes,
                    facts_of(scenario, world),
                    scenario.video,
                    world.assets,
                )
            )
            self._shown, self._drawn = (id(world), simulation.restored), 0
        recent = int(np.ceil(TRAIL * simulation.scenario.recording.rate)) + 1
        since = max(self._drawn, simulation.commands - recent)
        self._drawn = simulation.commands
        return self._painter.draw(simulation.samples(since))

    def close(self) -> None:
        """End the child process."""
        self._painter.close()
