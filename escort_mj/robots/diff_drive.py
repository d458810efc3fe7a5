"""Two driven wheels on one axle: parameters, body and motors of a differential drive."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Literal
from xml.etree.ElementTree import Element

from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.parameters import Radius
from escort_mj.mjcf import set_attributes
from escort_mj.robots.drive import FORCE, DriveModel, Input
from escort_mj.robots.kind import FREE_COORDINATES, Motor, RobotKind

GRAVITY = 9.81  # m/s^2, of the weight that motors are made for
SIDES = {"left": 1.0, "right": -1.0}
CHASSIS, DECK = 0.6, 0.16  # radius and half height of the chassis, of the track
CASTER, CASTER_PLACE = 0.08, 0.45  # radius of a caster and its distance from the axle, of the track
TIRE_WIDTH = 0.05  # half width of a wheel, of the track


class DiffDrive(RobotKind):
    """A differential drive with two torque-driven wheels, two casters and friction on the floor (`axes: 2`).

    The law acts at the hand point ahead of the axle, where the sum of the wheels' forces acts along the robot
    and their moment acts across it. The hull is a sphere with the robot's radius about the hand point; it
    contains the robot.
    """

    part: ClassVar[str] = "diff_drive"
    opacity: ClassVar[float] = 0.1
    painted: ClassVar[tuple[str, ...]] = ("chassis",)
    most_axes: ClassVar[int] = 2
    rolls: ClassVar[bool] = True
    needs_gravity: ClassVar[bool] = True
    driven: ClassVar[bool] = True
    has_heading: ClassVar[bool] = True

    kind: Literal["diff_drive"] = "diff_drive"
    track: Radius | None = None
    """Distance between the wheels [m]; null: 0.8 times the radius."""
    wheel_radius: Radius | None = None
    """Radius of the wheels [m]; null: 0.165 times the radius."""
    hand_point: Radius | None = None
    """Distance from the axle forward to the point that the law controls [m]; null: 0.4 times the radius."""
    wheel_share: Annotated[float, Field(gt=0, le=0.4)] = 0.03
    """Mass of each wheel, a uniform disc, as a share of the robot's mass [1]."""
    rotor_inertia: NonNegativeFloat = 0.0
    """Moment of inertia of each motor and its gears, reflected to the wheel [kg m^2]."""
    inertia: PositiveFloat | None = None
    """Moment of inertia of the chassis about its vertical axis [kg m^2]; null: that of a uniform disc with
    the chassis's mass and radius."""
    torque_limit: PositiveFloat | None = None
    """Largest torque on each wheel [N m]; null: 0.25 times the robot's weight (at 9.81 m/s^2) times the
    wheel's radius."""
    heading: Annotated[float, Field(ge=-7, le=7)] = 0.0
    """Direction of the robot at the start, counterclockwise from the x axis [rad]."""

    def misfits(self, radius: float) -> Iterator[str]:
        """Yield a body that reaches out of the hull, wheels that reach the casters, and their mass."""
        track, wheel, ahead = self._sizes(radius)
        if (reach := ahead + CHASSIS * track) > radius:
            where = f"{reach:g} m from its hand point in a hull of radius {radius:g} m"
            yield (
                f"found a body that reaches {where}; "
                f"expected hand_point + {CHASSIS:g} track to be at most that"
            )
        if wheel > CASTER_PLACE * track:
            yield (
                f"found wheels of radius {wheel:g} m at a track of {track:g} m; expected at most "
                f"{CASTER_PLACE:g} of the track"
            )

    def coordinates(self, axes: int) -> int:
        """Return those of a free body, and the angles of the wheels."""
        return FREE_COORDINATES + len(SIDES)

    def motors(self, axes: int) -> int:
        """Return the number of driven wheels."""
        return len(SIDES)

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Give chassis, casters and wheels their sizes and places."""
        track, wheel, ahead = self._sizes(radius)
        axle, ball = wheel - radius, CASTER * track  # the axle's height, from the hand point
        deck = axle + DECK * track
        set_attributes(parts["robot"], euler=[0.0, 0.0, self.heading])
        set_attributes(parts["chassis"], size=[CHASSIS * track, DECK * track], pos=[-ahead, 0.0, deck])
        set_attributes(parts["nose"], size=0.04 * radius, fromto=[-ahead, 0.0, deck, 0.0, 0.0, deck])
        for name, side in {"caster_front": 1.0, "caster_rear": -1.0}.items():
            place = [side * CASTER_PLACE * track - ahead, 0.0, ball - radius]
            set_attributes(parts[name], size=ball, pos=place)
        for name, side in SIDES.items():
            set_attributes(parts[name], pos=[-ahead, 0.5 * side * track, axle])
            set_attributes(parts[f"{name}_axle_{name}"], armature=self.rotor_inertia)
            set_attributes(parts[f"{name}_tire_{name}"], size=wheel)
            set_attributes(parts[f"{name}_wheel_{name}"], size=[wheel, TIRE_WIDTH * track])
            set_attributes(
                parts[f"{name}_spoke_{name}"], size=[0.75 * wheel, 0.15 * wheel, 1.1 * TIRE_WIDTH * track]
            )

    def weigh(self, parts: Mapping[str, Element], mass: float, radius: float) -> None:
        """Give the wheels their masses and the chassis the rest, at the height of the axle."""
        track, wheel, ahead = self._sizes(radius)
        each, upright = self.wheel_share * mass, self._upright(mass, track)
        set_attributes(
            parts["inertial"], pos=[-ahead, 0.0, wheel - radius], mass=mass - len(SIDES) * each,
            diaginertia=[0.55 * upright, 0.55 * upright, upright],
        )  # fmt: skip
        for name in SIDES:
            set_attributes(parts[f"{name}_wheel_{name}"], mass=each)

    def free_motors(self, mass: float, radius: float, gravity: Sequence[float]) -> tuple[Motor, ...]:
        """Return the motors of the wheels."""
        most = self._torque_limit(mass, radius)
        return tuple(Motor(name, limits=(-most, most)) for name in SIDES)

    def drive_model(self, mass: float, radius: float) -> DriveModel:
        """Return the torques that push and turn the robot as a force at the hand point would."""
        track, wheel, ahead = self._sizes(radius)
        most, each, inputs = self._torque_limit(mass, radius), self.wheel_share * mass, []
        for number, side in enumerate(SIDES.values()):
            along, across = 0.5 * wheel, -side * wheel * ahead / track
            effect = (1.0 / wheel, -0.5 * side * track / (wheel * ahead), 0.0)
            mix = (along, across, 0.0, 0.0, 0.0, 0.0)
            inputs.append(Input(float(number), 0.0, -most, most, 1.0, *mix, *effect))
        rolling = len(SIDES) * (0.5 * each + self.rotor_inertia / wheel**2)
        spin = self._upright(mass, track) + 0.25 * track**2 * (len(SIDES) * each + rolling)
        return DriveModel(
            mode=FORCE,
            found="wheels",
            point=(0.0, 0.0, 0.0),
            inputs=tuple(inputs),
            limits=(2.0 * most / wheel, most * track / (wheel * ahead), 0.0),
            effective_mass=(mass + rolling, spin / ahead**2, mass),
        )

    def start_rates(self, velocity: Sequence[float], radius: float) -> tuple[float, ...]:
        """Return those with which it rolls, and the hand point has its velocity."""
        track, wheel, ahead = self._sizes(radius)
        c, s = math.cos(self.heading), math.sin(self.heading)
        along, turn = c * velocity[0] + s * velocity[1], (c * velocity[1] - s * velocity[0]) / ahead
        return (
            0.0,
            0.0,
            0.0,
            turn,
            *((along - 0.5 * side * track * turn) / wheel for side in SIDES.values()),
        )

    def _sizes(self, radius: float) -> tuple[float, float, float]:
        """Return track, radius of the wheels and distance of the hand point [m]."""
        return (
            0.8 * radius if self.track is None else self.track,
            0.165 * radius if self.wheel_radius is None else self.wheel_radius,
            0.4 * radius if self.hand_point is None else self.hand_point,
        )

    def _upright(self, mass: float, track: float) -> float:
        """Return the chassis's moment of inertia about its vertical axis [kg m^2]."""
        chassis = mass - len(SIDES) * self.wheel_share * mass
        return 0.5 * chassis * (CHASSIS * track) ** 2 if self.inertia is None else self.inertia

    def _torque_limit(self, mass: float, radius: float) -> float:
        share = 0.25 * mass * GRAVITY * self._sizes(radius)[1]
        return share if self.torque_limit is None else self.torque_limit
