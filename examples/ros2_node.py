"""A ROS 2 node that escorts: odometry in, velocities or forces out. It needs ROS 2 (rclpy) and escort_mj.

    python examples/ros2_node.py --ros-args -p scenario:=fifty_hertz -p command:=twist

    in    /robot_1/odom ...     nav_msgs/Odometry, poses in the frame of the scenario
          /target/odom          likewise; without it, the target is where the scenario has it
    out   /robot_1/cmd_vel ...  geometry_msgs/Twist, in the robot's own axes (command:=twist), or
          /robot_1/wrench ...   geometry_msgs/Wrench, likewise (command:=wrench)

While the odometry of any robot is missing or older than 100 ms, all robots are told to stop.
"""

import numpy as np
import rclpy
from geometry_msgs.msg import Twist, Wrench
from nav_msgs.msg import Odometry
from rclpy.node import Node

from escort_mj import Controller, EscortError

OLDEST = 0.1  # s
BRAKING_TIME = 0.2  # s


def turn(q):
    """Rotation matrix from the axes of a body to the world, of a quaternion message, shape (3, 3)."""
    w, x, y, z = np.array([q.w, q.x, q.y, q.z]) / np.linalg.norm([q.w, q.x, q.y, q.z])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Body:
    """The last odometry of a robot or of the target."""

    def __init__(self, clock, axes):
        """Know nothing yet."""
        self.clock, self.axes = clock, axes
        self.heard, self.position, self.velocity, self.turn = -np.inf, np.zeros(3), np.zeros(3), np.eye(3)

    def hear(self, message):
        """Take a message; its velocity is in the body's axes (child_frame_id)."""
        place, speed = message.pose.pose.position, message.twist.twist.linear
        self.turn = turn(message.pose.pose.orientation)
        self.position = np.array([place.x, place.y, place.z])
        self.velocity = self.turn @ [speed.x, speed.y, speed.z]
        self.heard = self.clock()

    @property
    def state(self):
        """Position [m] and velocity [m/s] in the world's axes, shape (p,) each."""
        return self.position[: self.axes], self.velocity[: self.axes]


class Escort(Node):
    """The law of a scenario as a node."""

    def __init__(self):
        """Read the parameters, and listen."""
        super().__init__("escort")
        scenario = self.declare_parameter("scenario", "fifty_hertz").value
        self.forces = self.declare_parameter("command", "twist").value == "wrench"
        self.controller = Controller(scenario)
        self.target = Body(self.now, self.controller.axes)
        self.robots = [Body(self.now, self.controller.axes) for _ in range(self.controller.count)]
        self.create_subscription(Odometry, "/target/odom", self.target.hear, 10)
        kind, topic = (Wrench, "wrench") if self.forces else (Twist, "cmd_vel")
        self.commands = []
        for number, robot in enumerate(self.robots, 1):
            self.create_subscription(Odometry, f"/robot_{number}/odom", robot.hear, 10)
            self.commands.append(self.create_publisher(kind, f"/robot_{number}/{topic}", 10))
        self.under_way = None  # not known yet
        self.create_timer(self.controller.timestep, self.control)

    def now(self):
        """Time of the node's clock [s]."""
        return self.get_clock().now().nanoseconds * 1e-9

    def control(self):
        """Evaluate the law once, or stop the robots."""
        time = self.now()
        q, v = np.array([robot.state for robot in self.robots]).swapaxes(0, 1)
        target = self.target.state if time - self.target.heard <= OLDEST else None
        try:
            if max(time - robot.heard for robot in self.robots) > OLDEST:
                raise EscortError("odometry is missing")
            if not self.under_way:  # from where the robots are now
                self.controller.reset(q, None if target is None else target[0])
            found = self.controller(time, q, v, target)
            self.under_way = True
        except EscortError as error:
            if self.under_way is not False:  # once, not in every period
                self.get_logger().warning(f"robots stop: {error}")
            self.stop()
            return
        self.publish(found if self.forces else self.controller.velocity)

    def stop(self):
        """Stop the robots: velocity 0, or forces that take most of the last speeds in `BRAKING_TIME`."""
        self.under_way = False
        v, limit = np.array([robot.state[1] for robot in self.robots]), self.controller.force_limit[:, None]
        braking = np.clip(-self.controller.mass[:, None] * v / BRAKING_TIME, -limit, limit)
        self.publish(braking if self.forces else np.zeros_like(v))

    def publish(self, vectors):
        """Send every robot its vector, turned into the robot's own axes."""
        for robot, command, vector in zip(self.robots, self.commands, vectors, strict=True):
            x, y, z = robot.turn.T @ np.pad(vector, (0, 3 - len(vector)))
            message = Wrench() if self.forces else Twist()
            part = message.force if self.forces else message.linear
            part.x, part.y, part.z = float(x), float(y), float(z)
            command.publish(message)


def main():
    """Spin the node until it is interrupted."""
    rclpy.init()
    node = Escort()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.stop()
        node.destroy_node()


if __name__ == "__main__":
    main()
