"""Where points appear in a picture."""

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.report.video.camera import View, view_axes

Array = NDArray[np.float64]


def project(view: View, points: Array, size: tuple[int, int], field_of_view: float) -> Array:
    """Pixels (column, row) at which points appear, NaN for points behind the camera.

    Args:
        view: The camera.
        points: Shape (..., 3) [m].
        size: Width and height of the picture [pixel].
        field_of_view: Vertical angle of the picture [deg].
    """
    right, up, forward = view_axes(view.azimuth, view.elevation)
    offset = np.asarray(points) - (view.look_at - view.distance * forward)
    depth = offset @ forward
    depth = np.where(depth > 0, depth, np.nan)
    scale = size[1] / 2 / math.tan(math.radians(field_of_view) / 2)
    column = size[0] / 2 + scale * (offset @ right) / depth
    return np.stack([column, size[1] / 2 - scale * (offset @ up) / depth], axis=-1)
