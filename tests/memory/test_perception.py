"""What learners are shown, found by machine code, against the same in NumPy, from the samples of missions."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from escort_mj.api import load_scenario
from escort_mj.environments import Simulation
from escort_mj.environments.senses import Reward
from escort_mj.memory.perception import BROKEN, TEAMMATES
from escort_mj.signals import columns

Array = NDArray[np.float64]
WALL = {"obstacles[0]": {"shape": "box", "size": [1.0, 4.0], "position": [7.0, 4.5]}}
CROWD = {"robots.count": 7, "robots.placement.within": 3.0, "robots.placement.least_gap": 0.1}
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "spheres": ("main", {}),
    "shapes_and_force": ("main", WALL),
    "space": ("paper/case1_3d", {}),
    "crowd": ("main", CROWD),
    "alone_among_nothing": ("main", {"robots.count": 1, "obstacles": [], "mission.behaviors": ["surface"]}),
}


class Samples:
    """A mission's samples, shape (k, size), by names of signals."""

    def __init__(self, simulation: Simulation, rows: Array) -> None:
        self.rows, self.sizes = rows, simulation.world.sizes

    def __getitem__(self, name: str) -> Array:
        return self.rows[:, columns(name, self.sizes)].reshape(len(self.rows), -1)


def observed(simulation: Simulation, rows: Array) -> Array:
    """What robots observe in the last sample, shape (n, width)."""
    samples, setup = Samples(simulation, rows[-1:]), simulation.world.setup
    n, p = simulation.count, simulation.axes
    q = samples["q_measured"].reshape(n, p)
    speed = setup.max_speed if np.isfinite(setup.max_speed) else 2.0
    parts = np.zeros((n, 4 + min(n - 1, TEAMMATES), p))
    parts[:, 0] = (samples["target_position_measured"] - q) / setup.radius
    parts[:, 1] = samples["target_velocity_measured"] / speed
    parts[:, 2] = samples["v_measured"].reshape(n, p) / speed
    if m := len(setup.obstacle_radius):
        points = samples["obstacle_position"].reshape(1, m, p)
        if setup.shaped:
            points = simulation.plant.state.obstacle_point.reshape(-1, m, p)[:n]
        ways = points - q[:, None]
        length = np.linalg.norm(ways, axis=2)
        gap = length - setup.obstacle_radius - np.asarray(setup.robot_radius).reshape(-1, 1)
        worst = np.arange(n), gap.argmin(axis=1)
        parts[:, 3] = ways[worst] * (gap[worst] / length[worst])[:, None] / setup.radius
    for i in range(n):
        others = np.delete(q, i, axis=0) - q[i]
        nearest = np.argsort(np.linalg.norm(others, axis=1), kind="stable")[:TEAMMATES]
        parts[i, 4:] = others[nearest] / setup.radius
    return parts.reshape(n, -1)


def rewards(simulation: Simulation, rows: Array, commanded: Array, reward: Reward) -> Array:
    """Reward of each robot, shape (n,)."""
    samples, setup = Samples(simulation, rows[-1:]), simulation.world.setup
    n, p = commanded.shape
    distance = np.linalg.norm(samples["q"].reshape(n, p) - samples["target_position"], axis=1)
    clearance = Samples(simulation, rows)["clearance"].reshape(len(rows), n, -1).min(axis=(0, 2))
    found = -reward.radius * np.abs(distance - setup.radius) / setup.radius
    if n > 1:
        lack = 1.0 - samples["robot_distance_min"][0] / setup.edges[1].min()
        found -= reward.spacing * np.maximum(lack, 0.0)
    found -= reward.command * (commanded**2).mean(axis=1)
    safe = max((getattr(each, "safe_distance", 0.0) for each in setup.behaviors), default=0.0)
    if safe:
        found -= reward.clearance * np.clip(1.0 - clearance / safe, 0.0, 1.0)
    return np.asarray(found - reward.touch * (clearance <= 0.0))


@pytest.mark.parametrize("case", CASES)
def test_machine_code_and_numpy_agree(case: str) -> None:
    name, changes = CASES[case]
    reward = Reward(radius=1.3, spacing=0.7, command=0.2, clearance=0.9, touch=11.0)
    window = {"metric": "radius_error_mean", "at_most": 100.0, "after": 0.031, "before": 0.05}
    scenario = load_scenario(name, {"duration": 0.2, "expect": [window], **changes})
    simulation = Simulation(scenario, "force" if case == "shapes_and_force" else "velocity", reward)
    simulation.reset(seed=2)
    dice, several = np.random.default_rng(3), 0
    for _ in range(8):
        commanded = dice.uniform(-1.0, 1.0, (simulation.count, simulation.axes))
        found = simulation.step(commanded)
        rows = simulation.samples(simulation.commands - 1)
        several += len(rows) > 1
        np.testing.assert_allclose(found, rewards(simulation, rows, commanded, reward), rtol=1e-12)
        np.testing.assert_allclose(simulation.observe(), observed(simulation, rows), rtol=1e-11, atol=1e-13)
    assert several
    assert simulation._senses.sound.all()


def test_what_is_wrong_anywhere_in_a_record_is_noticed() -> None:
    simulation = Simulation("main")
    simulation.reset()
    senses, state = simulation._senses, simulation.plant.state
    for signal, value, sound in [
        ("clearance", np.nan, 0.0),
        ("disturbance", np.inf, 0.0),
        ("clearance", np.inf, 1.0),
        ("q", simulation._bound, 0.0),
    ]:
        place = getattr(state, signal).reshape(-1)[:1]
        before = place.copy()
        place[:] = value
        senses.perceive(0)
        assert senses.sound.all() == bool(sound), signal
        place[:] = before
    state.q[0] = np.nan
    senses.perceive(0)
    assert senses.rewards[0, 0] == BROKEN and senses.rewards[0, 1] > BROKEN
