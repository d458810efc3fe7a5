"""The GCBF+ benchmark: worlds as published, drawn and read; agents judged, made up and flown."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from escort_mj.api import benchmarks, load_scenario
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.study.benchmark.gcbf import BASES, PEERS, judge, mission_of
from escort_mj.study.benchmark.worlds import BenchmarkEpisode, draw_worlds, read_worlds


def gaps(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points, axis=2) + 9.0 * np.eye(len(points))


@pytest.mark.parametrize(("source", "agents", "episodes"), [("n8", 8, 64), ("n32", 32, 32), (None, 12, 5)])
def test_worlds_obey_the_published_rules(source: str | None, agents: int, episodes: int) -> None:
    """Those that they drew, and ours: the geometry of boxes is that of missions, which checks ours."""
    worlds = read_worlds(source) if source else draw_worlds(agents, 4.0, 8, episodes, seed=5)
    assert len(worlds.episodes) == episodes and worlds.duration == pytest.approx(30.72)
    base = load_scenario("benchmarks/gcbf")
    for episode in worlds.episodes[:5]:
        start, goal = np.array(episode.start), np.array(episode.goal)
        assert start.shape == goal.shape == (agents, 2)
        assert min(start.min(), goal.min()) >= 0.0 and max(start.max(), goal.max()) <= 4.0
        assert min(gaps(start).min(), gaps(goal).min()) > 0.2 - 1e-5
        sides = np.array([box.size for box in episode.boxes])
        assert sides.shape == (8, 2) and 0.1 <= sides.min() and sides.max() <= 0.5
        for body in obstacles_of(mission_of(base, worlds, episode)):
            assert body.gaps(np.vstack([start, goal])).min() >= 0.2 - 1e-5
    if source is None:
        assert draw_worlds(agents, 4.0, 8, episodes, seed=5) == worlds
        assert draw_worlds(agents, 4.0, 8, episodes, seed=6).episodes[0] != worlds.episodes[0]


def test_goals_of_drawn_worlds_may_be_near():
    for episode in draw_worlds(32, 16.0, 8, 2, seed=3, travel=1.5).episodes:
        way = np.abs(np.array(episode.goal) - episode.start)
        assert way.max() <= 1.5 and way.max() > 1.2


@pytest.mark.parametrize(
    ("environment", "least", "most"), [("LinearDrone", 0.075, 0.15), ("CrazyFlie", 0.05, 0.3)]
)
def test_worlds_in_space(environment: str, least: float, most: float) -> None:
    worlds = draw_worlds(8, 2.0, 8, 5, seed=5, environment=environment)
    base = load_scenario(BASES[environment])
    assert worlds.environment == environment and PEERS[environment, 8, 2.0, 8]
    for episode in worlds.episodes:
        start, goal = np.array(episode.start), np.array(episode.goal)
        assert start.shape == goal.shape == (8, 3) and not episode.boxes
        assert min(gaps(start).min(), gaps(goal).min()) > 0.2
        radii = np.array([ball.radius for ball in episode.balls])
        assert radii.shape == (8,) and least <= radii.min() and radii.max() <= most
        scenario = mission_of(base, worlds, episode)
        assert (scenario.robots.mass, scenario.sensing.radius.robots) == (worlds.mass, worlds.sight - 0.1)
        for body in obstacles_of(scenario):
            assert body.gaps(np.vstack([start, goal])).min() >= 0.2
    with pytest.raises(UsageError, match="gcbf: has 2 axes; the worlds have 3"):
        mission_of(load_scenario("benchmarks/gcbf"), worlds, worlds.episodes[0])
    with pytest.raises(UsageError, match='environment: found "Dubins"; allowed are DoubleIntegrator, '):
        draw_worlds(8, 2.0, 8, 5, seed=5, environment="Dubins")


def test_agents_are_judged_one_by_one() -> None:
    """One that stays at its goal, one that passes by, one that touches for a step, one that never comes."""
    goals = ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0))
    q = np.array(
        [[(0, 0.5), (1, 0.5), (2, 0.5), (3, 0.5)], [(0, 0.09), (1, 0.05), (2, 0.0), (3, 0.11)]] * 2, float
    )
    q[2:] = q[1]
    q[3, 1] = 1.0, 0.4
    clearance = np.full((4, 4, 2), 1.0)
    clearance[1, 2, 1] = -1e-6
    recording = xarray.Dataset(
        {
            "q": (("time", "robot", "axis"), q),
            "v": (("time", "robot", "axis"), np.full(q.shape, -0.3)),
            "clearance": (("time", "robot", "group"), clearance),
            "speed_max": (("time", "robot"), np.full((4, 4), 0.5)),
        },
        {"time": [0.0, 1.0, 2.0, 3.0]},
    )
    flight = SimpleNamespace(recording=recording, outcome=Outcome.COMPLETED)
    worlds = draw_worlds(4, 4.0, 0, 1, seed=0)
    row = judge(flight, worlds, BenchmarkEpisode(start=goals, goal=goals))  # type: ignore[arg-type]
    assert row[1:] == ("completed", 4, 3, 3, 2, 2, None, 0.5, 0.3)
    recording["q"][3, 3] = [3.0, 0.0]
    assert judge(flight, worlds, BenchmarkEpisode(start=goals, goal=goals)).makespan == 3.0  # type: ignore[arg-type]


def test_a_file_of_worlds_is_flown(tmp_path: Path, compiled: None) -> None:
    """Two agents swap beside a box; the goal of a third one is too far away."""
    world = {
        "start": [[0.5, 0.5], [1.5, 0.52], [3.0, 1.0]],
        "goal": [[1.5, 0.5], [0.5, 0.5], [3.0, 9.0]],
        "boxes": [{"center": [1.0, 0.1], "size": [0.2, 0.2]}],
    }
    file = tmp_path / "worlds.json"
    file.write_text(json.dumps({"robots": 3, "obstacles": 1, "steps": 400, "episodes": [world, world]}))
    found = benchmarks.gcbf(file, episodes=1, workers=1, progress=False)
    assert (found.reach.times, found.reach.of, len(found.rows)) == (2, 3, 1)
    assert found.safe.times == 3 and found.episodes.times == 0
    low, high = (
        found.success.interval
    )  # Wilson, by hand: (p + z^2/2n -+ z sqrt(p q/n + z^2/4n^2)) / (1 + z^2/n), of n = 1 episode
    z2 = 1.959963984540054**2
    middle, half = 2 / 3 + z2 / 2, np.sqrt(z2 * (2 / 9 + z2 / 4))
    np.testing.assert_allclose([low, high], [(middle - half) / (1 + z2), (middle + half) / (1 + z2)])
    document = found.document()
    assert json.loads(json.dumps(document))["rows"][0]["robots"] == 3
    assert document["peers"] == [] and found.rows[0].speed_per_axis < 0.5


@pytest.mark.parametrize(
    ("content", "error", "message"),
    [
        ("nonsense", UsageError, "cannot be read as JSON"),
        ('{"robots": 2, "episodes": []}', ScenarioError, "episodes: found an empty list"),
        ('{"robots": 2, "episodes": [{"start": [[0, 0]], "goal": [[1, 1], [2, 2]]}]}', ScenarioError,
         r"episodes\[0\].start: found 1 points; expected 2"),
        ('{"robots": 1, "episodes": [{"start": [[0, "x"]], "goal": [[1, 1]]}]}', ScenarioError,
         r'episodes\[0\].start\[0\]\[1\]: found "x"; expected a number'),
    ],
)  # fmt: skip
def test_bad_worlds(content: str, error: type[Exception], message: str, tmp_path: Path) -> None:
    file = tmp_path / "worlds.json"
    file.write_text(content)
    with pytest.raises(error, match=message):
        benchmarks.gcbf(file)


def test_bad_calls() -> None:
    with pytest.raises(UsageError, match="there is no such file; shipped worlds are n8, n32"):
        benchmarks.gcbf("n9")
    with pytest.raises(UsageError, match="found both"):
        benchmarks.gcbf("n8", agents=3)
    with pytest.raises(UsageError, match="main: has no behavior goal"):
        benchmarks.gcbf("n8", episodes=1, scenario="main", workers=1, progress=False)
    with pytest.raises(UsageError, match="no room for 90 agents"):
        draw_worlds(90, 1.0, 0, 1, seed=0)
