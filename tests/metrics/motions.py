"""Motions that tests of measures and metrics share."""

from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

TIME = np.linspace(0.0, 10.0, 501)
RADIUS = 5.0


def ring(robots, radius=RADIUS, center=(0.0, 0.0), time=TIME):
    """Robots evenly on a circle, shape (time, robot, axis); radius a number or one per sample and robot."""
    angle = 2.0 * np.pi * np.arange(robots) / robots
    spokes = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radii = np.broadcast_to(radius, (len(time), robots))
    return np.asarray(center) + radii[..., None] * spokes


def steps(time, when, height=1.0):
    """Zero before a moment, a height from it on."""
    return np.where(np.asarray(time) >= when - 1e-9, height, 0.0)


MISSIONS: dict[str, dict[str, Any]] = YAML(typ="safe").load(Path(__file__).with_name("missions.yaml"))
