"""A vessel with two stern thrusters: its parameters, its body and what the water does to it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Literal
from xml.etree.ElementTree import Element

from pydantic import Field, PositiveFloat

from escort_mj.components.parameters import Radius
from escort_mj.mjcf import set_attributes
from escort_mj.robots.drive import FORCE, DriveModel, Input
from escort_mj.robots.hydrodynamics import FREEDOMS, Vessel
from escort_mj.robots.kind import Motor, RobotKind

GRAVITY = 9.81  # m/s^2, of the weight that thrusters are made for
MODEL_MASS, MODEL_LENGTH = 23.8, 1.255  # of CyberShip II [kg, m]
MODEL_CENTER = 0.046  # of gravity, ahead of midship [m]
MODEL_INERTIA = 1.76 - MODEL_MASS * MODEL_CENTER**2  # [kg m^2]; given as 1.76 about midship
MODEL_ADDED = (2.0, 10.0, 1.0, 0.0)  # in surge, sway, yaw, and of sway with yaw [kg, kg, kg m^2, kg m]
# Of CyberShip II: Skjetne, Smogeli and Fossen, "A nonlinear ship manoeuvering model: identification and
# adaptive control with experiments for a model ship", Modeling, Identification and Control 25(1), 2004,
# tables 2 and 4. The whole sway force by yaw is left out: Y_r = -7.250 kg m/s, Y_|v|r = -0.845 kg and
# Y_|r|r = -3.450 kg m. With Y_r, D is not positive definite at rest; the other two were fitted with it.
MODEL_SURGE = (0.72253, 1.32742, 5.86643)
MODEL_SWAY = (0.88965, 36.47287, 0.805, 0.0, 0.0, 0.0)
MODEL_YAW = (-0.0313, -3.95645, -0.130, 1.900, -0.080, 0.750)
# Dimensions of these: powers of length and time, beside one of mass.
SURGE_DIMENSIONS = ((0, -1), (-1, 0), (-2, 1))
SWAY_DIMENSIONS = ((0, -1), (-1, 0), (0, 0), (1, -1), (0, 0), (1, 0))
YAW_DIMENSIONS = ((1, -1), (0, 0), (1, 0), (2, -1), (1, 0), (2, 0))
ADDED_DIMENSIONS = ((0, 0), (0, 0), (2, 0), (1, 0))
BEAM, DRAFT, REACH = 0.16, 0.06, 0.52  # half beam, half height and stern behind midship, of the length
THRUSTERS = {"left": 1.0, "right": -1.0}

Coefficient = Annotated[float, Field(ge=-1e12, le=1e12)]


class SurfaceVessel(RobotKind):
    """A vessel with two stern thrusters (`axes: 2`). The water's added mass and damping follow Fossen.

    The law acts at the hand point ahead of midship, where the sum of the thrusts acts along the vessel and
    their moment acts across it. The hull is a sphere with the robot's radius about the hand point; it
    contains the vessel. Null values of inertia, added mass and damping are those of the model ship CyberShip
    II (1.255 m, 23.8 kg), scaled to the vessel's length and mass by Froude's law, without its sway force due
    to yaw. u and v are the velocities in surge and sway, and r is the yaw rate.
    """

    part: ClassVar[str] = "surface_vessel"
    opacity: ClassVar[float] = 0.1
    painted: ClassVar[tuple[str, ...]] = ("midship", "bow")
    most_axes: ClassVar[int] = 2
    has_heading: ClassVar[bool] = True
    driven: ClassVar[bool] = True
    passes_floor: ClassVar[bool] = True

    kind: Literal["surface_vessel"] = "surface_vessel"
    length: Radius | None = None
    """Length of the vessel [m]; null: 1.05 times the radius."""
    hand_point: Radius | None = None
    """Distance from midship forward to the point that the law controls [m]; null: 0.4 times the length."""
    center_of_gravity: Annotated[float, Field(ge=-1e5, le=1e5)] | None = None
    """Distance from midship forward to the center of gravity [m]; null: 0.037 times the length."""
    inertia: PositiveFloat | None = None
    """Moment of inertia about the vertical axis through the center of gravity, without added mass [kg m^2].
    """
    added_mass: Annotated[tuple[Coefficient, ...], Field(min_length=4, max_length=4)] | None = None
    """Added mass: in surge and in sway [kg], in yaw [kg m^2], and between sway and yaw [kg m], at midship."""
    surge_damping: Annotated[tuple[Coefficient, ...], Field(min_length=3, max_length=3)] | None = None
    """Resistance in surge: coefficients of u, abs(u) u and u^3 [kg/s, kg/m, kg s/m^2]."""
    sway_damping: Annotated[tuple[Coefficient, ...], Field(min_length=6, max_length=6)] | None = None
    """Resistance in sway: coefficients of v, abs(v) v, abs(r) v, r, abs(v) r and abs(r) r, at midship."""
    yaw_damping: Annotated[tuple[Coefficient, ...], Field(min_length=6, max_length=6)] | None = None
    """Resisting moment in yaw: coefficients of v, abs(v) v, abs(r) v, r, abs(v) r and abs(r) r, at midship.
    """
    thruster_spacing: Radius | None = None
    """Distance between the thrusters [m]; null: 0.3 times the length."""
    thrust_limit: PositiveFloat | None = None
    """Largest thrust of each thruster, ahead and astern [N]; null: 0.05 times the vessel's weight."""
    heading: Annotated[float, Field(ge=-7, le=7)] = 0.0
    """Direction of the vessel at the start, counterclockwise from the x axis [rad]."""

    def misfits(self, radius: float) -> Iterator[str]:
        """Yield a vessel that reaches out of the hull, and a hand point that is its center of gravity."""
        length, ahead = self._length(radius), self._hand_point(radius)
        reach = math.hypot(ahead + REACH * length, BEAM * length)
        if reach > radius:
            yield (
                f"found a stern {reach:g} m from the hand point in a hull of radius {radius:g} m; expected "
                "it inside: a larger radius, or a smaller length or hand_point"
            )
        if self.added_mass is not None:
            surge, sway, yaw, cross = self.added_mass
            if min(surge, sway, yaw) < 0.0 or cross**2 > sway * yaw:
                found = f"found the added mass {list(self.added_mass)}"
                yield f"{found}, which is not positive definite; no water has such"
        if self._center(radius) >= ahead:
            yield (
                f"found a hand point {ahead:g} m ahead of midship, and the center of gravity at "
                f"{self._center(radius):g} m; expected the hand point ahead of it"
            )

    def coordinates(self, axes: int) -> int:
        """Return its place and heading."""
        return FREEDOMS

    def motors(self, axes: int) -> int:
        """Return the number of its thrusters."""
        return len(THRUSTERS)

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Give hull, bow, bridge and thrusters their sizes and places."""
        length, ahead = self._length(radius), self._hand_point(radius)
        beam, half, deep = BEAM * length, 0.5 * DRAFT * length, DRAFT * length - radius
        set_attributes(parts["robot"], euler=[0.0, 0.0, self.heading])
        c, s = math.cos(self.heading), math.sin(self.heading)
        set_attributes(parts["x"], axis=[c, -s, 0.0])  # the world's, in the turned frame of the body
        set_attributes(parts["y"], axis=[s, c, 0.0])
        set_attributes(parts["heading"], ref=self.heading)
        set_attributes(
            parts["midship"], size=[0.35 * length, beam, half], pos=[-ahead - 0.15 * length, 0.0, deep]
        )
        set_attributes(parts["bow"], size=[0.3 * length, beam, half], pos=[-ahead + 0.2 * length, 0.0, deep])
        set_attributes(
            parts["bridge"], size=[0.07 * length, 0.6 * beam, half], pos=[-ahead, 0.0, deep + 2.0 * half]
        )
        for name, side in THRUSTERS.items():
            place = [-ahead - 0.5 * length, 0.5 * side * self._spacing(radius), deep - 0.5 * half]
            set_attributes(parts[name], pos=place)
            set_attributes(parts[f"pod_{name}"], pos=place, size=[0.3 * half, 0.02 * length])

    def weigh(self, parts: Mapping[str, Element], mass: float, radius: float) -> None:
        """Give the vessel its mass and its moment of inertia, without water."""
        center = self._center(radius)
        upright = self._inertia(mass, radius)
        place = [center - self._hand_point(radius), 0.0, DRAFT * self._length(radius) - radius]
        set_attributes(
            parts["inertial"], pos=place, mass=mass, diaginertia=[0.55 * upright, 0.55 * upright, upright]
        )

    def free_motors(self, mass: float, radius: float, gravity: Sequence[float]) -> tuple[Motor, ...]:
        """Return the thrusters."""
        most = self._thrust_limit(mass)
        return tuple(Motor(name, limits=(-most, most)) for name in THRUSTERS)

    def drive_model(self, mass: float, radius: float) -> DriveModel:
        """Return the thrusts that push the vessel ahead, and turn it as a force at the hand point would."""
        lever, most = self._hand_point(radius) / self._spacing(radius), self._thrust_limit(mass)
        inputs = [
            Input(
                float(number), 0.0, -most, most, 1.0,
                0.5, -side * lever, 0.0, 0.0, 0.0, 0.0,
                1.0, -0.5 * side / lever, 0.0,
            )
            for number, side in enumerate(THRUSTERS.values())
        ]  # fmt: skip
        water = self.vessel(mass, radius)
        turning = water.inertia - water.coupling**2 / water.sway_mass  # about the center of vessel and water
        across = turning * water.sway_mass / (-water.coupling * self._hand_point(radius))
        return DriveModel(
            mode=FORCE,
            found="force",
            point=(0.0, 0.0, 0.0),
            inputs=tuple(inputs),
            limits=(2.0 * most, most / lever, 0.0),
            effective_mass=(water.surge_mass, across, mass),
        )

    def start_rates(self, velocity: Sequence[float], radius: float) -> tuple[float, ...]:
        """Return the rate of turn with which midship does not sway, and the hand point has its velocity."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        return ((c * velocity[1] - s * velocity[0]) / self._hand_point(radius),)

    def vessel(self, mass: float, radius: float) -> Vessel:
        """Return what the water does to it, with mass and added mass at its hand point."""
        length, ahead, center = self._length(radius), self._hand_point(radius), self._center(radius)
        added = self.added_mass or _scaled(MODEL_ADDED, ADDED_DIMENSIONS, mass, length)
        surge, sway = mass + added[0], mass + added[1]
        cross = mass * center + added[3]
        turning = self._inertia(mass, radius) + mass * center**2 + added[2]
        return Vessel(
            surge,
            sway,
            cross - ahead * sway,
            turning - 2.0 * ahead * cross + ahead**2 * sway,
            added[0],
            added[1],
            added[3] - ahead * added[1],
            ahead,
            *(self.surge_damping or _scaled(MODEL_SURGE, SURGE_DIMENSIONS, mass, length)),
            *(self.sway_damping or _scaled(MODEL_SWAY, SWAY_DIMENSIONS, mass, length)),
            *(self.yaw_damping or _scaled(MODEL_YAW, YAW_DIMENSIONS, mass, length)),
        )

    def _thrust_limit(self, mass: float) -> float:
        return 0.05 * mass * GRAVITY if self.thrust_limit is None else self.thrust_limit

    def _length(self, radius: float) -> float:
        return 1.05 * radius if self.length is None else self.length

    def _hand_point(self, radius: float) -> float:
        return 0.4 * self._length(radius) if self.hand_point is None else self.hand_point

    def _spacing(self, radius: float) -> float:
        return 0.3 * self._length(radius) if self.thruster_spacing is None else self.thruster_spacing

    def _center(self, radius: float) -> float:
        scaled = MODEL_CENTER / MODEL_LENGTH * self._length(radius)
        return scaled if self.center_of_gravity is None else self.center_of_gravity

    def _inertia(self, mass: float, radius: float) -> float:
        (scaled,) = _scaled((MODEL_INERTIA,), ((2, 0),), mass, self._length(radius))
        return scaled if self.inertia is None else self.inertia


def _scaled(
    values: Sequence[float], dimensions: Sequence[tuple[int, int]], mass: float, length: float
) -> tuple[float, ...]:
    """Return coefficients of CyberShip II for another mass and length; times scale as sqrt(length)."""
    share, times = mass / MODEL_MASS, length / MODEL_LENGTH
    return tuple(
        value * share * times ** (of_length + 0.5 * of_time)
        for value, (of_length, of_time) in zip(values, dimensions, strict=True)
    )
