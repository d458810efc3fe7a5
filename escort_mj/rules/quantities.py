"""The rules that ship: distances, and how many robots have failed."""

from typing import Any, ClassVar, Literal

from escort_mj.behaviors.robots import Robots
from escort_mj.components.parameters import UNLIMITED
from escort_mj.native.lanes import everywhere, least
from escort_mj.native.vectors import norm
from escort_mj.rules.rule import Rule


class ObstacleDistance(Rule):
    """Distance from a robot to the nearest obstacle, surface to surface [m]."""

    looks_at: ClassVar[tuple[str, ...]] = ("obstacles",)
    quantity: Literal["obstacle_distance"] = "obstacle_distance"

    def value(self, r: Robots) -> Any:
        """Return the least gap."""
        nearest = everywhere(UNLIMITED)
        for j in range(r.obstacles):
            nearest = least(nearest, r.obstacle_gap(j))
        return nearest


class RobotDistance(Rule):
    """Distance from a robot to the nearest other robot, surface to surface [m]."""

    looks_at: ClassVar[tuple[str, ...]] = ("robots",)
    quantity: Literal["robot_distance"] = "robot_distance"

    def value(self, r: Robots) -> Any:
        """Return the least gap."""
        nearest = everywhere(UNLIMITED)
        for j in range(r.robots):
            nearest = least(nearest, r.robot_gap(j))
        return nearest


class TargetDistance(Rule):
    """Distance between the centers of a robot and the target [m]."""

    looks_at: ClassVar[tuple[str, ...]] = ("target",)
    quantity: Literal["target_distance"] = "target_distance"

    def value(self, r: Robots) -> Any:
        """Return the distance."""
        return norm(r.q - r.target)


class TargetObstacleDistance(Rule):
    """Distance from the target's center to the surface of the nearest obstacle that the robot sees [m]."""

    looks_at: ClassVar[tuple[str, ...]] = ("target", "obstacles")
    quantity: Literal["target_obstacle_distance"] = "target_obstacle_distance"

    def value(self, r: Robots) -> Any:
        """Return the least gap."""
        nearest = everywhere(UNLIMITED)
        for j in range(r.obstacles):
            nearest = least(nearest, r.target_gap(j))
        return nearest


class RobotsLost(Rule):
    """Number of failed robots [1]."""

    quantity: Literal["robots_lost"] = "robots_lost"

    def value(self, r: Robots) -> Any:
        """Return the number, the same for all robots."""
        return r.lost
