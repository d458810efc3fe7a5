"""Gains that fit a robot: by a closed rule from its mass, the delay and limit of its motors, and its sensors.

Kessler's damping optimum: with the sum T of all small delays between a measurement and the force, the loops
from the inside out (velocity, position, integral) are each half as fast as the next inner one, 1/(2 T),
1/(4 T), 1/(8 T). All ratios of the characteristic polynomial are then 2, and its poles have the damping
0.71: those of T s^4 + s^3 + a s^2 + a^2 s / 2 + a^3 / 8 with a = 1 / (2 T) are pairs at a (-1 +- i) / 2.
Noise, saturation and the paper's own rate can make a smaller, which only adds damping.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

MOST_RATE = 50.0  # the paper's k_d / m [1/s]: faster loops add force, but no accuracy
NOISE_SHARE = 0.075  # of the force limit, that noise may take as rms on an axis
SPEED_SHARE = 0.2  # of the mission's largest speed, as a velocity error that saturates no motor
SWITCHING_SHARE = 0.1  # of the force limit, for the switching term beside a PD part; likewise of the rate
ESTIMATE = 0.1  # m/s^2: the paper's estimate at the start, 0.1 N for 1 kg
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
    """

    mass: float
    delay: float
    force_limit: float = math.inf
    position_noise: float = 0.0
    velocity_noise: float = 0.0
    max_speed: float = math.inf
    swing: float = math.inf

    @property
    def force(self) -> float:
        """Force that its motors have [N]."""
        return min(self.force_limit, USUAL_ACCELERATION * self.mass)


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
        Rate(_quiet_rate(robot, LAWS_WITH_A_RULE[law].direct), "noise"),
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
    """Stiffness m a^2 / 2; a tenth of the damping m a, and what belongs to it, is the switching term's."""
    m, slope = robot.mass, 0.5 * a
    switched = SWITCHING_SHARE * m * a
    return {
        "slope": slope,
        "derivative_gain": m * a - switched,
        "proportional_gain": 0.5 * m * a**2 - slope * switched,
        "switching_gain": SWITCHING_SHARE * robot.force,
        "boundary_layer": SWITCHING_SHARE * robot.force / switched,
    }


def _apd_smc(robot: Robot, a: float) -> dict[str, float]:
    """The same, half of the stiffness by adaptation, which also integrates: mu slope = m a^3 / 8."""
    m, adaptation = robot.mass, 0.25 * robot.mass * a**2
    slope, switched = _integral(robot, a, 0.5 * a, adaptation), SWITCHING_SHARE * m * a
    proportional = 0.5 * m * a**2 - adaptation - slope * switched
    gains = {"slope": slope, "proportional_gain": proportional, "adaptation_rate": adaptation}
    return _pd_smc(robot, a) | gains | {"initial_estimate": ESTIMATE * m}


def _integral(robot: Robot, a: float, slope: float, adaptation: float) -> float:
    """Return a slope for which the integral part does not excite what hangs on the robot.

    The force of a law with damping m a and integral gain mu slope has at the frequency w the real part
    m a - mu slope / w^2 per velocity: where it is negative, a swing is driven. Half of m a is left for it.
    """
    return min(slope, 0.5 * robot.mass * a * robot.swing**2 / adaptation)


def _asmc(robot: Robot, a: float) -> dict[str, float]:
    """All of the damping by the switching term, whose stiffness is slope m a; the rest by adaptation."""
    adaptation = 0.25 * robot.mass * a**2
    return {
        "slope": _integral(robot, a, 0.25 * a, adaptation),
        "switching_gain": robot.force,
        "boundary_layer": robot.force / (robot.mass * a),
        "adaptation_rate": adaptation,
        "initial_estimate": ESTIMATE * robot.mass,
    }


def _pd(robot: Robot, a: float) -> dict[str, float]:
    """Stiffness m a^2 / 2 and damping m a."""
    gains = {"derivative_gain": robot.mass * a, "proportional_gain": 0.5 * robot.mass * a**2}
    return gains | {"slope": 0.5 * a}


def _computed_torque(robot: Robot, a: float) -> dict[str, float]:
    """The same per mass."""
    return {"velocity_gain": a, "position_gain": 0.5 * a**2, "slope": 0.5 * a}


class Rule(NamedTuple):
    """The rule of one law.

    Attributes:
        gains: Values of its keys for a robot and a rate.
        direct: Gain of a measured position in the force, over m a^2, without adaptation.
    """

    gains: Callable[[Robot, float], dict[str, float]]
    direct: float


LAWS_WITH_A_RULE = {
    "apd_smc": Rule(_apd_smc, 0.25),
    "pd_smc": Rule(_pd_smc, 0.5),
    "asmc": Rule(_asmc, 0.25),
    "pd": Rule(_pd, 0.5),
    "computed_torque": Rule(_computed_torque, 0.5),
}
