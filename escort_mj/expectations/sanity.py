"""Can the simulation itself be trusted? One function per check."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from escort_mj.expectations.expectation import Judgment, Windowed, not_judged, nothing_found
from escort_mj.measuring import EMPTY
from escort_mj.metrics.measure import Bodies
from escort_mj.metrics.simulation import fastest_points, tunneling
from escort_mj.metrics.tethers import stretches, tethers
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import Recorded, is_log
from escort_mj.record.window import window

Array = NDArray[np.float64]

MAY_BE_INFINITE = ("clearance", "target_clearance", "lidar_range", "watch_value")  # where nothing is near

SanityCheck = Literal["warnings", "finite", "energy", "tunneling"]
SANITY: tuple[SanityCheck, ...] = get_args(SanityCheck)


def _all_checks(value: Any) -> Any:
    """All checks for the word, a list as it is."""
    if isinstance(value, str) and value != "all":
        raise PydanticCustomError("choice", "{wanted}", {"wanted": f"all, or a list of {', '.join(SANITY)}"})
    return SANITY if value == "all" else value


class SanityExpectation(Windowed):
    """Checks of the simulation itself."""

    kind = "sanity"
    rank = 50

    sanity: Annotated[
        tuple[SanityCheck, ...],
        Field(min_length=1),
        BeforeValidator(_all_checks, json_schema_input_type=Literal["all"] | tuple[SanityCheck, ...]),
    ]
    """`all`, or a list of: `warnings` (no warnings from MuJoCo), `finite` (every number is finite), `energy`
    (robots gain no kinetic energy without a cause), `tunneling` (no step in which two bodies approach by
    more than the thickness of the thinnest body)."""

    def judge_run(self, trace: Recorded, outcome: Outcome) -> Judgment:
        """Whether the simulation can be trusted: all checks hold in the window."""
        if is_log(trace):
            return not_judged("these are checks of a simulation")
        part = window(trace, *self.window)
        if not part.sizes["time"]:
            return nothing_found(EMPTY)
        reports = [sanity(check, part, outcome) for check in self.sanity]
        wrong = [report for report in reports if not report.held]
        worst = min(wrong or reports, key=lambda report: report.room)
        words = "; ".join(report.words for report in wrong or reports)
        return Judgment(not wrong, words, worst.value, worst.unit, worst.time, worst.bodies, worst.margin)

    @property
    def reads_samples(self) -> bool:
        """Whether it checks the energy: forces and disturbance are read at samples."""
        return "energy" in self.sanity

    @property
    def demanded(self) -> str:
        """The checks by name."""
        return ", ".join(self.sanity)


@dataclass(frozen=True)
class Report:
    """What one check found.

    Attributes:
        held: Whether all is well.
        words: What was found.
        value: Worst value, where there is one.
        unit: Its unit.
        time: When it was found [s].
        bodies: Names of the bodies that had it.
        margin: Distance from the bound, negative beyond it.
        room: The margin as a share of the bound.
    """

    held: bool
    words: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    bodies: Bodies = ()
    margin: float | None = None
    room: float = math.inf


def sanity(check: SanityCheck, trace: Recorded, outcome: Outcome) -> Report:
    """Looks at one kind of trouble.

    Args:
        check: Which.
        trace: A trace, or a window of one, with a sample at least.
        outcome: How the run ended.
    """
    if check == "warnings":
        return _warnings(outcome)
    if check == "finite":
        return _finite(trace, outcome)
    return _energy(trace) if check == "energy" else _tunneling(trace)


def _warnings(outcome: Outcome) -> Report:
    """MuJoCo did not warn; a run that it warned in ends as unstable."""
    if outcome is Outcome.UNSTABLE:
        return Report(False, "MuJoCo warned")
    return Report(True, "no warning")


def _finite(trace: Recorded, outcome: Outcome) -> Report:
    """Every recorded number is one, and the run did not diverge."""
    for name, variable in trace.data_vars.items():
        if variable.dtype.kind != "f" or "time" not in variable.dims:
            continue
        wrong = np.isnan(variable.values) if name in MAY_BE_INFINITE else ~np.isfinite(variable.values)
        if wrong.any():
            time = float(trace["time"][np.argmax(wrong.reshape(len(wrong), -1).any(axis=1))])
            return Report(False, f"{name} is no finite number at {time:.2f} s", time=time)
    if outcome is Outcome.DIVERGED:
        return Report(False, "the run diverged")
    return Report(True, "all numbers finite")


def _energy(trace: Recorded) -> Report:
    """Robots move with no more energy than motors, disturbance, gravity, wind, tethers and touches gave them.

    Each is bounded from above: gravity, disturbance and tethers as if they pulled along the motion, wind as
    if it gave robots its own speed, and a touch as if its impulse came from a body as fast as the fastest
    point of a robot and the closing speed together, or as the former where bodies come apart. Twice that is
    allowed, and what one step adds from rest.
    """
    about = {name: float(trace.attrs[name]) for name in ("gravity", "wind", "robots_mass", "timestep")}
    mass, speed, time = (trace[name].values for name in ("robot_mass", "speed_max", "time"))
    force, disturbance, start = (
        np.linalg.norm(trace[name].values, axis=-1) for name in ("force", "disturbance", "v")
    )
    weight = about["robots_mass"] * about["gravity"]
    path = speed * np.diff(time, prepend=time[0])[:, None]
    pulled = (disturbance * path).sum(axis=1) + weight * path.max(axis=1) + _tethers_pull(trace, path)
    first = (mass * start[0] ** 2 + (force.max(axis=0) * about["timestep"]) ** 2 / mass).sum()
    first += about["robots_mass"] * ((about["gravity"] * about["timestep"]) ** 2 + about["wind"] ** 2)
    work = (trace["work"].values - trace["work"].values[0]).sum(axis=1)
    closing = np.maximum(trace["episode_closing_speed"].values, 0.0)
    pushed = trace["episode_impulse"].values * (closing + fastest_points(trace).max())
    touched = (time[:, None] >= trace["episode_start"].values) @ pushed
    given = 2.0 * (0.5 * first + work + np.cumsum(pulled) + touched)
    total = 0.5 * (mass * speed**2).sum(axis=1)
    room = 1.0 - total / np.maximum(given, 1e-300)
    row = int(np.argmin(room))
    value, most, moment = float(total[row]), float(given[row]), float(time[row])
    words = f"kinetic energy {value:.3g} J of at most {most:.3g} J at {moment:.2f} s"
    robot = (f"robot_{int(np.argmax(mass * speed[row] ** 2)) + 1}",)
    return Report(most >= value, words, value, "J", moment, robot, most - value, float(room[row]))


def _tethers_pull(trace: Recorded, path: Array) -> Array:
    """Return what tethers give robots until each sample at most, as if they pulled along the motion [J].

    Args:
        trace: Gives how far tethers are stretched.
        path: Of each robot since the sample before, shape (time, n) [m].
    """
    between = tethers(trace)
    if not len(between):
        return np.zeros(len(path))
    stiffness = np.reshape(trace.attrs.get("tether_stiffness", np.zeros(len(between))), -1)
    tension = stiffness * np.abs(stretches(trace))
    tension = np.maximum(tension, np.concatenate([tension[:1], tension[:-1]]))
    of_target = np.zeros((len(path), 1))  # which is no robot
    ways = np.concatenate([of_target, path], axis=1)[:, between]
    return np.asarray((tension * ways.sum(axis=2)).sum(axis=1))


def _tunneling(trace: Recorded) -> Report:
    """No two bodies come nearer in one step than the thinnest is thick: none can pass through another."""
    found = tunneling(trace)
    assert found.value is not None
    words = f"bodies come nearer by up to {found.value:.3g} of the thinnest's thickness a step"
    words += f" ({found.who} at {found.time:.2f} s)"
    margin = 1.0 - found.value
    return Report(margin >= 0.0, words, found.value, "", found.time, found.bodies, margin, margin)
