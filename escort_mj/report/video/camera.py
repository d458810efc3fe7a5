"""Where the video's camera stands: as near as it can while everything it must show is in the picture.

Pure numbers; the view is handed to MuJoCo as a free camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A free camera, as MuJoCo describes it.

    Attributes:
        look_at: Point in the middle of the picture, shape (3,) [m].
        distance: From the camera to that point [m].
        azimuth: Direction of view around the vertical [deg]; 90 looks along +y.
        elevation: Direction of view above the horizon [deg]; -90 looks straight down.
    """

    look_at: Array
    distance: float
    azimuth: float
    elevation: float

    @property
    def axes(self) -> Array:
        """The camera's right, up and forward as rows, shape (3, 3)."""
        return view_axes(self.azimuth, self.elevation)

    def project(self, points: Array, size: tuple[int, int], field_of_view: float) -> Array:
        """Pixels (column, row) at which points appear.

        Args:
            points: Shape (..., 3) [m].
            size: Width and height of the picture [pixel].
            field_of_view: Vertical angle of the picture [deg].

        Returns:
            Shape (..., 2); NaN for points behind the camera.
        """
        right, up, forward = self.axes
        eye = self.look_at - self.distance * forward
        offset = np.asarray(points) - eye
        depth = offset @ forward
        depth = np.where(depth > 0, depth, np.nan)
        scale = size[1] / 2 / math.tan(math.radians(field_of_view) / 2)
        column = size[0] / 2 + scale * (offset @ right) / depth
        row = size[1] / 2 - scale * (offset @ up) / depth
        return np.stack([column, row], axis=-1)


def view_axes(azimuth: float, elevation: float) -> Array:
    """Right, up and forward of a camera, as rows, shape (3, 3)."""
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([math.sin(a), -math.cos(a), 0.0])
    return np.stack([right, np.cross(right, forward), forward])


class Insets(NamedTuple):
    """Rims of a picture that stay free, as shares of its width and height."""

    side: float
    top: float
    bottom: float


def frame(
    points: Array,
    azimuth: float,
    elevation: float,
    field_of_view: float,
    aspect: float,
    insets: Insets,
) -> View:
    """The nearest camera of a given direction that sees every point.

    A point is in the picture when it lies between four planes through the camera. Across the picture,
    and up and down it, that is linear in the camera's place, so the nearest place has a closed form.

    Args:
        points: What must be seen, shape (k, 3) [m].
        azimuth: Direction of view [deg].
        elevation: Direction of view [deg].
        field_of_view: Vertical angle of the picture [deg].
        aspect: Width over height of the picture.
        insets: Rims in which no point may be.
    """
    axes = view_axes(azimuth, elevation)
    right, up, forward = (np.asarray(points) @ axes.T).T
    slope = math.tan(math.radians(field_of_view) / 2)
    side = aspect * slope * (1.0 - 2.0 * insets.side)
    limits = (
        (right, side, side),
        (up, slope * (1.0 - 2.0 * insets.top), slope * (1.0 - 2.0 * insets.bottom)),
    )
    reach = [(np.max(x - plus * forward), np.max(-x - minus * forward)) for x, plus, minus in limits]
    depth = min(-(p + m) / (plus + minus) for (p, m), (_, plus, minus) in zip(reach, limits, strict=True))
    across = [
        ((p + plus * depth) + (-m - minus * depth)) / 2
        for (p, m), (_, plus, minus) in zip(reach, limits, strict=True)
    ]
    distance = max(float(np.median(forward)) - depth, 1e-3)
    return View(np.array([*across, depth + distance]) @ axes, distance, azimuth, elevation)
