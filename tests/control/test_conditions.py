"""The conditions that set_based finds, against those of `tests/independent/conditions.py`."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from escort_mj.control.nsb import avoidance_of
from escort_mj.control.outer_loops.constraints import MOST, Constraints, SpeedBounds, find_constraints
from escort_mj.control.outer_loops.nearest_velocity import STIFFNESS
from escort_mj.control.outer_loops.passing import Clearance, Rules
from escort_mj.memory.layout import unpack_plan, unpack_state
from escort_mj.scenario import Scenario
from escort_mj.scenario.mission import Mission
from tests.control.twins import Kernel
from tests.independent.conditions import Condition, World, approach, conditions

STEP = 0.01
FEW, SAMPLES = 2, 10  # of each mission that is drawn: in fast tests, in slow ones
FORCE, MASS = 20.0, 1.0
WISHED = 20.0  # m/s
MISSIONS = (0, 1, 2, 6, 9, 11, 14, 21, 23, 24, 27, 30, 38)  # seeds of missions of every kind


def _finder(axes: int) -> Any:
    def found(plan_at, state_at, robot, speed, beside, rate, braking, distance, radius, rows, bounds, rest):
        plan, state = unpack_plan(plan_at, axes), unpack_state(plan_at, state_at, axes)
        rules = Rules(rate, braking, 0.0, 1.0, distance, radius)
        for level in range(plan.level_behavior.shape[0]):
            if plan.level_avoids[level] != 0.0:
                clearance = Clearance(level, avoidance_of(level, plan), rules)
                constraints = Constraints(rows, bounds, rest[0], rest[1])
                limits = SpeedBounds(speed, beside)
                return find_constraints(robot, limits, clearance, plan, state, constraints)
        return -1

    return found


FINDERS = {axes: _finder(axes) for axes in (2, 3)}


class Drawn:
    """A mission whose robots are put anywhere, at any velocity."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = np.random.default_rng(seed)
        self.axes = axes = int(rng.choice([2, 3]))
        self.kind = str(rng.choice(["goals", "target", "teams"]))
        self.hears = bool(self.kind == "target" and rng.random() < 0.5)
        self.count = n = int(rng.integers(2, 13)) if rng.random() < 0.9 else int(rng.integers(48, 70))
        self.size = float(rng.uniform(0.6, 2.0)) * n ** (1.0 / axes)
        self.rate, self.braking = float(rng.uniform(2.0, 8.0)), float(rng.uniform(1.0, 10.0))
        self.most = float(rng.uniform(0.5, 3.0))
        self.safe, self.mates = rng.uniform(0.2, 0.6, 2).round(3)
        self.sight = float(rng.choice([2.0, 1e3]))
        failed = [int(i) + 1 for i in rng.choice(n, int(rng.integers(0, 3)) if n > 3 else 0, replace=False)]
        self.home = np.zeros((0, axes))
        while len(self.home) < n:
            place = rng.uniform(-self.size, self.size, axes).round(3)
            if (np.linalg.norm(self.home - place, axis=1) > 0.25).all():
                self.home = np.vstack([self.home, place])
        places = [[50.0 + 2.0 * i, *[0.0] * (axes - 1)] for i in range(n)]  # until they are put elsewhere
        robots: dict[str, Any] = {"positions": places, "radius": 0.1, "force_limit": FORCE, "mass": MASS}
        if failed and rng.random() < 0.6:
            robots["failures"] = [{"robot": robot, "at": 0.0, "notice": 0.0} for robot in failed]
        else:
            failed = []
        self.lost = np.isin(np.arange(1, n + 1), failed)
        obstacles = []
        for k in range(int(rng.integers(0, 6))):
            u = rng.choice([0.0, 1.0]) * rng.normal(size=axes) * rng.uniform(0.0, 3.0)
            path = [f"{-50.0 - 5.0 * k} + {u[0]:.3f}*t", *(f"{x:.3f}*t" for x in u[1:])]
            obstacles.append({"radius": 0.3, "motion": {"position": path}})
        behaviors: list[Any] = [
            {"behavior": "avoid_obstacles", "safe_distance": self.safe, "teammate_distance": self.mates,
             "teammates": "heard" if self.hears else True}
        ]  # fmt: skip
        keys: dict[str, Any] = {"target": None}
        drift = rng.normal(size=axes).round(3)
        self.drift = np.zeros((n, axes))
        self.team = np.zeros(n, dtype=int)
        if self.hears:
            keys["communication"] = {"rate": 100, "delay": STEP, "loss": 0.3}
        if self.kind == "goals":
            behaviors.append({"behavior": "goal", "goals": self.home.tolist(), "gain": 1.0})
        elif self.kind == "target":
            keys["target"] = {"position": [f"{x}*t" for x in drift], "radius": 0.3}
            behaviors += ["repulsion" if failed else "vertices", "surface"]
            self.drift[:] = drift
        else:
            self.team = np.array([0] * (n // 2) + [1] * (n - n // 2))
            self.drift[self.team == 1] = drift
            keys["teams"] = [
                {
                    "name": name,
                    "robots": (np.flatnonzero(self.team == number) + 1).tolist(),
                    "targets": [{"name": f"{name}s", "radius": 0.3, "position": position}],
                }
                for number, (name, position) in enumerate(
                    (("first", [0.0] * axes), ("second", [f"{x}*t" for x in drift]))
                )
            ]
            behaviors += ["repulsion" if failed else "vertices", "surface"]
        patience = None if rng.random() < 0.7 else 1.0
        outer = {"loop": "set_based", "rate": self.rate, "braking": self.braking, "patience": patience}
        self.target_distance = float(rng.uniform(0.1, 0.5)) if self.kind == "target" else 0.0
        if self.kind == "target":
            outer["target_distance"] = self.target_distance
        scenario = Scenario(
            axes=axes, seed=int(rng.integers(1000)), physics={"timestep": STEP}, recording={"rate": 100},
            robots=robots, obstacles=obstacles,
            sensing={"radius": {"robots": self.sight, "obstacles": self.sight}},
            mission={"max_speed": self.most, "radius": self.size, "outer": outer, "behaviors": behaviors},
            **keys,
        )  # fmt: skip
        self.setup = Mission(scenario).setup
        self.radius = rng.uniform(0.05, 0.3, n)
        self.setup = replace(self.setup, robot_radius=self.radius)
        self.kernel, self.past = Kernel(self.setup), []

    def sample(self, number: int) -> World:
        """Evaluate the controller in a state that is drawn, and return that state."""
        rng, n, axes, t = self.rng, self.count, self.axes, number * STEP
        q = self.home + rng.normal(scale=0.2, size=(n, axes))
        v = self.drift + rng.normal(size=(n, axes)) * rng.uniform(0.0, self.most / math.sqrt(axes), (n, 1))
        resting = rng.random(n) < 0.4
        q[resting], v[resting] = self.home[resting], self.drift[resting]
        pushed = rng.random(n) < 2.0 / n
        v[pushed] = rng.normal(size=(int(pushed.sum()), axes)) * rng.uniform(1.0, 6.0)
        places = rng.uniform(-self.size, self.size, (len(self.setup.movers), axes))
        speeds = np.array([mover.path.velocity(t) for mover in self.setup.movers]).reshape(-1, axes)
        state = self.kernel.state
        state.mover_position[:], state.mover_velocity[:] = places, speeds
        self.kernel.evaluate(t, q, v)
        bodies = [(place, speed, 0.3) for place, speed in zip(places, speeds, strict=True)]
        self.past.append((q, v))
        drift = self.drift[0]
        target = (drift * t, drift, 0.3) if self.kind == "target" else None
        return World(
            q, v, self.radius, self.lost, self.team, self.drift, bodies, target, self.safe,
            self.mates, self.target_distance, self.rate, self.braking, self.most, self.sight,
            self._heard() if self.hears else None,
        )  # fmt: skip

    def _heard(self) -> dict[tuple[int, int], tuple[np.ndarray, float, np.ndarray]]:
        """Return what robots have heard, from when it was sent: moved on, in a ball that motors fill."""
        state, heard = self.kernel.state, {}
        for i in range(self.count):
            for slot in range(state.link_from.shape[1]):
                j, sent = int(state.link_from[i, slot]), int(state.link_step[i, slot])
                if j < 0 or sent < 0 or self.lost[j]:
                    continue
                (q, v), age = self.past[sent], (len(self.past) - 1 - sent) * STEP
                fastest = max(self.most, float(np.linalg.norm(v[j])))
                power = FORCE * math.sqrt(self.axes) / MASS  # a limit for each axis
                carried = min(age, fastest / power)
                ball = 0.5 * power * carried * (carried + STEP) + fastest * (age - carried)
                heard[i, j] = q[j] + carried * v[j], ball, v[j]
        return heard

    def found(self, i: int, speed: float, beside: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows and bounds that set_based finds for a robot."""
        rows, bounds, rest = np.zeros((MOST, self.axes)), np.zeros(MOST), np.zeros((2, MOST))
        memory, packed = self.kernel.memory.ctypes.data, self.kernel.packed.ctypes.data
        radius = 0.3 if self.kind == "target" else 0.0
        count = FINDERS[self.axes](
            packed, memory, i, speed, beside, self.rate, self.braking, self.target_distance, radius, rows,
            bounds, rest,
        )  # fmt: skip
        return rows[:count], bounds[:count]

    def missing(self, i: int, world: World) -> tuple[list[Condition], int]:
        """Return the conditions of a robot that it has not found, and how many there are.

        Those that no velocity within its limits could violate need not be found; where more than MOST could
        be, those that could be violated by least need not.
        """
        frame = float(np.linalg.norm(world.frame[i]))
        rows, bounds = self.found(i, world.most, world.most + frame)
        needed = []
        for each in conditions(i, world):
            if each.outrun is not None:
                if self.is_due(i, each, world) and not _crosses(rows, each.outrun).any():
                    return [each], 1
                continue
            if -world.most < each.b - 1e-9:
                needed.append(each)
        same = [
            (np.abs(rows - each.r).max(axis=1, initial=0.0) < 1e-9) & (np.abs(bounds - each.b) < 1e-9)
            for each in needed
        ]
        return [each for each, found in zip(needed, same, strict=True) if not found.any()], len(needed)

    def is_due(self, i: int, each: Condition, world: World) -> bool:
        """Whether a body that cannot be outrun arrives before the robot has left its path."""
        assert each.outrun is not None
        speed = float(np.linalg.norm(each.outrun))
        if "of body" not in each.who:
            return False  # the same rule, with other distances
        place, _, radius = world.bodies[int(each.who.split()[-1])]
        x, reach = world.q[i] - place, world.radius[i] + radius + world.safe
        distance, along = float(np.linalg.norm(x)), float(x @ each.outrun) / speed
        beside = math.sqrt(max(distance**2 - along**2, 0.0))
        beside += float(np.linalg.norm(world.v[i])) * distance / speed  # as far as it gets until then
        arrives = (distance - reach) / speed < reach / world.most
        return arrives and approach(beside - reach, world) < world.most

    def torn(self, i: int, world: World) -> float:
        """Return by how much a robot's reference velocity breaks a condition that others leave possible.

        A slack gives way by its Lagrange multiplier divided by the stiffness. Where a velocity v keeps all
        conditions with some room, the multipliers are at most |v - nominal|^2 / 2 divided by this room. The
        paths of fast bodies are left in time for what behaviors wish, which may be more than the limit.
        """
        rows, bounds = self.found(i, WISHED, WISHED + float(np.linalg.norm(world.frame[i])))
        every = conditions(i, world)
        slow = [each for each in every if each.outrun is None]
        r = np.array([each.r for each in slow]).reshape(-1, self.axes)
        b = np.array([each.b for each in slow])
        v = self.kernel.state.v_d[i]
        broken = float((b - r @ v).max(initial=0.0))
        for u in (each.outrun for each in every if each.outrun is not None):
            fleeing = _crosses(rows, u) | (np.abs(rows @ u / np.linalg.norm(u) - 1.0) < 1e-9)
            r, b = np.vstack([r, rows[fleeing]]), np.append(b, bounds[fleeing])
        if broken < 1e-6:
            return 0.0
        room = slack(r, b, world.most)
        gives = (2.5 * world.most) ** 2 / (2.0 * STIFFNESS * room) if room > 0.0 else math.inf
        return broken if broken > gives else 0.0


def _crosses(rows: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return which rows lead straight off the path of a body."""
    return np.abs(rows @ u) < 1e-9 * np.linalg.norm(u)


def slack(r: np.ndarray, b: np.ndarray, most: float) -> float:
    """Return by how much a velocity within the limit can keep all conditions; negative where none does.

    A linear program, with a polygon or a polyhedron within the circle or the sphere of velocities.
    """
    axes = r.shape[1]
    if axes == 2:
        turns = np.arange(64) * (2.0 * np.pi / 64)
        around, inner = np.column_stack([np.cos(turns), np.sin(turns)]), math.cos(math.pi / 64)
    else:
        around = np.random.default_rng(0).normal(size=(256, 3))
        around, inner = around / np.linalg.norm(around, axis=1, keepdims=True), 0.9
    left = np.vstack([np.hstack([-r, np.ones((len(r), 1))]), np.hstack([around, np.zeros((len(around), 1))])])
    right = np.append(-b, np.full(len(around), inner * most))
    found = linprog(
        np.append(np.zeros(axes), -1.0), A_ub=left, b_ub=right, bounds=[(None, None)] * (axes + 1)
    )
    return float(found.x[-1])


def look_at(missions: Sequence[int], samples: int) -> None:
    """Hold set_based against the independent conditions, in so many missions."""
    asked, resting = 0, 0
    for seed in missions:
        drawn = Drawn(seed)
        for number in range(samples):
            world = drawn.sample(number)
            for i in np.flatnonzero(~drawn.lost):
                missing, needed = drawn.missing(int(i), world)
                asked += needed
                resting += needed * bool((world.v[i] == world.frame[i]).all())
                assert not missing or needed > MOST, (seed, number, missing)
                torn = drawn.torn(int(i), world) if needed <= MOST else 0.0
                assert torn == 0.0, (seed, number, i, torn)
    assert asked > 5 * samples * len(missions) and resting > samples * len(missions)


def test_no_condition_is_missing() -> None:
    look_at(MISSIONS, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_no_condition_is_missing_in_5000_samples(part: int) -> None:
    look_at(range(1000 + 50 * part, 1050 + 50 * part), SAMPLES)


def test_the_program_sees_what_cannot_be() -> None:
    opposed = np.array([[1.0, 0.0], [-1.0, 0.0]])
    assert slack(opposed, np.array([0.5, 0.5]), 2.0) == pytest.approx(-0.5)
    assert slack(opposed, np.array([-0.5, -0.5]), 2.0) == pytest.approx(0.5)
    assert slack(opposed[:1], np.array([2.5]), 2.0) < 0.0
