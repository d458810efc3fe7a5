"""What is found in a robot's MJCF: its drive, mass and limits, and how it answers a step of velocity."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import axis_names
from escort_mj.errors import OutsideError, RobotError, UsageError
from escort_mj.robots.drive import POSITION, RATE, THRUST
from escort_mj.robots.mjcf import LONGEST_NAME, Mjcf
from escort_mj.robots.modeled import RobotModel, known, known_now
from escort_mj.scenario.findings import listed, shortened, shown
from escort_mj.scenario.geometry.team_gains import proposal
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.reader.load import scenario_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]

DRIVES = ("force", "thrust", "steer", "wheels", "omni", "velocity")
STEP_TIME, SETTLING = 3.0, 24.0  # s at least, and in time constants of the drive or of the velocity loop
PAUSE = 1.0  # s before the step
SAMPLES = 400
NEAR, MOST_OVERSHOOT = 0.05, 0.3  # of the step
SHARE, MOST_STEP = 0.25, 0.5  # of what is within reach, and m/s


class Answer(NamedTuple):
    """How the controlled point answers a step of the reference velocity along one axis.

    Attributes:
        axis: Its name.
        step: The reference velocity [m/s].
        time: Shape (k,) [s], from the step on; before it negative.
        velocity: Along the axis, shape (k,) [m/s].
        across: Largest velocity along other axes [m/s].
    """

    axis: str
    step: float
    time: Array
    velocity: Array
    across: float

    @property
    def held(self) -> bool:
        """Whether it comes near the step, without going far beyond, and stays there."""
        return self.error < NEAR and self.overshoot < MOST_OVERSHOOT

    @property
    def words(self) -> str:
        """The numbers in words."""
        if not np.isfinite(self.velocity).all():
            return f"{self.axis}: step of {self.step:.3g} m/s, and the simulation diverges"
        rise = "never" if math.isinf(self.rise) else f"{self.rise:.2g} s"
        return (
            f"{self.axis}: step of {self.step:.3g} m/s, rise {rise}, overshoot {100 * self.overshoot:.0f} %, "
            f"error at the end {100 * self.error:.1f} %, across {self.across:.2g} m/s"
        )

    @property
    def numbers(self) -> dict[str, float | None]:
        """The same by their names."""
        return {
            "step": self.step,
            "rise": None if math.isinf(self.rise) else self.rise,
            "overshoot": self.overshoot,
            "error": self.error,
            "across": self.across,
        }

    @property
    def rise(self) -> float:
        """Time from a tenth to nine tenths of the step [s]; inf where it does not come there."""
        after = self.time >= 0.0
        share = self.velocity[after] / self.step
        if share.max() < 0.9:
            return math.inf
        first = [float(self.time[after][int(np.argmax(share >= part))]) for part in (0.1, 0.9)]
        return first[1] - first[0]

    @property
    def overshoot(self) -> float:
        """How far it goes beyond the step, of the step."""
        return float(max(self.velocity.max() / self.step - 1.0, 0.0))

    @property
    def error(self) -> float:
        """Largest error of the last tenth, of the step."""
        return float(np.abs(self.velocity[-len(self.velocity) // 10 :] / self.step - 1.0).max())


def checked_model(
    file: Path, body: str | None, drive: str | None, root: Path | None = None
) -> tuple[Mjcf, RobotModel]:
    """Return a robot as a scenario beside its file would have it.

    Args:
        file: The MJCF.
        body: Name of the base; None to find it.
        drive: Kind of drive; None to find it.
        root: What all files of it are in or below; None for the file's own folder.

    Raises:
        RobotError: If it cannot be read, or cannot be driven.
    """
    keys: dict[str, Any] = {"file": shortened(file.name or file), "body": body}
    keys |= {"drive": drive} if drive else {}
    if drive is not None and drive not in DRIVES:
        raise UsageError(f"--drive: found {drive}; allowed are {listed(DRIVES)}")
    if body is not None and not 0 < len(body) <= LONGEST_NAME:
        raise UsageError(f"--body: found {shown(body)}; expected the name of a body of {file.name}")
    folder = file.parent if root is None else root
    source = Mjcf.model_validate(keys).asked_for(file.absolute(), folder.absolute())
    try:
        model = known_now(source)
    except OutsideError as error:
        raise RobotError(f"{error}; --root names a folder that holds all of its files, such as ..") from None
    kind = Mjcf.model_validate(keys | {"file": str(file.absolute()), "sha256": model.digest})
    known(kind.source(1.0, 1.0), model)
    return kind, model


def answers(kind: Mjcf, model: RobotModel) -> Iterator[Answer]:
    """Fly a step of velocity along each axis."""
    axes = 3 if model.drive.lifts else 2
    limits, pushes = model.drive.limits, model.drive.pushes
    fitting = proposal(_mission(kind, model, axes, STEP_TIME))
    slowest = fitting.rate.value if fitting else model.drive.bandwidth
    duration = PAUSE + max(STEP_TIME, SETTLING / slowest)
    for axis, name in enumerate(axis_names(axes)):
        reach = limits[axis] / model.drive.effective_mass[axis] if pushes else limits[axis]
        step = min(MOST_STEP, SHARE * reach)
        plant = Plant(build(Mission(_mission(kind, model, axes, duration), outside="velocity")))
        timestep, found = plant.world.setup.timestep, []
        steps = max(round(duration / timestep / SAMPLES), 1)
        with native_loop(plant.world):
            for sample in range(math.ceil(duration / timestep / steps)):
                now = sample * steps * timestep
                plant.state.v_d[0] = 0.0
                plant.state.v_d[0, axis] = step if now >= PAUSE else 0.0
                plant.step(steps)
                found.append([now + steps * timestep - PAUSE, *plant.state.v[0]])
        rows = np.array(found)
        others = np.delete(rows[rows[:, 0] > 0.0, 1:], axis, axis=1)
        yield Answer(name, step, rows[:, 0], rows[:, 1 + axis], float(np.abs(others).max()))


def _mission(kind: Mjcf, model: RobotModel, axes: int, duration: float) -> Scenario:
    """A robot by itself, far from the target."""
    keys = {
        "axes": axes,
        "duration": duration,
        "target": {"position": [0.0] * axes, "radius": 0.1},
        "mission": {"radius": 50.0, "behaviors": ["surface"]},
        "robots": {
            "count": 1,
            "kind": kind.model_dump(exclude_defaults=True) | {"kind": kind.kind},
            "positions": [[20.0 + 10.0 * model.radius] + [0.0] * (axes - 1)],
        },
        "controller": {"law": "apd_smc"} | ({"gains": "auto"} if model.drive.pushes else {}),
    }
    return scenario_of(keys)


def model_page(kind: Mjcf, model: RobotModel) -> list[str]:
    """What is found in the file, in lines of a name and what it is."""
    drive = model.drive
    servo = {RATE: "velocity servos", POSITION: "position servos"}.get(drive.mode, "motors")
    unit = "N" if drive.pushes else "m/s"
    axes = axis_names(3 if drive.lifts else 2)
    used = [int(row.control) for row in drive.inputs]
    lines = [
        f"drive         {drive.found}: {len(used)} {servo}, of {model.actuators} actuators",
        f"base          {drive.base or model.root.get('name')}",
        f"the law moves a point at {_numbers(drive.point)} m of the base",
        f"mass          {model.mass:.4g} kg, moments of inertia {_numbers(model.inertia)} kg m^2",
        f"hull          {model.radius:.4g} m around that point",
        f"stands        {'on nothing: it flies, axes 2 or 3' if drive.lifts else 'on the floor: axes 2'}",
    ]
    if drive.mode == THRUST:
        hover = [row.trim + row.mix_1 * model.mass * 9.81 for row in drive.inputs]
        lines.append(f"hovers at     controls {_numbers(hover)}, within {_ranges(model)}")
        lines.append(
            f"heading       {'is kept' if drive.holds_attitude else 'is free: no torque of its own'}"
        )
    else:
        lines.append(f"controls      within {_ranges(model)}")
    reach = ", ".join(
        f"{axis} {limit:.3g} {unit}" if math.isfinite(limit) else f"{axis} unlimited"
        for axis, limit in zip(axes, drive.limits, strict=False)
    )
    lines.append(f"within reach  {reach}")
    masses = ", ".join(f"{each:.4g}" for each in drive.effective_mass[: len(axes)])
    lines.append(f"law moves     {masses} kg along {', '.join(axes)}")
    if drive.pushes:
        fitting = proposal(_mission(kind, model, len(axes), STEP_TIME))
        assert fitting is not None
        speed = "at once" if math.isinf(drive.bandwidth) else f"at {drive.bandwidth:.3g} rad/s"
        rate = f"{fitting.rate.value:.2g} /s, by {fitting.rate.reason}"
        lines.append(f"bandwidth     forces come {speed}; the law's k_d/m is best at {rate}")
        found = ", ".join(f"{key} {value:.3g}" for key, value in fitting.gains.items())
        lines.append(f"gains: auto   {found}")
    else:
        lines.append(
            f"bandwidth     of the servos {drive.bandwidth:.3g} rad/s; the law gives them references"
        )
    lines.append(f"medium        density {model.medium[0]:g} kg/m^3, viscosity {model.medium[1]:g} Pa s")
    lines.append(f"not taken     {', '.join(model.left) or 'nothing is left out'}")
    return lines


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{round(float(value), 9) + 0.0:.4g}" for value in values) + ")"


def _ranges(model: RobotModel) -> str:
    """The ranges of the driving controls, each once."""
    found = dict.fromkeys((row.low, row.high) for row in model.drive.inputs)
    return " and ".join(
        f"{low:g} to {high:g}" if abs(low) < 1e299 or abs(high) < 1e299 else "no range" for low, high in found
    )
