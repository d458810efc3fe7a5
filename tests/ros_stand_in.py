"""A stand-in for the parts of ROS 2 that the example of a node uses: the test is network and clock."""

import sys
from types import ModuleType, SimpleNamespace

import pytest


def vector() -> SimpleNamespace:
    return SimpleNamespace(x=0.0, y=0.0, z=0.0)


class Twist:
    def __init__(self) -> None:
        self.linear, self.angular = vector(), vector()


class Wrench:
    def __init__(self) -> None:
        self.force, self.torque = vector(), vector()


class Odometry:
    def __init__(self) -> None:
        orientation = SimpleNamespace(w=1.0, x=0.0, y=0.0, z=0.0)
        self.header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0))
        self.pose = SimpleNamespace(pose=SimpleNamespace(position=vector(), orientation=orientation))
        self.twist = SimpleNamespace(twist=Twist())


class Node:
    """A node whose messages and clock the test sets."""

    parameters: dict = {}

    def __init__(self, name: str) -> None:
        self.nanoseconds, self.listens, self.sent, self.warnings = 0, {}, {}, []

    def declare_parameter(self, name: str, default: object) -> SimpleNamespace:
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_subscription(self, kind: type, topic: str, callback, qos: int) -> None:
        self.listens[topic] = callback

    def create_publisher(self, kind: type, topic: str, qos: int) -> SimpleNamespace:
        self.sent[topic] = []
        return SimpleNamespace(publish=self.sent[topic].append)

    def create_timer(self, period: float, callback) -> None:
        self.period, self.tick = period, callback

    def get_clock(self) -> SimpleNamespace:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=self.nanoseconds))

    def get_logger(self) -> SimpleNamespace:
        return SimpleNamespace(warning=self.warnings.append)

    def destroy_node(self) -> None:
        self.destroyed = True


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make `import rclpy` find this."""
    contents = {
        "rclpy": {"init": lambda: None},
        "rclpy.node": {"Node": Node},
        "geometry_msgs": {},
        "geometry_msgs.msg": {"Twist": Twist, "Wrench": Wrench},
        "nav_msgs": {},
        "nav_msgs.msg": {"Odometry": Odometry},
    }
    for name, values in contents.items():
        module = ModuleType(name)
        vars(module).update(values)
        monkeypatch.setitem(sys.modules, name, module)
