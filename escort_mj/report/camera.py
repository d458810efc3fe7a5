"""Where the video's camera stands: as near as it can while everything it must show is in the picture.

Pure numbers; the view is handed to MuJoCo as a free camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

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


def frame(
    points: Array,
    azimuth: float,
    elevation: float,
    field_of_view: float,
    aspect: float,
    margin: float = 1.06,
) -> View:
    """The nearest camera of a given direction that sees every point.

    A point is in the picture when it lies between four planes through the camera. Along either side of
    the picture that is linear in the camera's place, so the nearest place has a closed form.

    Args:
        points: What must be seen, shape (k, 3) [m].
        azimuth: Direction of view [deg].
        elevation: Direction of view [deg].
        field_of_view: Vertical angle of the picture [deg].
        aspect: Width over height of the picture.
        margin: How much wider than the points the picture is.
    """
    axes = view_axes(azimuth, elevation)
    right, up, forward = (np.asarray(points) @ axes.T).T
    slope_up = math.tan(math.radians(field_of_view) / 2) / margin
    slope_right = slope_up * aspect
    sides = []
    for across, slope in ((right, slope_right), (up, slope_up)):
        high, low = np.max(across - slope * forward), np.max(-across - slope * forward)
        sides.append(((high - low) / 2, -(high + low) / (2 * slope)))
    eye_forward = min(depth for _, depth in sides)
    middle = float(np.median(forward))
    distance = max(middle - eye_forward, 1e-3)
    look_at = np.array([sides[0][0], sides[1][0], eye_forward + distance]) @ axes
    return View(look_at, distance, azimuth, elevation)


def corners(low: Array, high: Array) -> Array:
    """Corners of a box, shape (8, 3)."""
    choice = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T
    return np.where(choice == 1, high, low)
