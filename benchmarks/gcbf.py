"""`python -m benchmarks.gcbf`: worlds of GCBF+ (Zhang, So, Garg, Fan; IEEE T-RO 2025), as docs/gcbf.md.

Each episode becomes a scenario: its world, with behaviors, law and sensing of a shipped scenario. Agents are
judged one by one, as theirs are: safe if one never touches anything, reached if it ever comes within two
radii of its goal, successful if both. Worlds are drawn by the rules of github.com/MIT-REALM/gcbfplus, in
gcbfplus/env: boxes anywhere in a square, or spheres anywhere in a cube, perhaps overlapping; then for each
agent a start and a goal, uniform there and drawn again until they are four radii away from all that stands
and all other starts, or goals.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import escort_mj
from benchmarks.document import parser_for, publish, table
from escort_mj.study.sweeps.statistics import NORMAL

Array = NDArray[np.float64]
Episode = dict[str, Any]
"""`start` and `goal` of each agent [m], and `boxes` (`center`, `size`, `angle`) or `balls`."""

PAGE = "gcbf.md"
HEAD = ["worlds", "agents", "controller", "episodes", "safe", "reach", "success", "fastest [m/s]"]
SIDES = {"DoubleIntegrator": (0.1, 0.5), "LinearDrone": (0.15, 0.3), "CrazyFlie": (0.1, 0.6)}
"""Sides of boxes and diameters of spheres [m]."""
BASES = {
    "DoubleIntegrator": "benchmarks/gcbf",
    "LinearDrone": "benchmarks/gcbf_space",
    "CrazyFlie": "benchmarks/gcbf_drone",
}
RADIUS, SIGHT, STEP, STEPS = 0.05, 0.5, 0.03, 1024  # of all agents [m], and of all episodes [s]
REACH, APART, TRIES = 2.0, 4.0, 1024  # radii to a goal, and between what is drawn; draws
PEERS: dict[tuple[str, int], list[tuple[str, int, float | None, float | None, float]]] = {
    ("DoubleIntegrator", 8): [
        ("GCBF+ (learned)", 32, 99.6, 97.3, 96.9),
        ("decentralized CBF-QP", 32, 97.3, 90.6, 87.9),
        ("centralized CBF-QP", 32, 96.1, 89.8, 85.9),
        ("no avoidance (LQR)", 32, None, None, 52.7),
    ],
    ("DoubleIntegrator", 32): [
        ("GCBF+ (learned)", 8, 99.2, 95.7, 94.9),
        ("decentralized CBF-QP", 8, 92.2, 91.4, 85.5),
        ("no avoidance (LQR)", 8, None, None, 20.7),
    ],
    ("LinearDrone", 8): [("GCBF+ (learned)", 16, 98.4, 100.0, 98.4)],
    ("CrazyFlie", 8): [("GCBF+ (learned)", 32, 85.2, 100.0, 85.2)],
}
"""Their code run on a CPU, JAX 0.4.30, seed 1234: episodes; percent safe, reached, successful."""


class Worlds(NamedTuple):
    """Worlds of one environment."""

    environment: str
    episodes: list[Episode]

    @property
    def agents(self) -> int:
        """Number of agents of each."""
        return len(self.episodes[0]["start"])


def published(name: str) -> Worlds:
    """Return the worlds that the authors drew: n8 or n32."""
    text = (Path(__file__).parent / "worlds" / f"gcbf_{name}.json").read_text(encoding="utf-8")
    return Worlds("DoubleIntegrator", json.loads(text)["episodes"])


def drawn(
    environment: str, agents: int, area: float, obstacles: int, count: int, seed: int,
    travel: float = math.inf,
) -> Worlds:  # fmt: skip
    """Draw worlds in a square or cube of a side [m], goals at most `travel` from starts along an axis."""
    randoms = (np.random.Generator(np.random.Philox([seed, number])) for number in range(count))
    return Worlds(
        environment, [_draw(each, environment, agents, area, obstacles, travel) for each in randoms]
    )


def _draw(
    random: np.random.Generator, environment: str, agents: int, area: float, obstacles: int, travel: float
) -> Episode:
    """Draw one world."""
    axes = 2 if environment == "DoubleIntegrator" else 3
    apart = APART * RADIUS
    centers = random.uniform(0.0, area, (obstacles, axes))
    if axes == 2:
        sizes = random.uniform(*SIDES[environment], (obstacles, 2))
        angles = random.uniform(0.0, 2.0 * math.pi, obstacles)
        standing = {
            "boxes": [
                {"center": center.tolist(), "size": size.tolist(), "angle": float(angle)}
                for center, size, angle in zip(centers, sizes, angles, strict=True)
            ]
        }
    else:
        radii = 0.5 * random.uniform(*SIDES[environment], obstacles)
        balls = zip(centers, radii, strict=True)
        standing = {"balls": [{"center": at.tolist(), "radius": float(radius)} for at, radius in balls]}

    def clear(point: Array) -> bool:
        way = point - centers
        if axes == 3:
            return bool(np.all(np.linalg.norm(way, axis=1) > radii + apart))
        cosine, sine = np.cos(angles), np.sin(angles)
        inward = np.stack(
            [cosine * way[:, 0] + sine * way[:, 1], cosine * way[:, 1] - sine * way[:, 0]], axis=1
        )
        return bool(np.all(np.linalg.norm(np.maximum(np.abs(inward) - 0.5 * sizes, 0.0), axis=1) >= apart))

    def free(low: Array, high: Array, taken: list[Array]) -> Array | None:
        for _ in range(TRIES):
            point: Array = random.uniform(low, high)
            if all(np.linalg.norm(other - point) > apart for other in taken) and clear(point):
                return point
        return None

    room = ((area + apart) / apart) ** axes  # at most so many even if they stood on a dense grid
    for _ in range(
        TRIES if agents < 2.0 * room else 0
    ):  # starts over where an agent finds no room, as the published code does
        starts: list[Array] = []
        goals: list[Array] = []
        while len(goals) < agents:
            start = free(np.zeros(axes), np.full(axes, area), starts)
            if start is None:
                break
            goal = free(np.maximum(start - travel, 0.0), np.minimum(start + travel, area), goals)
            if goal is None:
                break
            starts.append(start)
            goals.append(goal)
        else:
            return {"start": [s.tolist() for s in starts], "goal": [g.tolist() for g in goals]} | standing
    raise SystemExit(f"found no room for {agents} agents in {area:g} m; give a larger area")


def mission(base: escort_mj.Scenario, worlds: Worlds, number: int) -> escort_mj.Scenario:
    """Put a base scenario's team into a world."""
    episode, sight = worlds.episodes[number], 1.0 if worlds.environment == "CrazyFlie" else SIGHT
    boxes = [
        {
            "shape": "box", "size": [0.5 * side for side in box["size"]], "position": box["center"],
            "orientation": box.get("angle", 0.0),
        }
        for box in episode.get("boxes", ())
    ]  # fmt: skip
    balls = [
        {"shape": "sphere", "radius": ball["radius"], "position": ball["center"]}
        for ball in episode.get("balls", ())
    ]
    goal = next(k for k, one in enumerate(base.mission.behaviors) if one.behavior == "goal")
    return base.replace(
        {
            "name": f"{base.name}_{number}",
            "seed": number,
            "duration": STEP * STEPS,
            "obstacles": boxes + balls,
            "robots.count": worlds.agents,
            "robots.positions": episode["start"],
            "robots.radius": RADIUS,
            **(
                {"robots.mass": 0.0299}
                if worlds.environment == "CrazyFlie"
                else {"robots.mass": 0.1, "robots.force_limit": 1.0}
            ),
            "sensing.radius.robots": sight - 2.0 * RADIUS,
            "sensing.radius.obstacles": sight - RADIUS,
            "expect": [],
            f"mission.behaviors[{goal}].goals": episode["goal"],
        }
    )


