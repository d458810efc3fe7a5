"""Gains that fit a robot: by a closed rule from its mass, the delay and limit of its motors, and its sensors.

With the sum T of all small delays between a measurement and the force, the velocity loop has the rate
a = 1 / (2 T), Kessler's magnitude optimum. The position loop has the rate b a and the integral b a / 2; with
apd_smc, the characteristic polynomial is T s^4 + s^3 + a s^2 + b a^2 s + b^2 a^3 / 2. With b = 1/2, each loop
is half as fast as the next inner one and all poles are pairs at a (-1 +- i) / 2: Kessler's damping optimum.
It resists changing forces best, but apd_smc then overshoots a step of velocity by 57 %. Where no such forces
act, b = 0.15 overshoots by 20 %. Noise, saturation and the paper's own rate can make a smaller, which only
adds damping.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

MOST_RATE = 50.0  # the paper's k_d / m [1/s]: faster loops add force, but no accuracy
NOISE_SHARE = 0.075  # of the force limit, that noise may take as rms on an axis
SPEED_SHARE = 0.2  # of the mission's largest speed, as a velocity error that saturates no motor
SWITCHING_SHARE = 0.1  # of the force limit, for the switching term beside a PD part; likewise of the rate
DISTURBED, CALM = 0.5, 0.15  # b: rate of the position loop over a
ESTIMATE = 0.002  # m/s: the paper's estimate at the start, 0.1 N, over its m a
USUAL_ACCELERATION = 10.0  # force per mass of motors without limit [m/s^2]


class Robot(NamedTuple):
    """What the rule asks of a robot.

    Attributes:
        mass: Effective mass that the force moves [kg].
        delay: Sum of all small delays from a measurement to the force [s].
        force_limit: Largest force per axis [N]; infinite for none.
        position_noise: Rms of the measured position, per axis [m].
        velocity_noise: Rms of the measured velocity, per axis [m/s].
        max_speed: Largest reference speed of the mission [m/s]; infinite for none.
        swing: Slowest frequency of what hangs on it, such as a load [rad/s]; infinite for nothing.
        disturbed: Whether changing forces act on it: a disturbance, friction, water, a load.
    """

    mass: float
    delay: float
    force_limit: float = math.inf
    position_noise: float = 0.0
    velocity_noise: float = 0.0
    max_speed: float = math.inf
    swing: float = math.inf
    disturbed: bool = False

    @property
    def force(self) -> float:
        """Force that its motors have [N]."""
        return min(self.force_limit, USUAL_ACCELERATION * self.mass)

    @property
    def position_share(self) -> float:
        """Rate of the position loop, of that of the velocity loop: b."""
        return DISTURBED if self.disturbed else CALM


class Rate(NamedTuple):
    """How fast the velocity loop may be.

    Attributes:
        value: Rate a [1/s].
        reason: What limits it: the drive, noise, saturation, or the paper's rate.
    """

    value: float
    reason: str


def rate_of(law: str, robot: Robot) -> Rate:
    """Return the rate of the velocity loop that a robot allows with a law, and what limits it."""
    rates = [
        Rate(1.0 / (2.0 * robot.delay), "the drive"),
        Rate(_quiet_rate(robot, LAWS_WITH_A_RULE[law].direct(robot.position_share)), "noise"),
        Rate(_unsaturated_rate(robot), "saturation"),
        Rate(MOST_RATE, "the paper's rate"),
    ]
    return min(rates, key=lambda rate: rate.value)


def _unsaturated_rate(robot: Robot) -> float:
    """Rate at which a share of the largest speed, as a velocity error, needs all of the force."""
    if math.isinf(robot.max_speed):
        return math.inf
    return robot.force_limit / (robot.mass * SPEED_SHARE * robot.max_speed)


def _quiet_rate(robot: Robot, direct: float) -> float:
    """Rate at which noise takes its share of the force: m a times that of velocity, and of position.

    Args:
        robot: What it is.
        direct: Gain of a measured position in the force, over m a^2.
    """
    most = NOISE_SHARE * robot.force / robot.mass
    straight, square = robot.velocity_noise**2, (direct * robot.position_noise) ** 2
    if square == 0.0:
        return most / robot.velocity_noise if robot.velocity_noise else math.inf
    return math.sqrt((math.sqrt(straight**2 + 4.0 * square * most**2) - straight) / (2.0 * square))


def gains_of(law: str, robot: Robot, rate: float) -> dict[str, float]:
    """Return the gains of a law for a rate of the velocity loop, three digits each.

    Args:
        law: One of `LAWS_WITH_A_RULE`.
        robot: What they are for.
        rate: a [1/s], see `rate_of`.
    """
    found = LAWS_WITH_A_RULE[law].gains(robot, rate)
    return {name: float(f"{value:.3g}") for name, value in found.items()}


def _pd_smc(robot: Robot, a: float) -> dict[str, float]:
    """Stiffness b m a^2; a tenth of the damping m a, and what belongs to it, is the switching term's."""
    m, slope = robot.mass, 0.5 * a
    switched = SWITCHING_SHARE * m * a
    return {
        "slope": slope,
        "derivative_gain": m * a - switched,
        "proportional_gain": robot.position_share * m * a**2 - slope * switched,
        "switching_gain": SWITCHING_SHARE * robot.force,
        "boundary_layer": SWITCHING_SHARE * robot.force / switched,
    }


