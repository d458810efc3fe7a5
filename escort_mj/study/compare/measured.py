"""What the reproduction measures of one run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from escort_mj.measuring import measure
from escort_mj.record.outcome import Outcome
from escort_mj.record.window import Span
from escort_mj.study.compare.reproduction import PaperRun

if TYPE_CHECKING:
    import xarray

NEAR = 1.02  # safe distances: an obstacle that comes so near is near


class ComparedQuantity(NamedTuple):
    """One column of the table: its unit and what it means."""

    unit: str
    meaning: str


QUANTITIES = {
    "settling_time": ComparedQuantity("s", "time after which every | |q - c| - R | stays below 5 % of R"),
    "tracking_time": ComparedQuantity("s", "time after which every |e| stays below 1 % of R"),
    "error_peak": ComparedQuantity("m", "largest |e|"),
    "radius_error": ComparedQuantity("m", "tail mean of | |q - c| - R |"),
    "radius_error_max": ComparedQuantity("m", "tail maximum of | |q - c| - R |"),
    "spacing_error": ComparedQuantity("m", "tail mean deviation of the neighbor distances from even spacing"),
    "e_rms": ComparedQuantity("m", "tail RMS of |e|, including measurement noise"),
    "e_dot_rms": ComparedQuantity("m/s", "tail RMS of |e_dot|, including measurement noise"),
    "true_e_rms": ComparedQuantity("m", "tail RMS of |q_d - q|, without measurement noise"),
    "true_e_dot_rms": ComparedQuantity("m/s", "tail RMS of |v_d - v|, without the measurement noise of v"),
    "chattering": ComparedQuantity("N/s", "tail mean of the total variation of a robot's force per second"),
    "force_rms": ComparedQuantity("N", "tail RMS force of a robot"),
    "obstacle_distance": ComparedQuantity("m", "minimum distance to an obstacle, center to center"),
    "robot_distance": ComparedQuantity("m", "minimum distance between robots, center to center"),
    "contacts": ComparedQuantity("1", "number of touches"),
}


class Approach(NamedTuple):
    """The robot that came nearest to an obstacle.

    Attributes:
        robot: Its number.
        distance: Center to center [m].
        avoided: Robots that avoidance ruled while they were within the obstacle's safe distance.
    """

    robot: int
    distance: float
    avoided: list[int]


@dataclass(frozen=True)
class Measured:
    """What was measured of one run.

    Attributes:
        simulation: Which run.
        outcome: How it ended.
        message: The same in words.
        values: By the names of `QUANTITIES`; None where there is nothing to measure, infinite for "never".
        approaches: One per obstacle.
    """

    simulation: PaperRun
    outcome: str
    message: str
    values: dict[str, float | None]
    approaches: list[Approach]

    @property
    def completed(self) -> bool:
        """Whether the run reached its end."""
        return self.outcome == Outcome.COMPLETED.value

    def value(self, name: str) -> float:
        """A value that the run has."""
        found = self.values[name]
        return math.nan if found is None else found


def measured(simulation: PaperRun, outcome: str, message: str, trace: xarray.Dataset | None) -> Measured:
    """Measure a run; one that did not reach its end has no steady state, only least distances.

    Args:
        simulation: Which run.
        outcome: How it ended.
        message: The same in words.
        trace: What it recorded; None where there is nothing.
    """
    values: dict[str, float | None] = dict.fromkeys(QUANTITIES)
    if trace is None or not trace.sizes["time"]:
        return Measured(simulation, outcome, message, values, [])
    values["obstacle_distance"] = measure("obstacle_distance_min", trace).value
    values["robot_distance"] = measure("robot_distance_min", trace).value
    values["contacts"] = measure("contacts", trace).value
    if outcome == Outcome.COMPLETED.value:
        before = undisturbed(trace)
        values |= _motion(before) | _steady(Span("tail").of(before))
    return Measured(simulation, outcome, message, values, _approaches(trace))


def undisturbed(trace: xarray.Dataset) -> xarray.Dataset:
    """What a run does before the first obstacle comes near; all of it where none does."""
    if not trace.sizes["obstacle"]:
        return trace
    near = trace["obstacle_distance"].values.min(axis=(1, 2)) < NEAR * float(trace.attrs["safe_distance"])
    before = trace.isel(time=slice(0, int(np.argmax(near)))) if near.any() else trace
    return before if before.sizes["time"] > 1 else trace


def _motion(trace: xarray.Dataset) -> dict[str, float | None]:
    """How a run comes to its steady state."""
    return {
        "settling_time": measure("settling_time", trace).value,
        "tracking_time": measure("tracking_time", trace).value,
        "error_peak": measure("tracking_error_max", trace).value,
    }


def _steady(tail: xarray.Dataset) -> dict[str, float | None]:
    """The steady state."""
    return {
        "radius_error": measure("radius_error_mean", tail).value,
        "radius_error_max": measure("radius_error_max", tail).value,
        "spacing_error": measure("spacing_error_mean", tail).value,
        "e_rms": measure("tracking_error_rms", tail).value,
        "e_dot_rms": measure("velocity_error_rms", tail).value,
        "true_e_rms": measure("true_error_rms", tail).value,
        "true_e_dot_rms": measure("true_velocity_error_rms", tail).value,
        "chattering": measure("chattering", tail).value,
        "force_rms": measure("force_rms", tail).value,
    }


def _approaches(trace: xarray.Dataset) -> list[Approach]:
    """Who came nearest to each obstacle, and whom avoidance ruled there."""
    distance, active = trace["obstacle_distance"].values, trace["avoidance_active"].values > 0
    safe = float(trace.attrs["safe_distance"])
    found = []
    for index in range(trace.sizes["obstacle"]):
        near = distance[:, :, index]
        robot = int(np.argmin(near.min(axis=0)))
        ruled = np.flatnonzero((active & (near < safe)).any(axis=0)) + 1
        found.append(Approach(robot + 1, float(near.min()), ruled.tolist()))
    return found