class Judged(NamedTuple):
    """What came of one episode: agents that were safe, reached their goals, did both; largest speed [m/s]."""

    safe: int
    reached: int
    success: int
    speed_per_axis: float


def judge(run: Any, episode: Episode) -> Judged:
    """Judge an episode, agent by agent."""
    if not run.outcome.good:
        print(run, flush=True)
        return Judged(0, 0, 0, math.nan)
    trace = run.trace
    near = np.linalg.norm(trace["q"].values - np.array(episode["goal"], float), axis=2) < REACH * RADIUS
    safe, reached = (trace["clearance"].values >= 0.0).all(axis=(0, 2)), near.any(axis=0)
    fastest = float(np.abs(trace["v"].values).max())
    return Judged(int(safe.sum()), int(reached.sum()), int((safe & reached).sum()), fastest)


def flown(worlds: Worlds, scenario: str | None = None) -> list[Judged]:
    """Fly all episodes with behaviors, law and sensing of a scenario, and judge them."""
    base = escort_mj.load_scenario(scenario or BASES[worlds.environment])
    missions = (mission(base, worlds, number) for number in range(len(worlds.episodes)))
    runs = escort_mj.run_many(missions, traces=True)
    return [judge(run, episode) for run, episode in zip(runs, worlds.episodes, strict=True)]


