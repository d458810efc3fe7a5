"""Every metric against plain NumPy that knows only what the metric is documented to mean.

Missions are recorded at every physics step, and robots come nearer than a meter to a capsule: farther away
the box around it stands for it (docs/worlds.md). Metrics are recomputed from positions, velocities, forces
and the law's references; distances, touches, energies and V1 that a simulation keeps are not looked at.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import cache
from importlib import import_module
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pytest

from escort_mj import mission
from escort_mj.measuring import SHIPPED
from escort_mj.metrics import METRIC_NAMES
from escort_mj.scenario.reader.load import parse_scenario
from tests.metrics.motions import MISSIONS

Array, DT = np.ndarray, 0.002
APD, LIMIT = {"kp": 30.0, "kd": 50.0, "k": 1.0, "mu": 20.0, "slope": 20.0}, 4.0


class Body(NamedTuple):
    """A sphere, or a box turned about z, or a capsule along z, by its half sizes."""

    radius: float
    half: tuple[float, ...] = ()
    yaw: float = 0.0

    @property
    def thickness(self) -> float:
        return 2.0 * min(self.half) if len(self.half) > 1 else 2.0 * self.radius

    def gap(self, point: Array) -> Array:
        """Signed distance of points relative to the center from its surface, shape (k,)."""
        if len(self.half) == 1:  # a capsule: a segment along z, with a radius
            along = np.clip(point[:, 2], -self.half[0], self.half[0])
            return np.linalg.norm(np.column_stack([point[:, :2], point[:, 2] - along]), axis=1) - self.radius
        if not self.half:
            return np.linalg.norm(point, axis=1) - self.radius
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        out = np.abs(point @ np.array([[c, -s], [s, c]])) - np.array(self.half)
        return np.linalg.norm(np.maximum(out, 0.0), axis=1) + np.minimum(out.max(axis=1), 0.0)


class Case(NamedTuple):
    """A mission, and what is known of its bodies."""

    keys: dict[str, Any]
    obstacles: tuple[Body, ...] = ()
    radius: float = 2.0
    robot: float = 0.2
    target: float = 0.3
    mass: tuple[float, ...] = (1.0,) * 4
    dead: dict[int, float] = {}


def ring(count: int, radius: float) -> list[list[float]]:
    turns = 2.0 * math.pi * np.arange(count) / count
    return (radius * np.column_stack([np.cos(turns), np.sin(turns)])).round(6).tolist()


RECORDED = {"rate": 1.0 / DT}
ABOUT: dict[str, dict[str, Any]] = {
    "a noisy plane": {
        "obstacles": (Body(0.4), Body(0.0, (0.5, 0.3), 0.6)),
        "mass": (1.0, 1.6, 1.0, 1.0),
    },
    "the truth in space": {"obstacles": (Body(0.3, (0.8,)),)},
    "robots that touch": {"obstacles": (Body(0.5),), "radius": 5.0},
    "a robot that fails": {"dead": {1: 0.3}},
    "opponents": {"obstacles": (Body(0.2),) * 3},
}
CASES = {name: Case(keys, **ABOUT.get(name, {})) for name, keys in MISSIONS.items()}


class Flown(NamedTuple):
    """What was recorded of a mission, by signal, and the metrics that it came to."""

    case: Case
    signal: Callable[[str], Array]
    pairs: Array
    metrics: dict[str, float | None]


@cache
def flown(name: str) -> Flown:
    """Flies a mission, once in a process."""
    case = CASES[name]
    base = {"duration": 1.0, "mission": {"radius": 2}, "recording": RECORDED, "physics": {"timestep": DT}}
    run = mission.fly(parse_scenario(json.dumps(base | case.keys)))
    assert run.outcome.good and len(run.trace["time"]) == round(float(run.trace["time"][-1]) / DT) + 1
    values = {name: measure.value for name, measure in run.measures.items()}
    return Flown(case, lambda name: run.trace[name].values, run.trace["neighbors"].values - 1, values)


def norm(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=-1)


class Recomputed:
    """The metrics of a mission, by methods of their names."""

    def __init__(self, flown: Flown) -> None:
        self.case, get = flown.case, flown.signal
        self.time, self.q, self.v, self.force = get("time"), get("q"), get("v"), get("force")
        self.tau, self.e, self.e_dot = get("tau"), get("e"), get("e_dot")
        self.target, self.places = get("target_position"), get("obstacle_position")
        self.runs, self.disturbance, self.get = get("outer_updates"), get("disturbance"), get
        self.pairs = flown.pairs
        self.steps, self.n, self.p = self.q.shape
        self.mass = np.array(self.case.mass)
        self.alive = np.ones((self.steps, self.n), dtype=bool)
        for robot in self.case.dead:
            self.alive[:, robot] = get("lost")[:, robot] == 0
        self.tail = self.time >= 0.8 * self.time[-1] - 1e-9
        self.late = self.alive & self.tail[:, None]
        away = norm(self.q - self.target[:, None]) - self.case.radius
        self.away = np.where(self.alive, np.abs(away), np.nan)
        self.bodies = [Body(self.case.robot)] * self.n + [Body(self.case.target), *self.case.obstacles]

    def sums(self, values: Array, within: Array) -> tuple[float, float]:
        """Integral of what robots do at each step after the first of a stretch, and the time that it took."""
        counted = within.copy()
        counted[np.argmax(within.any(axis=1))] = False
        return float((values * counted).sum() * DT), float(counted.sum() * DT)

    def mean_of(self, values: Array, within: Array) -> float:
        total, time = self.sums(values, within)
        return total / time

    def radius_error_mean(self) -> float:
        return float(np.nanmean(self.away[self.tail]))

    def radius_error_max(self) -> float:
        return float(np.nanmax(self.away[self.tail]))

    def settling_time(self) -> float:
        outside = np.nonzero((self.away > 0.05 * self.case.radius).any(axis=1))[0]
        if not len(outside):
            return 0.0
        return math.inf if outside[-1] == self.steps - 1 else float(self.time[outside[-1] + 1])

    def spacing(self) -> Array | None:
        whole = self.alive.all(axis=1) & self.tail
        if not len(self.pairs) or not whole.any():
            return None
        even = 2.0 * self.case.radius * math.sin(math.pi / self.n)
        if self.p == 3:  # the tetrahedron
            even = self.case.radius * math.sqrt(8.0 / 3.0)
        a, b = self.pairs.T
        return np.abs(norm(self.q[whole][:, a] - self.q[whole][:, b]) - even)

    def spacing_error_mean(self) -> float | None:
        return None if (error := self.spacing()) is None else float(error.mean())

    def spacing_error_max(self) -> float | None:
        return None if (error := self.spacing()) is None else float(error.max())

    def energy_ratio(self) -> float:
        worst = 0.0
        for row in np.nonzero(self.tail)[0]:
            away = (self.q[row] - self.target[row])[self.alive[row]]
            worst = max(worst, coulomb(away) / least_coulomb(len(away), self.p))
        return worst

    def tracking_error_rms(self) -> float:
        return math.sqrt((norm(self.e)[self.late] ** 2).mean())

    def velocity_error_rms(self) -> float:
        return math.sqrt((norm(self.e_dot)[self.late] ** 2).mean())

    def tracking_error_max(self) -> float:
        return float(norm(self.e)[self.alive].max())

    def tracking_time(self) -> float:
        outside = np.nonzero((self.alive & (norm(self.e) > 0.01 * self.case.radius)).any(axis=1))[0]
        if not len(outside):
            return 0.0
        return math.inf if outside[-1] == self.steps - 1 else float(self.time[outside[-1] + 1])

    def true_error_rms(self) -> float:
        return math.sqrt((norm(self.get("q_d") - self.q)[self.late] ** 2).mean())

    def true_error_max(self) -> float:
        return float(norm(self.get("q_d") - self.q)[self.alive].max())

    def true_velocity_error_rms(self) -> float:
        return math.sqrt((norm(self.get("v_d") - self.v)[self.late] ** 2).mean())

    def force_rms(self) -> float:
        return math.sqrt(self.mean_of(norm(self.force) ** 2, self.alive))

    def chattering(self) -> float:
        change = np.abs(np.diff(self.force, axis=0, prepend=self.force[:1])).sum(axis=2)
        return self.mean_of(change / DT, self.alive)

    def outer_update_rate(self) -> float:
        return self.mean_of(np.diff(self.runs, axis=0, prepend=self.runs[:1]) / DT, self.alive)

    def energy(self) -> float:
        return self.sums(np.abs((self.force * self.v).sum(axis=2)), self.alive)[0]

    def obstacle_gaps(self) -> Array:
        """Of robots' centers from obstacles' surfaces, shape (steps, robots, obstacles)."""
        return np.stack([self.gaps(i, self.n + 1 + j) + self.case.robot
                         for i in range(self.n) for j in range(len(self.case.obstacles))],
                        axis=1).reshape(self.steps, self.n, -1)  # fmt: skip

    def gaps(self, a: int, b: int) -> Array:
        """Surface to surface of two bodies, of which the first is a sphere, shape (steps,)."""
        where = np.concatenate([self.q, self.target[:, None], self.places], axis=1)
        return self.bodies[b].gap(where[:, a] - where[:, b]) - self.bodies[a].radius

    def obstacle_distance_min(self) -> float | None:
        if not self.case.obstacles:
            return None
        to_centers = self.obstacle_gaps() + [body.radius * (not body.half) for body in self.case.obstacles]
        return float(to_centers.min())

    def obstacle_clearance_min(self) -> float | None:
        return float(self.obstacle_gaps().min()) - self.case.robot if self.case.obstacles else None

    def robot_distance_min(self) -> float:
        return self.robot_clearance_min() + 2.0 * self.case.robot

    def robot_clearance_min(self) -> float:
        return float(min(self.gaps(a, b).min() for a, b in combinations(range(self.n), 2)))

    def saturated_share(self) -> float:
        limit = self.case.keys["robots"].get("force_limit", 10.0)
        full = (np.abs(self.tau) > (math.inf if limit is None else limit)).any(axis=2)
        return self.mean_of(full, self.alive)

    def touching(self) -> list[tuple[int, int, Array]]:
        """Pairs of bodies that touch, with the steps in which they do."""
        pairs = [(a, b) for a, b in combinations(range(len(self.bodies)), 2) if a <= self.n]
        return [(a, b, inside) for a, b in pairs if (inside := self.gaps(a, b) <= 0.0).any()]

    def contacts(self) -> float:
        return float(
            sum(np.sum(np.diff(inside.astype(int), prepend=0) == 1) for *_, inside in self.touching())
        )

    def contact_force_max(self) -> float:
        """By Newton's second law: what motors and disturbance do not explain, along the centers' line."""
        worst = 0.0
        where = np.concatenate([self.q, self.target[:, None], self.places], axis=1)
        for a, b, inside in self.touching():
            if a == self.n:
                continue
            pull = self.mass[a] * np.diff(self.v[:, a], axis=0) / DT
            pull -= (self.force + self.disturbance)[:-1, a]
            line = (where[:, a] - where[:, b])[:-1]
            worst = max(worst, float(((pull * line).sum(axis=1) / norm(line))[inside[:-1]].max()))
        return worst

    def contacts_untold(self) -> float:
        return 0.0

    def tunneling(self) -> float:
        moved = np.concatenate([self.target[:, None], self.places], axis=1)
        speeds = [norm(self.v), norm(np.diff(moved, axis=0, prepend=moved[:1])) / DT]
        two = np.sort(np.concatenate(speeds, axis=1).max(axis=0))[-2:].sum()
        return float(two * DT / min(body.thickness for body in self.bodies))

    def kinetic_energy_max(self) -> float:
        opponents = norm(np.diff(self.places, axis=0, prepend=self.places[:1])) / DT  # of 1 kg
        mass = self.case.keys.get("target", {}).get("body", {}).get("mass", 0.0)
        target = mass * norm(self.get("target_velocity")) ** 2
        return float(0.5 * ((self.mass * norm(self.v) ** 2).sum(1) + (opponents**2).sum(1) + target).max())

    @property
    def told(self) -> bool:
        """Whether the truth was to be recorded."""
        return bool(self.case.keys.get("recording", {}).get("truth"))

    def mass_eigenvalue_min(self) -> float | None:
        return float(self.mass.min()) if self.told else None

    def mass_eigenvalue_max(self) -> float | None:
        return float(self.mass.max()) if self.told else None

    def skew_residual(self) -> float | None:
        return 0.0 if self.told else None  # the mass matrix is constant

    def coriolis_residual(self) -> float | None:
        return 0.0 if self.told else None

    def account(self) -> tuple[Array, Array, Array]:
        """V1 of each robot, and its change so far by the moving reference and for no known reason.

        Of point masses without noise, saturation and gravity: but for these, by dissipation and disturbance.
        """
        g, mass = APD, self.mass[:, None]
        v_d, e = self.get("v_d"), self.get("q_d") - self.q
        e_dot, estimate = v_d - self.v, self.get("rho_hat")
        s, jump = e_dot + g["slope"] * e, np.diff(v_d, axis=0, prepend=v_d[:1])
        rho = mass * (jump / DT + g["slope"] * e_dot)
        error = rho - estimate
        stored = (g["kp"] + g["slope"] * g["kd"]) * e**2
        value = 0.5 * (mass * s**2 + stored + error**2 / g["mu"]).sum(axis=2)
        lost = g["kd"] * e_dot**2 + g["slope"] * g["kp"] * e**2 + g["k"] * s * np.tanh(s)
        known = -DT * (lost + s * self.disturbance)[:-1]
        before = rho[:-1] - estimate[1:]
        by_reference = (s[1:] - 0.5 * jump[1:]) * mass * jump[1:]
        by_reference += 0.5 * (error[1:] ** 2 - before**2) / g["mu"]
        by_reference -= (s * mass * jump)[:-1]
        rest = np.diff(value, axis=0) - (known + by_reference).sum(axis=2)
        start = np.zeros((1, self.n))
        return value, *(
            np.vstack([start, np.cumsum(part, axis=0)]) for part in (by_reference.sum(axis=2), rest)
        )

    def lyapunov_rise(self) -> float | None:
        if not self.told:
            return None
        value, by_reference, _ = self.account()
        own = value - by_reference
        return float((own - np.minimum.accumulate(own, axis=0)).max())

    def lyapunov_unexplained(self) -> float | None:
        return float(np.abs(np.diff(self.account()[2], axis=0)).sum()) if self.told else None


def coulomb(points: Array) -> float:
    """Coulomb energy of the directions of points."""
    directions = points / norm(points)[:, None]
    return float(sum(1.0 / norm(a - b) for a, b in combinations(directions, 2)))


def least_coulomb(count: int, axes: int) -> float:
    """Of the regular polygon, and of the tetrahedron."""
    if axes == 3:
        assert count == 4
        return 6.0 / math.sqrt(8.0 / 3.0)
    return coulomb(np.array(ring(count, 1.0)))


NEAR = {"energy_ratio", "spacing_error_mean", "spacing_error_max"}  # an optimizer found the tetrahedron
ZERO = {"contacts_untold", "skew_residual", "coriolis_residual"}  # of point masses, with room in the log


def recomputed(name: str) -> Callable[[Recomputed], float | None]:
    """How a metric is found here: a method above, or a function in the test of the metric's own file."""
    if name in vars(Recomputed):
        return vars(Recomputed)[name]
    file = SHIPPED[name].function.__module__.rpartition(".")[2]
    return vars(import_module(f"tests.metrics.test_{file}"))[f"recomputed_{name}"]


@pytest.mark.parametrize("case", CASES)
def test_metrics_are_what_they_mean(compiled, case) -> None:
    again, found = Recomputed(flown(case)), flown(case).metrics
    for name in METRIC_NAMES:
        expected = recomputed(name)(again)
        near = 1e-6 if name in NEAR else 1e-9
        wanted = None if expected is None else pytest.approx(expected, rel=near, abs=1e-9)
        assert found[name] == wanted, name


def test_every_metric_is_put_to_the_test(compiled) -> None:
    """There is a way for each, and a mission in which it is a number other than 0."""
    assert all(callable(recomputed(name)) for name in METRIC_NAMES)
    found = [item for case in CASES for item in flown(case).metrics.items()]
    assert set(METRIC_NAMES) - {name for name, value in found if value not in (None, 0.0, math.inf)} == ZERO
