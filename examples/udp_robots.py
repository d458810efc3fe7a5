"""Close the loop over UDP: a process of its own plays the robots, the controller answers their messages.

    python examples/udp_robots.py [SCENARIO] [--seconds 10] [--log flight.csv]

Both messages are little-endian numbers without padding, for n robots in p axes, SI units, world frame:

    state    uint32 number of the message, float64 time of the robots' clock,
             n p float64 positions (robot 1 x, y, ..., robot 2 x, y, ...), n p float64 velocities
    command  uint32 number of the state that it answers, n p float64 forces

The robots send their state once in a timestep. Robots that have got no command for 100 ms brake. The
controller stops them where messages are missing for 100 ms, or say what cannot be (`LIMITS`); it starts again
when all are at rest. The log is a CSV file for `escort-mj judge`.
"""

import argparse
import csv
import json
import socket
import struct
import subprocess
import sys
import time

import numpy as np

BRAKE_AFTER = 0.1  # s without a command
LIMITS = {"speed": 5.0, "jump": 0.5}  # m/s, m
REST = 0.05  # speed of robots that have stopped [m/s]
BRAKING_TIME = 0.2  # s in which braking takes most of the speed
HEAD = struct.Struct("<Id")
ANSWER = struct.Struct("<I")


class Robots:
    """Point masses with a clock and a watchdog of their own; all that they know of the controller is UDP."""

    def __init__(self, positions, mass, force_limit, timestep):
        """Place the robots, shape (n, p) [m], with their masses [kg] and largest forces [N], shape (n,)."""
        self.q = np.array(positions, dtype=float)
        self.v = np.zeros_like(self.q)
        self.mass, self.limit = np.array(mass)[:, None], np.array(force_limit)[:, None]
        self.timestep, self.time, self.heard, self.brakes = timestep, 0.0, 0.0, 0
        self.force = np.zeros_like(self.q)

    def command(self, force):
        """Take the forces that motors are to give, shape (n, p) [N]."""
        self.force, self.heard = force, self.time

    def step(self):
        """Move on by a timestep; without a command for too long, brake."""
        if self.time - self.heard > BRAKE_AFTER:
            self.force = -self.mass * self.v / BRAKING_TIME
            self.brakes += 1
        self.v = self.v + self.timestep * np.clip(self.force, -self.limit, self.limit) / self.mass
        self.q = self.q + self.timestep * self.v
        self.time += self.timestep


def play(port, seconds, **team):
    """Play the robots in real time, and print what came of it as JSON."""
    robots, number, waited, missed = Robots(**team), 0, [], 0
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect(("127.0.0.1", port))
    start = None
    while robots.time < seconds:
        sent = time.perf_counter()
        link.send(HEAD.pack(number, robots.time) + robots.q.tobytes() + robots.v.tobytes())
        deadline = (sent if start is None else start + robots.time) + robots.timestep
        answered = False
        while (left := deadline - time.perf_counter()) > 0.0:
            link.settimeout(left)
            try:
                message = link.recv(65536)
            except (TimeoutError, ConnectionError):
                continue
            if len(message) == ANSWER.size + robots.q.nbytes:
                answered = ANSWER.unpack_from(message)[0] == number
            if answered:
                waited.append(time.perf_counter() - sent)
                robots.command(np.frombuffer(message, offset=ANSWER.size).reshape(robots.q.shape))
                time.sleep(max(deadline - time.perf_counter(), 0.0))
        number += 1
        if start is None:  # the clock starts when somebody answers
            start = time.perf_counter() if answered else None
            continue
        missed += not answered
        robots.step()
    milliseconds = 1e3 * np.array(waited)
    found = {"messages": number, "missed": missed, "steps_braking": robots.brakes}
    found |= {
        f"latency_{name}_ms": float(f(milliseconds)) for name, f in (("median", np.median), ("max", np.max))
    }
    print(json.dumps(found))


class Log:
    """What was measured, as a CSV file: one row per sample, SI units, world frame."""

    def __init__(self, path, controller):
        """Begin a log; None for no file."""
        axes = ["x", "y", "z", *(f"x{k}" for k in range(4, 10))][: controller.axes]
        robots = [f"robot_{number}" for number in range(1, controller.count + 1)]
        self.file = open(path, "w", newline="") if path else None
        self.due, self.period = 0.0, 1.0 / controller.scenario.recording.rate
        self.write = csv.writer(self.file).writerow if self.file else None
        if self.write:
            places = [f"{robot}.{axis}" for robot in robots for axis in axes]
            speeds = [f"{robot}.v{axis}" for robot in robots for axis in axes]
            forces = [f"{robot}.f{axis}" for robot in robots for axis in axes]
            self.write(["time", *places, *speeds, *forces, *(f"target.{axis}" for axis in axes)])

    def note(self, now, q, v, force, controller):
        """Write a row if one is due."""
        if self.write and now >= self.due - 1e-9:
            self.due += self.period
            target = controller.signals["target_position"]
            self.write([f"{x:.9g}" for x in (now, *q.flat, *v.flat, *force.flat, *target)])


def fly(scenario="fifty_hertz", seconds=10.0, log=None):
    """Start the robots' process and control them until it ends; returns its statistics."""
    from escort_mj import Controller, EscortError, Limits

    controller = Controller(scenario, limits=Limits(silence=BRAKE_AFTER, **LIMITS))
    still = 0.0 * controller.start
    controller(0.0, controller.start, still)  # whatever takes long the first time is done now
    controller.reset()
    told = 0
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", 0))
    link.settimeout(0.2)
    team = {
        "positions": controller.start.tolist(),
        "mass": controller.mass.tolist(),
        "force_limit": controller.force_limit.tolist(),
        "timestep": controller.timestep,
    }
    play_them = [sys.executable, __file__, "--play", json.dumps({"port": link.getsockname()[1], **team})]
    rows, numbers = Log(log, controller), controller.start.size
    with subprocess.Popen(
        [*play_them, "--seconds", str(seconds)], stdout=subprocess.PIPE, text=True
    ) as robots:
        while robots.poll() is None:
            try:
                message, robots_address = link.recvfrom(65536)
            except TimeoutError:
                continue
            if len(message) != HEAD.size + 16 * numbers:
                continue  # no state of these robots
            number, now = HEAD.unpack_from(message)
            q, v = np.frombuffer(message, offset=HEAD.size).reshape(2, *controller.start.shape)
            try:
                force = controller(now, q, v)
            except EscortError as error:
                controller.stop(str(error))
                force = controller.command(now)
            for event in controller.events[told:]:
                print(event, file=sys.stderr)
            told = len(controller.events)
            if controller.stopped and np.abs(v).max() < REST:
                controller.reset(q)
            link.sendto(ANSWER.pack(number) + force.tobytes(), robots_address)
            rows.note(now, q, v, force, controller)
        statistics = json.loads(robots.stdout.read())
    link.close()
    if rows.file:
        rows.file.close()
    return statistics | {"last_radii": np.linalg.norm(q - controller.signals["target_position"], axis=1)}


def main():
    """Read the command line."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenario", nargs="?", default="fifty_hertz")
    options.add_argument("--seconds", type=float, default=10.0)
    options.add_argument("--log", help="a CSV file for escort-mj judge")
    options.add_argument("--play", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.play:
        play(seconds=given.seconds, **json.loads(given.play))
        return
    for name, value in fly(given.scenario, given.seconds, given.log).items():
        print(f"{name}: {value}")


if __name__ == "__main__":
    main()
