"""Sensors, one file each: what robots measure of the truth. Any file that has one is found."""

from escort_mj.components.found import found_in
from escort_mj.sensors.lidar import Lidar
from escort_mj.sensors.plain import Plain
from escort_mj.sensors.sensor import QUANTITIES, Sensor

SENSORS: tuple[type[Sensor], ...] = found_in(__name__, __path__, Sensor)
EQUATED = tuple(sensor for sensor in SENSORS if sensor.equated())
"""Those that are equations; the loop has the others itself."""

__all__ = ["EQUATED", "QUANTITIES", "SENSORS", "Lidar", "Plain", "Sensor"]
