"""A ROS 2 node that escorts: odometry in, velocities or forces out. It needs ROS 2 (rclpy) and escort_mj.

    python examples/ros2_node.py --ros-args -p scenario:=fifty_hertz -p command:=twist

    in    /robot_1/odom ...     nav_msgs/Odometry, poses in the frame of the scenario
          /target/odom          likewise; without it, the target is where the scenario has it
    out   /robot_1/cmd_vel ...  geometry_msgs/Twist, in the robot's own axes (command:=twist), or
          /robot_1/wrench ...   geometry_msgs/Wrench, likewise (command:=wrench)

The node waits until it has heard of every robot. A robot of which the odometry is older than 100 ms is told
to stop, and the others close ranks; it comes back when its odometry does. All robots are told to stop, until
the node is started again, where one is too fast, jumps, or leaves the area, and where the node itself is
late. Set `LIMITS` to your robots and your hall. Time stamps of the odometry have to be on the node's clock.
"""

import numpy as np

try:
    import rclpy
    from geometry_msgs.msg import Twist, Wrench
    from nav_msgs.msg import Odometry
    from rclpy.node import Node
except ImportError as error:
    raise SystemExit(f"{error}; source the setup of ROS 2 first, such as /opt/ros/jazzy/setup.bash") from None

from escort_mj import Area, Controller, EscortError, Limits

OLDEST = 0.1  # s
LIMITS = {"age": OLDEST, "silence": OLDEST, "speed": 3.0, "jump": 0.5}
FARTHEST = 50.0  # of robots from the origin [m]


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
        place, speed, stamp = message.pose.pose.position, message.twist.twist.linear, message.header.stamp
        self.turn = turn(message.pose.pose.orientation)
        self.position = np.array([place.x, place.y, place.z])
        self.velocity = self.turn @ [speed.x, speed.y, speed.z]
        measured = stamp.sec + 1e-9 * stamp.nanosec
        self.heard = measured if measured > 0.0 else self.clock()  # some drivers leave it 0

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
        axes = Controller(scenario).axes
        area = Area.sphere(np.zeros(axes), FARTHEST)
        self.controller = Controller(scenario, limits=Limits(**LIMITS, area=area))
        self.target = Body(self.now, self.controller.axes)
        self.robots = [Body(self.now, self.controller.axes) for _ in range(self.controller.count)]
        self.create_subscription(Odometry, "/target/odom", self.target.hear, 10)
        kind, topic = (Wrench, "wrench") if self.forces else (Twist, "cmd_vel")
        self.commands = []
        for number, robot in enumerate(self.robots, 1):
            self.create_subscription(Odometry, f"/robot_{number}/odom", robot.hear, 10)
            self.commands.append(self.create_publisher(kind, f"/robot_{number}/{topic}", 10))
        self.started, self.told = False, 0
        self.create_timer(self.controller.timestep, self.control)

    def now(self):
        """Time of the node's clock [s]."""
        return self.get_clock().now().nanoseconds * 1e-9

    def control(self):
        """Evaluate the law once; what limits have done is logged."""
        time, controller = self.now(), self.controller
        heard = np.array([robot.heard for robot in self.robots])
        q, v = np.array([robot.state for robot in self.robots]).swapaxes(0, 1)
        target = self.target.state if time - self.target.heard <= OLDEST else None
        try:
            if not self.started:
                if np.isinf(heard).any():
                    return  # robots do not move yet
                controller.reset(q, None if target is None else target[0])  # from where they are now
                self.started = True
            force = controller(time, q, v, target, times=heard)
        except EscortError as error:
            controller.stop(str(error))
            force = controller.command(time)
        self.log()
        self.publish(force if self.forces else controller.velocity)

    def log(self):
        """Log the events of the limits that are new."""
        for event in self.controller.events[self.told :]:
            self.get_logger().warning(str(event))
        self.told = len(self.controller.events)

    def stop(self):
        """Stop the robots: the node ends."""
        self.controller.stop("the node ends")
        force = self.controller.command(self.now())
        self.log()
        self.publish(force if self.forces else self.controller.velocity)

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
