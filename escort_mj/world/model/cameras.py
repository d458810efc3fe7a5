"""Cameras that frame a mission: overview, follow, top."""

from __future__ import annotations

import math
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from escort_mj.mjcf import child_named, section, set_attributes
from escort_mj.scenario.schema.scenario import Scenario

FIELD_OF_VIEW = math.radians(45.0)
ELEVATION = math.radians(58.0)
MARGIN = 1.08


def add_cameras(
    tree: Element, target: Element, scenario: Scenario, low: NDArray[Any], high: NDArray[Any]
) -> None:
    """Add the cameras and the extent of the scene.

    Args:
        tree: MJCF tree.
        target: The target's body, which holds the `follow` camera.
        scenario: Gives the mission's radius and the picture's aspect.
        low: Lower corner of everything that happens, shape (3,) [m].
        high: Upper corner, shape (3,) [m].
    """
    center, half = (low + high) / 2, (high - low) / 2 * MARGIN
    aspect = scenario.video.width / scenario.video.height
    set_attributes(section(tree, "statistic"), center=center, extent=np.linalg.norm(half))
    world = section(tree, "worldbody")
    overview = _distance(half, ELEVATION, aspect)
    camera = SubElement(world, "camera", name="overview")
    set_attributes(camera, pos=center + overview * _back(ELEVATION), xyaxes=_axes(ELEVATION))
    top = _distance(half, math.pi / 2, aspect)
    camera = SubElement(world, "camera", name="top")
    set_attributes(camera, pos=center + [0.0, 0.0, top], xyaxes=_axes(math.pi / 2))
    around = np.full(3, 1.6 * scenario.mission.radius)
    place = _distance(around, ELEVATION, aspect) * _back(ELEVATION)
    set_attributes(child_named(target, "camera", "target_follow"), pos=place, xyaxes=_axes(ELEVATION))


def _distance(half: NDArray[Any], elevation: float, aspect: float) -> float:
    """How far back a camera must stand so that a box of these half sizes fits the picture [m]."""
    up = half[1] * math.sin(elevation) + half[2] * math.cos(elevation)
    toward = half[1] * math.cos(elevation) + half[2] * math.sin(elevation)
    return float(max(half[0] / aspect, up) / math.tan(FIELD_OF_VIEW / 2) + toward)


def _back(elevation: float) -> NDArray[Any]:
    """Unit vector from what is looked at to the camera."""
    return np.array([0.0, -math.cos(elevation), math.sin(elevation)])


def _axes(elevation: float) -> list[float]:
    """The camera's right and up."""
    return [1.0, 0.0, 0.0, 0.0, math.sin(elevation), math.cos(elevation)]
