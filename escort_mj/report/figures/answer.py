"""How a robot answers a step of velocity, axis by axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.report.figures.drawing.style import figure

Array = NDArray[np.float64]

HEIGHT = 2.4  # inches


class Step(NamedTuple):
    """A step of the reference velocity, and what came of it.

    Attributes:
        axis: Its name.
        size: The reference velocity [m/s].
        time: From the step on; before it negative, shape (k,) [s].
        velocity: Shape (k,) [m/s].
    """

    axis: str
    size: float
    time: Array
    velocity: Array


def draw_steps(steps: Sequence[Step], title: str, path: Path) -> None:
    """Draw steps and answers, a panel for each axis.

    Args:
        steps: At least one.
        title: What stands above.
        path: The file; its suffix says the format.

    Raises:
        WriteError: If it cannot be saved.
    """
    with figure(path, HEIGHT, title) as canvas:
        grid = canvas.subplots(1, len(steps), squeeze=False)[0]
        for axes, step in zip(grid, steps, strict=True):
            wanted = np.where(step.time >= 0.0, step.size, 0.0)
            axes.plot(step.time, wanted, color=palette.LIMIT, linestyle="--", label="reference")
            axes.plot(step.time, step.velocity, color=palette.robot_color(0, 1), label="robot")
            axes.set(title=f"along {step.axis}", xlabel="time from the step [s]")
        grid[0].set_ylabel("velocity [m/s]")
        grid[-1].legend(loc="lower right")
