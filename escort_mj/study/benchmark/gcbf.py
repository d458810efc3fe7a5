"""The GCBF+ benchmark (Zhang, So, Garg, Fan; IEEE T-RO 2025): who comes to its goal and touches nothing.

Each episode becomes a scenario: its world, with behaviors, law and sensing of a base scenario. Agents are
judged one by one, as theirs are: safe if one never touches anything, reached if it ever comes within two
radii of its goal, successful if both.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from escort_mj.behaviors import Goal
from escort_mj.errors import UsageError
from escort_mj.mission import Flight
from escort_mj.mission.batch import fly_many
from escort_mj.progress import Progress
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.findings import key_path
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.study.benchmark.worlds import BenchmarkEpisode, Worlds
from escort_mj.study.sweeps.statistics import Proportion, proportion_of, share_of_worlds

REACH = 2.0  # radii: within this distance of its goal an agent has reached it
BASES = {
    "DoubleIntegrator": "benchmarks/gcbf",
    "LinearDrone": "benchmarks/gcbf_space",
    "CrazyFlie": "benchmarks/gcbf_drone",
}
"""The scenario whose behaviors, law and sensing fly in an environment, where no other is given."""
SOURCE = "their code (github.com/MIT-REALM/gcbfplus) run on a CPU, JAX 0.4.30, seed 1234"


class Peer(NamedTuple):
    """What a published controller reaches on worlds of that kind; shares in percent, None for not known."""

    name: str
    episodes: int
    safe: float | None
    reach: float | None
    success: float


PEERS: dict[tuple[str, int, float, int], tuple[Peer, ...]] = {
    ("DoubleIntegrator", 8, 4.0, 8): (
        Peer("GCBF+ (learned)", 32, 99.6, 97.3, 96.9),
        Peer("decentralized CBF-QP", 32, 97.3, 90.6, 87.9),
        Peer("centralized CBF-QP", 32, 96.1, 89.8, 85.9),
        Peer("no avoidance (LQR)", 32, None, None, 52.7),
    ),
    ("DoubleIntegrator", 32, 4.0, 8): (
        Peer("GCBF+ (learned)", 8, 99.2, 95.7, 94.9),
        Peer("decentralized CBF-QP", 8, 92.2, 91.4, 85.5),
        Peer("no avoidance (LQR)", 8, None, None, 19.5),
    ),
    ("LinearDrone", 8, 2.0, 8): (Peer("GCBF+ (learned)", 16, 98.4, 100.0, 98.4),),
    ("CrazyFlie", 8, 2.0, 8): (Peer("GCBF+ (learned)", 32, 85.2, 100.0, 85.2),),
}
"""By environment, number of agents, area and number of obstacles."""

DIFFERENCES = (
    "Physics here: MuJoCo at the base scenario's step, forces within the limit per axis, and touches push "
    "back; theirs: Euler steps of 0.03 s, speeds clipped per axis, and agents pass through everything.",
    "Touches here are looked for at every physics step; theirs every 0.03 s.",
    "Speed here: mission.max_speed limits the norm of the law's reference, stricter than a limit per axis; "
    "nothing clips the true speed, and the largest one is reported.",
    "Sight here: the nearest point of each box and the positions of other agents within the same distance; "
    "theirs: 32 rays, and positions and velocities of agents.",
    "In space: their LinearDrone has drag and is a point mass of 0.1 kg with 1 N per axis here; "
    "their CrazyFlie is a quadrotor of 30 g here, with its own attitude loop, motors and law.",
)


class BenchmarkRow(NamedTuple):
    """What came of one episode.

    Attributes:
        episode: Its number.
        outcome: How it ended.
        robots: Number of agents.
        safe: How many never touched anything.
        reached: How many ever came to their goals.
        success: How many did both.
        at_goal: How many are at their goals at the end.
        makespan: When the last agent first came to its goal [s]; None where one never does.
        speed: Largest speed of an agent at any physics step [m/s].
        speed_per_axis: Largest speed along an axis at any sample [m/s].
    """

    episode: int
    outcome: str
    robots: int
    safe: int
    reached: int
    success: int
    at_goal: int
    makespan: float | None
    speed: float
    speed_per_axis: float


class Benchmark(NamedTuple):
    """What came of all episodes.

    Attributes:
        worlds: What was flown.
        rows: One per episode.
        safe: Share of agents that never touched anything, with its interval (Wilson), in which an episode
            is one observation: agents of one world are not independent.
        reach: Share of agents that ever came to their goals.
        success: Share of agents that did both.
        episodes: Share of episodes in which all agents did both.
        peers: What published controllers reach on such worlds.
    """

    worlds: Worlds
    rows: list[BenchmarkRow]
    safe: Proportion
    reach: Proportion
    success: Proportion
    episodes: Proportion
    peers: tuple[Peer, ...]

    @property
    def lines(self) -> list[str]:
        """The result as text."""
        worlds, broken = self.worlds, sum(row.outcome != Outcome.COMPLETED.value for row in self.rows)
        lines = [
            f"{worlds.environment}: {worlds.robots} agents, {worlds.area:g} m, {worlds.obstacles} obstacles, "
            f"{len(self.rows)} episodes of {worlds.duration:g} s, seed {worlds.seed}",
            f"  {'percent of agents':<26}{'safe':>8}{'reach':>8}{'success':>9}  success, 95 %",
        ]
        shares = [f"{100.0 * each.share:.1f}" for each in (self.safe, self.reach, self.success)]
        low, high = (100.0 * bound for bound in self.success.interval)
        lines.append(_line("here", len(self.rows), shares) + f"  {low:.1f} to {high:.1f}")
        for peer in self.peers:
            shares = ["" if x is None else f"{x:.1f}" for x in (peer.safe, peer.reach, peer.success)]
            lines.append(_line(peer.name, peer.episodes, shares))
        whole = f"{self.episodes.times} of {self.episodes.of} episodes without a fault"
        fastest = max(row.speed_per_axis for row in self.rows)
        lines.append(f"  {whole}; largest speed along an axis {fastest:.3f} m/s")
        if broken:
            lines.append(f"  {broken} episodes were not completed")
        if self.peers:
            lines.append(f"  others: {SOURCE}")
        return lines

    def document(self) -> dict[str, Any]:
        """Return the result for programs."""
        told = self.worlds.model_dump(exclude={"episodes"})
        shares = {name: getattr(self, name)._asdict() for name in ("safe", "reach", "success", "episodes")}
        return {
            "worlds": told,
            "rows": [row._asdict() for row in self.rows],
            **{name: share | {"interval": list(share["interval"])} for name, share in shares.items()},
            "peers": [peer._asdict() for peer in self.peers],
            "peers_source": SOURCE,
            "differences": list(DIFFERENCES),
        }


def _line(name: str, episodes: int, shares: list[str]) -> str:
    return f"  {f'{name} ({episodes})':<26}{shares[0]:>8}{shares[1]:>8}{shares[2]:>9}"


def mission_of(base: Scenario, worlds: Worlds, episode: BenchmarkEpisode) -> Scenario:
    """Put a base scenario's team into a world.

    Args:
        base: Gives behaviors, law and sensing; has a behavior `goal`.
        worlds: What the world shares with others.
        episode: The world.

    Raises:
        UsageError: If the base has no behavior `goal`, or as many axes as the world.
        ScenarioError: If the two do not fit.
    """
    places = [key_path(path) for path, behavior in behaviors_of(base) if isinstance(behavior, Goal)]
    if not places:
        raise UsageError(f"{base.name}: has no behavior goal, whose goals would be those of the benchmark")
    boxes: list[dict[str, Any]] = [
        {
            "shape": "box",
            "size": [0.5 * length for length in box.size],
            "position": box.center,
            "orientation": box.angle,
        }
        for box in episode.boxes
    ]
    axes = len(episode.start[0])
    if base.axes != axes:
        raise UsageError(f"{base.name}: has {base.axes} axes; the worlds have {axes}")
    boxes += [{"shape": "sphere", "radius": ball.radius, "position": ball.center} for ball in episode.balls]
    changes: dict[str, Any] = {
        "name": f"{base.name}_{episode.episode}",
        "seed": episode.episode,
        "duration": worlds.duration,
        "obstacles": boxes,
        "robots.count": worlds.robots,
        "robots.positions": episode.start,
        "robots.mass": worlds.mass,
        "robots.radius": worlds.robot_radius,
        **({} if worlds.environment == "CrazyFlie" else {"robots.force_limit": worlds.force_limit}),
        "sensing.radius.robots": worlds.sight - 2.0 * worlds.robot_radius,
        "sensing.radius.obstacles": worlds.sight - worlds.robot_radius,
        "expect": [],
        **{f"{place}.goals": episode.goal for place in places},
    }
    return base.replace(changes)


def judge(flight: Flight, worlds: Worlds, episode: BenchmarkEpisode) -> BenchmarkRow:
    """Judge an episode, agent by agent.

    Args:
        flight: With its trace.
        worlds: Gives the radius.
        episode: Which one.
    """
    trace = flight.recording
    if trace is None or not trace.sizes["time"]:
        return BenchmarkRow(
            episode.episode, flight.outcome.value, worlds.robots, 0, 0, 0, 0, None, np.nan, np.nan
        )
    goals = np.array(episode.goal, dtype=float)
    near = np.linalg.norm(trace["q"].values - goals, axis=2) < REACH * worlds.robot_radius
    safe = (trace["clearance"].values >= 0.0).all(axis=(0, 2))
    reached = near.any(axis=0)
    first = float(trace["time"].values[near.argmax(axis=0)].max())
    return BenchmarkRow(
        episode.episode,
        flight.outcome.value,
        worlds.robots,
        int(safe.sum()),
        int(reached.sum()),
        int((safe & reached).sum()),
        int(near[-1].sum()),
        first if reached.all() else None,
        float(trace["speed_max"].values.max()),
        float(np.abs(trace["v"].values).max()),
    )


def run_benchmark(
    worlds: Worlds, base: Scenario, threads: int, progress: Progress | None = None
) -> Benchmark:
    """Fly all episodes and judge them.

    Args:
        worlds: What to fly in.
        base: Gives behaviors, law and sensing.
        threads: How many episodes to fly at a time.
        progress: Is told how many are done, of how many.

    Raises:
        UsageError: If the base has no behavior `goal`.
        ScenarioError: If base and worlds do not fit.
    """
    rows = list(_rows(worlds, base, threads, progress))

    def share(name: str) -> Proportion:
        return share_of_worlds([getattr(row, name) for row in rows], [row.robots for row in rows])

    whole = [row.success == row.robots for row in rows]
    return Benchmark(
        worlds,
        rows,
        share("safe"),
        share("reached"),
        share("success"),
        proportion_of(whole, method="wilson"),
        PEERS.get((worlds.environment, worlds.robots, worlds.area, worlds.obstacles), ()),
    )


def _rows(worlds: Worlds, base: Scenario, threads: int, progress: Progress | None) -> Iterator[BenchmarkRow]:
    """Fly episodes and judge them, one after another."""
    missions = (mission_of(base, worlds, episode) for episode in worlds.episodes)
    flights = fly_many(missions, threads, traces=True)
    for done, (episode, flight) in enumerate(zip(worlds.episodes, flights, strict=True), 1):
        yield judge(flight, worlds, episode)
        if progress is not None:
            progress(done, len(worlds.episodes))
