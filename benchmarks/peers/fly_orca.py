"""Robots change places by ORCA (van den Berg, Guy, Lin, Manocha 2011), in RVO2's own code: pyrvo.

A script of its environment: reads a mission as JSON, writes what came of it as JSON.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
import pyrvo


def fly(
    starts: Any, goals: Any, radius: float, speed: float, step: float, duration: float, reach: float,
    horizon: float, sees: float, neighbors: int, turn: float, seed: int,
) -> dict[str, float]:  # fmt: skip
    """Return makespan [s], mean way [m], least gap of discs [m] and share of robots that arrive."""
    rng, here, goals = np.random.default_rng(seed), np.array(starts, float), np.array(goals, float)
    count, way, gap = len(here), np.zeros(len(here)), np.inf
    sim = pyrvo.RVOSimulator()
    sim.set_time_step(step)
    sim.set_agent_defaults(sees, neighbors, horizon, horizon, radius, speed)
    for start in here:
        sim.add_agent(tuple(start))
    arrived = np.full(count, np.nan)
    cosine, sine = np.cos(turn), np.sin(turn)
    for tick in range(1, round(duration / step) + 1):
        left = goals - here
        far = np.linalg.norm(left, axis=1, keepdims=True)
        wanted = left / np.maximum(far, speed * step) * speed
        turned = wanted @ np.array([[cosine, sine], [-sine, cosine]])
        wanted = np.where(far > 0.5, turned, wanted) + rng.normal(scale=1e-3, size=(count, 2))
        for robot, velocity in enumerate(wanted):
            sim.set_agent_pref_velocity(robot, tuple(velocity))
        sim.do_step()
        places = [sim.get_agent_position(robot) for robot in range(count)]
        now = np.array([[place.x, place.y] for place in places])
        way += np.linalg.norm(now - here, axis=1)
        here = now
        apart = np.linalg.norm(here[:, None] - here, axis=2) + np.diag(np.full(count, np.inf))
        gap = min(gap, float(apart.min()) - 2.0 * radius)
        there = np.linalg.norm(goals - here, axis=1) < reach
        arrived = np.where(there, np.where(np.isnan(arrived), tick * step, arrived), np.nan)
        if there.all():
            break
    return {
        "makespan": float(arrived.max()), "way": float(way.mean()), "gap": gap,
        "arrived": float(there.mean()),
    }  # fmt: skip


if __name__ == "__main__":
    json.dump([fly(**mission) for mission in json.load(sys.stdin)], sys.stdout)
