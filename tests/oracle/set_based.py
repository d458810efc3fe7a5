"""The outer loop set_based with NumPy: all its constraints, and the nearest velocity by SciPy's means."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles, Behavior
from escort_mj.control.outer_loops.detour import (
    DIRECTIONS,
    FREE,
    HALVINGS,
    NAMES,
    Detour,
    next_detour,
)
from escort_mj.control.outer_loops.set_based import SetBased
from escort_mj.control.setup import Setup
from tests.oracle.constraints import Constraints, constraints_of, turned
from tests.oracle.nearest_velocity import aside, broken_least, contradicting, kept_limit, nearest
from tests.oracle.outer_loops import escorting_velocity, slowed, split, velocities
from tests.oracle.task import Situation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@velocities.register
def _velocities_of_set_based(
    loop: SetBased, behaviors: tuple[Behavior, ...], now: Situation
) -> tuple[Array, Mask]:
    """Return the escort behaviors' velocities, changed by as little as safety takes, and whose are."""
    escorting, avoiding = split(behaviors)
    active = np.zeros(len(now.q), dtype=bool)
    velocity = escorting_velocity(escorting, now)
    rules, memory = loop.rules(now.setup), now.memory
    for name, empty in memory_of(now.setup).items():
        memory.setdefault(name, empty)
    for avoid in avoiding:
        for i, found in enumerate(constraints_of(avoid, rules, now)):
            frame = now.c_dot[i] * rules.foresees * now.setup.target_feedforward
            velocity[i], active[i] = _one(loop, i, avoid, found, velocity[i], frame, now)
    return slowed(velocity, now.setup.max_speed), active


def _one(
    loop: SetBased,
    i: int,
    avoid: AvoidObstacles,
    every: Constraints,
    wanted: Array,
    frame: Array,
    now: Situation,
) -> tuple[Array, bool]:
    """Return one robot's velocity, and whether constraints change it."""
    memory, nominal, side = now.memory, wanted, 0.0
    speed, beside = float(np.linalg.norm(wanted)), float(np.linalg.norm(wanted - frame))
    elapsed, fastest = now.time - memory["detour_time"][i], speed
    memory["detour_time"][i] = now.time
    decided, most = False, now.setup.max_speed
    if loop.patience is not None:
        beside += 2.0 * float(np.linalg.norm(now.c_dot[i]))
    while True:
        rows, bounds, shared, gaps = every.within(fastest, beside)
        start = aside(avoid.sidestep, rows, bounds, wanted) if side == 0.0 else nominal
        v, moved = nearest(rows, bounds, start)
        reached, relative = float(np.linalg.norm(v)), float(np.linalg.norm(v - frame))
        if reached > fastest or relative > beside:
            fastest, beside = max(fastest, reached), max(beside, relative)
            continue
        if loop.patience is not None and not decided:
            decided = True
            square = max(speed * speed, 1e-300)
            advance = float(now.v[i] @ wanted) / math.sqrt(square)
            found = next_detour(
                Detour(*(float(memory[name][i]) for name in NAMES)), elapsed, moved,
                float(v @ wanted) / square, advance,
                float((1.0 - shared)[bounds >= -speed].max(initial=0.0)), loop.patience, loop.turn_back,
            )  # fmt: skip
            for name, value in zip(NAMES, found, strict=True):
                memory[name][i] = value
            side = found.side
            if side != 0.0:
                nominal = boundary(side, speed, rows, bounds, shared)
                continue
        kept = None if contradicting(rows, bounds, start, v) else kept_limit(rows, bounds, most, v)
        if kept is None:
            kept = broken_least(rows, bounds, gaps, avoid.safe_distance, most, start)
        reached, relative = float(np.linalg.norm(kept)), float(np.linalg.norm(kept - frame))
        if not (reached > fastest or relative > beside):
            return kept, moved or side != 0.0
        fastest, beside = max(fastest, reached), max(beside, relative)


def memory_of(setup: Setup) -> dict[str, Array]:
    """Return the state as the NumPy form keeps it, each of shape (n,)."""
    return {name: np.zeros(setup.count) for name in (*NAMES, "detour_time")}


def boundary(side: float, speed: float, rows: Array, bounds: Array, shared: Array) -> Array:
    """Return the velocity along the boundary of the most binding constraint, shape (p,) [m/s]."""
    r, p = rows[int(np.argmax(np.where(shared < 1.0, bounds, -np.inf)))], rows.shape[1]
    across = turned(r)

    def velocity(angle: float, share: float) -> Array:
        return share * speed * (math.sin(side * angle) * across - math.cos(angle) * r)

    share, width = 1.0, 2.0 * math.pi / DIRECTIONS
    while share >= FREE:
        steps = [
            step for step in range(1, DIRECTIONS) if (rows @ velocity(step * width, share) >= bounds).all()
        ]
        if steps:
            blocked, free = (steps[0] - 1) * width, steps[0] * width
            for _ in range(HALVINGS):
                middle = 0.5 * (blocked + free)
                if (rows @ velocity(middle, share) >= bounds).all():
                    free = middle
                else:
                    blocked = middle
            return velocity(free, share)
        share *= 0.5
    return np.zeros(p)
