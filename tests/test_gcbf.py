"""The worlds of GCBF+: as published and drawn; agents judged, made up and flown."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from benchmarks.gcbf import BASES, Worlds, drawn, flown, judge, mission, published, rows, share_of_worlds
from escort_mj.api import load_scenario
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.study.sweeps.statistics import proportion_of


def gaps(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points, axis=2) + 9.0 * np.eye(len(points))


@pytest.mark.parametrize(("source", "agents", "episodes"), [("n8", 8, 64), ("n32", 32, 32), (None, 12, 5)])
def test_worlds_obey_the_published_rules(source: str | None, agents: int, episodes: int) -> None:
    """Those that they drew, and ours: the geometry of boxes is that of missions, which checks ours."""
    worlds = published(source) if source else drawn("DoubleIntegrator", agents, 4.0, 8, episodes, 5)
    assert len(worlds.episodes) == episodes
    base = load_scenario("benchmarks/gcbf")
    for number, episode in enumerate(worlds.episodes[:5]):
        start, goal = np.array(episode["start"]), np.array(episode["goal"])
        assert start.shape == goal.shape == (agents, 2)
        assert min(start.min(), goal.min()) >= 0.0 and max(start.max(), goal.max()) <= 4.0
        assert min(gaps(start).min(), gaps(goal).min()) > 0.2 - 1e-5
        sides = np.array([box["size"] for box in episode["boxes"]])
        assert sides.shape == (8, 2) and 0.1 <= sides.min() and sides.max() <= 0.5
        scenario = mission(base, worlds, number)
        assert scenario.duration == pytest.approx(30.72)
        for body in obstacles_of(scenario):
            assert body.gaps(np.vstack([start, goal])).min() >= 0.2 - 1e-5
    if source is None:
        assert drawn("DoubleIntegrator", agents, 4.0, 8, episodes, 5) == worlds
        assert drawn("DoubleIntegrator", agents, 4.0, 8, episodes, 6).episodes[0] != worlds.episodes[0]


def test_goals_of_drawn_worlds_may_be_near():
    for episode in drawn("DoubleIntegrator", 32, 16.0, 8, 2, 3, travel=1.5).episodes:
        way = np.abs(np.array(episode["goal"]) - episode["start"])
        assert way.max() <= 1.5 and way.max() > 1.2


@pytest.mark.parametrize(
    ("environment", "least", "most", "mass", "sight"),
    [("LinearDrone", 0.075, 0.15, 0.1, 0.5), ("CrazyFlie", 0.05, 0.3, 0.0299, 1.0)],
)
def test_worlds_in_space(environment: str, least: float, most: float, mass: float, sight: float) -> None:
    worlds = drawn(environment, 8, 2.0, 8, 5, 5)
    base = load_scenario(BASES[environment])
    for number, episode in enumerate(worlds.episodes):
        start, goal = np.array(episode["start"]), np.array(episode["goal"])
        assert start.shape == goal.shape == (8, 3) and "boxes" not in episode
        assert min(gaps(start).min(), gaps(goal).min()) > 0.2
        radii = np.array([ball["radius"] for ball in episode["balls"]])
        assert radii.shape == (8,) and least <= radii.min() and radii.max() <= most
        scenario = mission(base, worlds, number)
        assert (scenario.robots.mass, scenario.sensing.radius.robots) == (mass, sight - 0.1)
        for body in obstacles_of(scenario):
            assert body.gaps(np.vstack([start, goal])).min() >= 0.2


def test_where_no_room_is_it_is_said_at_once() -> None:
    with pytest.raises(SystemExit, match="no room for 90 agents"):
        drawn("DoubleIntegrator", 90, 1.0, 0, 1, 0)


def test_agents_are_judged_one_by_one() -> None:
    """One that stays at its goal, one that passes by, one that touches for a step, one that never comes."""
    episode = {"goal": [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]}
    q = np.array(
        [[(0, 0.5), (1, 0.5), (2, 0.5), (3, 0.5)], [(0, 0.09), (1, 0.05), (2, 0.0), (3, 0.11)]] * 2, float
    )
    q[2:] = q[1]
    q[3, 1] = 1.0, 0.4
    clearance = np.full((4, 4, 2), 1.0)
    clearance[1, 2, 1] = -1e-6
    trace = xarray.Dataset(
        {
            "q": (("time", "robot", "axis"), q),
            "v": (("time", "robot", "axis"), np.full(q.shape, -0.3)),
            "clearance": (("time", "robot", "group"), clearance),
        },
        {"time": [0.0, 1.0, 2.0, 3.0]},
    )
    assert judge(SimpleNamespace(trace=trace, outcome=Outcome.COMPLETED), episode) == (3, 3, 2, 0.3)
    assert judge(SimpleNamespace(outcome=Outcome.DIVERGED), episode)[:3] == (0, 0, 0)


def test_worlds_are_flown(compiled: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two agents swap beside a box; the goal of a third one is too far away."""
    world = {
        "start": [[0.5, 0.5], [1.5, 0.52], [3.0, 1.0]],
        "goal": [[1.5, 0.5], [0.5, 0.5], [3.0, 9.0]],
        "boxes": [{"center": [1.0, 0.1], "size": [0.2, 0.2]}],
    }
    monkeypatch.setattr("benchmarks.gcbf.STEPS", 400)
    worlds = Worlds("DoubleIntegrator", [world])
    found = flown(worlds)
    assert found[0][:3] == (3, 2, 2) and found[0].speed_per_axis < 0.5
    (row,) = rows(worlds, found)
    assert row[:5] == ["DoubleIntegrator", "3", "here", "1", "100.0 (20.7 to 100.0)"]


def test_robots_of_one_world_are_one_observation() -> None:
    share, *interval = share_of_worlds([8] * 64, [8] * 64)
    assert share == 1.0 and interval == pytest.approx((0.9434, 1.0), abs=1e-4)  # Wilson, 64 of 64
    alone = [1, 0, 1, 1, 0, 1, 1]
    share, *interval = share_of_worlds(alone, [1] * 7)
    assert tuple(interval) == pytest.approx(proportion_of(alone, "wilson").interval)


def test_shares_of_worlds_are_covered_as_often_as_is_said() -> None:
    rng, covered = np.random.default_rng(5), 0
    for _ in range(400):  # of worlds that differ, robots in each much alike
        chances = rng.beta(8.0, 2.0, 30)
        _, low, high = share_of_worlds(rng.binomial(8, chances).tolist(), [8] * 30)
        covered += low <= 0.8 <= high
    assert covered >= 380