def _apd_smc(robot: Robot, a: float) -> dict[str, float]:
    """The same, part of the stiffness by adaptation, which also integrates: mu slope = b^2 m a^3 / 2."""
    m, share = robot.mass, robot.position_share
    adaptation, switched = share**2 * m * a**2, SWITCHING_SHARE * m * a
    slope = _integral(robot, a, 0.5 * a, adaptation)
    proportional = share * m * a**2 - adaptation - slope * switched
    gains = {"slope": slope, "proportional_gain": proportional, "adaptation_rate": adaptation}
    return _pd_smc(robot, a) | gains | {"initial_estimate": ESTIMATE * m * a}


def _integral(robot: Robot, a: float, slope: float, adaptation: float) -> float:
    """Return a slope for which the integral part does not excite what hangs on the robot.

    The force of a law with damping m a and integral gain mu slope has at the frequency w the real part
    m a - mu slope / w^2 per velocity: where it is negative, a swing is driven. Half of m a is left for it.
    """
    return min(slope, 0.5 * robot.mass * a * robot.swing**2 / adaptation)


def _asmc(robot: Robot, a: float) -> dict[str, float]:
    """All of the damping by the switching term, whose stiffness is slope m a; the rest by adaptation."""
    half = 0.5 * robot.position_share
    adaptation = half * robot.mass * a**2
    return {
        "slope": _integral(robot, a, half * a, adaptation),
        "switching_gain": robot.force,
        "boundary_layer": robot.force / (robot.mass * a),
        "adaptation_rate": adaptation,
        "initial_estimate": ESTIMATE * robot.mass * a,
    }


def _pd(robot: Robot, a: float) -> dict[str, float]:
    """Stiffness b m a^2 and damping m a."""
    stiffness = robot.position_share * robot.mass * a**2
    return {"derivative_gain": robot.mass * a, "proportional_gain": stiffness, "slope": 0.5 * a}


def _computed_torque(robot: Robot, a: float) -> dict[str, float]:
    """The same per mass."""
    return {"velocity_gain": a, "position_gain": robot.position_share * a**2, "slope": 0.5 * a}


class Rule(NamedTuple):
    """The rule of one law.

    Attributes:
        gains: Values of its keys for a robot and a rate.
        direct: Gain of a measured position in the force, over m a^2, without adaptation, of b.
    """

    gains: Callable[[Robot, float], dict[str, float]]
    direct: Callable[[float], float]


LAWS_WITH_A_RULE = {
    "apd_smc": Rule(_apd_smc, lambda share: share - share**2),
    "pd_smc": Rule(_pd_smc, lambda share: share),
    "asmc": Rule(_asmc, lambda share: 0.5 * share),
    "pd": Rule(_pd, lambda share: share),
    "computed_torque": Rule(_computed_torque, lambda share: share),
}