def share_of_worlds(times: Sequence[int], of: Sequence[int]) -> tuple[float, float, float]:
    """Share of robots that share worlds, with Wilson's interval of as many observations as there are worlds.

    It is for things that happen or do not; a world's share, which may lie between, varies less, so that the
    interval covers at least as often as it says.
    """
    share, worlds = sum(times) / sum(of), len(of)
    square = NORMAL**2 / worlds
    middle, half = share + 0.5 * square, NORMAL * math.sqrt((share * (1.0 - share) + 0.25 * square) / worlds)
    low, high = ((middle + sign * half) / (1.0 + square) for sign in (-1.0, 1.0))
    return share, max(low, 0.0), min(high, 1.0)


def rows(worlds: Worlds, found: list[Judged]) -> Iterator[list[str]]:
    """Ours, then the others, in percent of agents."""
    environment, agents = worlds.environment, worlds.agents

    def percent(name: str) -> str:
        share = share_of_worlds([getattr(one, name) for one in found], [agents] * len(found))
        return "{:.1f} ({:.1f} to {:.1f})".format(*(100.0 * each for each in share))

    shares = [percent(name) for name in ("safe", "reached", "success")]
    fastest = max(one.speed_per_axis for one in found)
    yield [environment, str(agents), "here", str(len(found)), *shares, f"{fastest:.2f}"]
    limit = 0.3 if environment == "CrazyFlie" else 0.5
    for peer, episodes, *known in PEERS.get((environment, agents), ()):
        told = ["" if each is None else f"{each:.1f}" for each in known]
        yield [environment, str(agents), peer, str(episodes), *told, f"{limit:.2f}"]


def main(arguments: Any = None) -> None:
    """Fly the worlds of the page, or drawn ones."""
    parser = parser_for(__doc__, PAGE)
    parser.add_argument("--environment", choices=[*SIDES], default="DoubleIntegrator")
    parser.add_argument("--agents", type=int, help="draw worlds with this many agents")
    parser.add_argument("--area", type=float, default=4.0, help="side of drawn worlds [m]")
    parser.add_argument("--obstacles", type=int, default=8, help="boxes or spheres of drawn worlds")
    parser.add_argument("--travel", type=float, default=math.inf, help="farthest goal along an axis [m]")
    parser.add_argument("--episodes", type=int, default=32, help="number of drawn worlds")
    parser.add_argument("--seed", type=int, default=0, help="of drawn worlds")
    parser.add_argument("--scenario", help="behaviors, law and sensing, with a behavior goal")
    asked = parser.parse_args(arguments)
    if asked.agents is not None:
        given = asked.environment, asked.agents, asked.area, asked.obstacles, asked.episodes, asked.seed
        worlds = drawn(*given, asked.travel)
        print(table(HEAD, rows(worlds, flown(worlds, asked.scenario))))
        return
    every = [published("n8"), published("n32")]
    every += [drawn(name, 8, 2.0, 8, 32, 5) for name in ("LinearDrone", "CrazyFlie")]
    told = [row for worlds in every for row in rows(worlds, flown(worlds, asked.scenario))]
    publish(PAGE, {"gcbf": table(HEAD, told)}, asked.docs)


if __name__ == "__main__":
    main()
