"""The constraints of outer loops on velocities, one for each body that a robot sees."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles
from escort_mj.behaviors.avoid_obstacles import POLAR
from escort_mj.control.outer_loops.constraints import (
    MOST,
    OTHER_TARGET,
)
from escort_mj.control.outer_loops.passing import (
    HEAD_ON,
    Rules,
    approach,
    aside_of,
    horizon,
    lead_of,
)
from tests.oracle.behaviors import teammates_of
from tests.oracle.sensing import in_range
from tests.oracle.task import Situation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Constraints(NamedTuple):
    """All that one robot's velocity v may have to satisfy, r . v >= b, a row for each body that it sees.

    Attributes:
        rows: r, shape (k, p).
        bounds: b, shape (k,) [m/s].
        closing: Speed relative to the body's motion below which it is satisfied in any case, shape (k,)
            [m/s].
        motion: Speed of the body, shape (k,) [m/s].
        mates: Whether it is a teammate that has not failed, shape (k,).
        gaps: How far the robot goes before each body could touch it, shape (k,) [m].
        followed: Whether the robot and a teammate follow the same target, shape (k,).
        spread: By how much the motion that two robots share may differ from that of the robot's team [m/s].
    """

    rows: Array
    bounds: Array
    closing: Array
    motion: Array
    mates: Mask
    gaps: Array
    followed: Mask
    spread: float

    def within(self, speed: float, beside: float) -> tuple[Array, Array, Array, Array]:
        """Return the rows and bounds that count up to two speeds, with whom each is shared, and the gaps."""
        could = np.where(self.mates, beside + self.spread, speed + self.motion) - self.closing
        kept = np.flatnonzero((could >= 0.0) & (self.bounds >= -speed))
        kept = kept[np.argsort(-self.bounds[kept], kind="stable")][:MOST]
        shared = np.where(self.mates, np.where(self.followed, 1.0, OTHER_TARGET), 0.0)
        return self.rows[kept], self.bounds[kept], shared[kept], self.gaps[kept]


def constraints_of(avoid: AvoidObstacles, rules: Rules, now: Situation) -> list[Constraints]:
    """Return the constraints of each robot.

    Args:
        avoid: Gives safe distances.
        rules: How fast robots may come nearer.
        now: The situation.
    """
    setup, q, lost = now.setup, now.q, now.team.lost
    heard = now.heard if avoid.hears(now.setup) else None
    m, n = setup.obstacle_position.shape[0], len(q)
    away, distance, safe = bodies_nearby(avoid, now)
    radii = np.concatenate([setup.seen_radius, setup.robot_radius])
    gaps = distance if avoid.measure == "surface" else distance - setup.robot_radius[:, None] - radii
    seen = np.hstack(
        [in_range(gaps[:, :m], setup.sensing.obstacles), in_range(gaps[:, m:], setup.sensing.robots)]
    )
    if heard is not None:
        seen[:, m:][heard.known] = 0.0
        gaps = gaps + np.hstack([np.zeros((n, m)), heard.ball])
    frame = now.c_dot * setup.target_feedforward
    share = np.concatenate([np.ones(m), np.where(lost, 1.0, 0.5)])
    alike, mutual = np.full((n, n), rules.target_radius > 0.0), np.repeat(frame[:, None], n, axis=1)
    spread = np.zeros(n)
    if now.members is not None:
        alike = now.members[:, None] == now.members
        other = 0.0 if setup.estimating else 0.5 * (frame[:, None] + frame)
        mutual = np.where(alike[..., None], mutual, other)
        most = np.linalg.norm(mutual - frame[:, None], axis=2).max()
        spread = rules.foresees * (np.linalg.norm(frame, axis=1) if setup.estimating else np.full(n, most))
    found: list[Constraints] = []
    for i in range(n):
        wanted = (safe[i] > 0.0) & np.isfinite(seen[i])
        rows, margin = away[i, wanted], (distance - safe)[i, wanted]
        reach = (safe[i] + (setup.robot_radius[i] + radii) * (avoid.measure == "surface"))[wanted]
        between = gaps[i, wanted]
        motion = np.vstack([setup.obstacle_velocities(), np.where(lost[:, None], now.v, mutual[i])])
        mates = now.v if heard is None else heard.velocity[i]
        velocity, shares, own = motion[wanted], share[wanted], np.vstack([0.0 * motion[:m], mates])[wanted]
        if rules.target_distance > 0.0:
            x = q[i] - now.c[i]
            length = float(np.linalg.norm(x))
            bodies = (setup.robot_radius[i] + rules.target_radius) * (avoid.measure == "surface")
            rows = np.vstack([rows, x / length if length > 0.0 else np.eye(len(x))[0]])
            reach = np.append(reach, bodies + rules.target_distance)
            between = np.append(between, length - setup.robot_radius[i] - rules.target_radius)
            margin = np.append(margin, length - reach[-1])
            velocity, shares = np.vstack([velocity, now.c_dot[i]]), np.append(shares, 1.0)
            own = np.vstack([own, now.c_dot[i]])
        kept = ~((rules.cone != 0.0) & (margin > 0.0))
        rows, margin, reach, velocity, shares, between = (
            each[kept] for each in (rows, margin, reach, velocity, shares, between)
        )
        along = rules.foresees * np.sum(rows * velocity, axis=1)
        speed = rules.foresees * np.linalg.norm(velocity, axis=1)
        lead = [lead_of(float(each), setup.max_speed) for each in speed] * ((shares == 1.0) & (along > 0.0))
        size = np.vstack([setup.obstacle_extent, np.zeros((n + 1, q.shape[1]))])
        kinds = np.append(np.flatnonzero(wanted), m + n)[: len(kept)][kept]
        wide = np.array(
            [widths(size[b], u) if s else 0.0 for b, u, s in zip(kinds, velocity, lead, strict=True)]
        )
        full = np.array([approach(float(each), rules) for each in margin - lead * (reach + wide)])
        pursuit = rules.foresees * np.sum(rows * own[kept], axis=1)
        bounds = along - shares * full
        between = between / (1.0 + np.maximum(along, 0.0) * (shares == 1.0) / setup.max_speed)
        shared = (shares < 1.0) & (rules.foresees != 0.0)
        bounds = np.where(shared, np.maximum(bounds, pursuit - full), bounds)
        closing = np.where(shared, np.minimum(shares * full, full + along - pursuit), shares * full)
        for j in np.flatnonzero(lead):
            x, straight = rows[j] * (margin[j] + reach[j]), along[j] - approach(float(margin[j]), rules)
            x = q[i] - setup.obstacle_position[kinds[j]] if wide[j] > 0.0 else x
            rows[j], bounds[j] = left_path(x, reach[j] + wide[j], now.v[i], velocity[j], rules)
            straight = min(straight, setup.max_speed**2 / speed[j])
            bounds[j] = min(bounds[j], aside_of(straight, setup.max_speed))
            if bounds[j] > 0.0:
                rows, bounds = np.vstack([rows, velocity[j] / speed[j]]), np.append(bounds, straight)
                closing, speed, shares, between = (
                    np.append(x, x[j]) for x in (closing, speed, shares, between)
                )
        same = np.concatenate([np.zeros(m, dtype=bool), alike[i], [False]])[kinds]
        followed = np.append(same, np.zeros(len(rows) - len(same), dtype=bool))
        found.append(Constraints(rows, bounds, closing, speed, shares < 1.0, between, followed, spread[i]))
    return found


def bodies_nearby(avoid: AvoidObstacles, now: Situation) -> tuple[Array, Array, Array]:
    """Every obstacle and teammate as each robot sees it, obstacles first.

    Returns:
        Unit vectors away from them, shape (n, m + n, p); distances as the behavior measures them, of what
        is heard to where it may be by now, and the least ones [m], shape (n, m + n), the latter 0 where
        nothing is avoided.
    """
    q, setup = now.q, now.setup
    teammates, balls, mates = teammates_of(avoid, q, setup, now.team.lost, now.heard)
    offsets = q[:, None] - np.concatenate([setup.obstacles_seen()[:-1], teammates], axis=1)
    distance = np.linalg.norm(offsets, axis=2)
    away = np.where(distance[..., None] > 0.0, offsets, np.eye(q.shape[1])[0])
    away = away / np.linalg.norm(away, axis=2, keepdims=True)
    if avoid.measure == "surface":
        radii = np.concatenate([setup.seen_radius, setup.robot_radius])
        distance = distance - setup.robot_radius[:, None] - radii
    distance[:, -len(q) :] -= balls
    safe = np.hstack([np.full((len(q), len(setup.obstacle_position)), avoid.safe_distance), mates])
    return away, distance, safe


def turned(r: Array) -> Array:
    """Return the unit vector counterclockwise across another, shape (p,)."""
    p, across = len(r), np.zeros_like(r)
    first = 1 if p % 2 and abs(r[-1]) > POLAR * np.linalg.norm(r) else 0
    paired = slice(first, first + p - p % 2)
    pairs = r[paired].reshape(-1, 2)
    across[paired] = np.stack([-pairs[:, 1], pairs[:, 0]], axis=1).ravel()
    return np.asarray(across / np.linalg.norm(across))


def widths(extent: Array, motion: Array) -> float:
    """Return how far a box reaches to the side of its path, see `breadth` [m]."""
    share = motion / np.linalg.norm(motion)
    return float(extent @ np.sqrt(np.maximum(1.0 - share * share, 0.0)))


def left_path(x: Array, reach: float, v: Array, motion: Array, rules: Rules) -> tuple[Array, float]:
    """Return the direction away from a body's path, and the speed that way; x is where a robot is from it."""
    along = motion / np.linalg.norm(motion)
    aside = x - (x @ along) * along
    across = v - (v @ along) * along
    side, arrives = float(np.linalg.norm(across)), float(x @ along / np.linalg.norm(motion))
    later = aside + min(horizon(side, rules) / max(side, 1e-300), arrives) * across
    length = float(np.linalg.norm(later))
    r, missing = (
        (later / length, reach - aside @ later / length)
        if length > HEAD_ON * np.linalg.norm(x)
        else (turned(along), reach)
    )
    return r, -approach(float(-missing), rules)
