"""What learners are shown, found by machine code, against the same in NumPy, from the samples of missions."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from escort_mj.api import load_scenario
from escort_mj.environments import Simulation
from escort_mj.environments.senses import Reward
from escort_mj.knowledge.observation import TEAMMATES
from escort_mj.memory.perception import BROKEN
from escort_mj.signals import columns

Array = NDArray[np.float64]
WALL = {"obstacles[0]": {"shape": "box", "size": [1.0, 4.0], "position": [7.0, 4.5]}}
CROWD = {"robots.count": 7, "robots.placement.within": 3.0, "robots.placement.least_gap": 0.1}
LIDAR = {"knowledge": {"target": {"robots": [1], "range": 3}}, "communication": {"range": 3, "rate": 50}}
NEAR = {"sensing.radius": {"robots": 4.0, "obstacles": 3.0}, "communication.range": 2.0}
CHANGES = {
    "robots.failures": [{"robot": 6, "at": 0.05, "notice": 0}],
    "teams[0].demand": [{"robots": 4}, {"after": 0.1, "robots": 3}],
    "teams[1].demand": [{"robots": 4}, {"after": 0.03, "robots": 5}],
}
MERGE = {
    "teams[0].radii": [{"after": 0.05, "radius": 2.6}],
    "teams[1].radii": [{"after": 0.04, "radius": 5.5}],
    "teams[0].targets[1].escorted_by": [{"after": 0.1, "team": "south"}],
    "teams[0].demand": [{"robots": 4}],
    "teams[1].demand": [{"after": 0.1, "robots": 5}],
}
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "spheres": ("main", {}),
    "shapes_and_force": ("main", WALL),
    "space": ("paper/case1_3d", {}),
    "crowd": ("main", CROWD),
    "alone_among_nothing": ("main", {"robots.count": 1, "obstacles": [], "mission.behaviors": ["surface"]}),
    "estimates": ("knowledge/blind", {}),
    "chain_in_space": ("knowledge/relay", {}),
    "what_is_near": ("knowledge/blind", NEAR),
    "without_sight": ("knowledge/crossing", {}),
    "lidar": ("knowledge/lidar", LIDAR),
    "only_lidar": ("knowledge/lidar", {}),
    "only_near": ("sensing", {}),
    "teams": ("pursuit/handover", CHANGES),
    "teams_that_change": ("pursuit/merge", MERGE),
    "teams_and_opponents": ("pursuit/raid", {"opponents[0].start": 0.0, "opponents[0].distance": 9.0}),
}


class Samples:
    """A mission's samples, shape (k, size), by names of signals."""

    def __init__(self, simulation: Simulation, rows: Array) -> None:
        self.rows, self.sizes = rows, simulation.world.sizes

    def __getitem__(self, name: str) -> Array:
        return self.rows[:, columns(name, self.sizes)].reshape(len(self.rows), -1)


def teammates(simulation: Simulation, samples: Samples) -> Array:
    """Where each robot knows itself and its teammates to be, NaN for other robots, shape (n, n, p)."""
    setup, state = simulation.world.setup, simulation.plant.state
    n, p = simulation.count, simulation.axes
    places = np.broadcast_to(samples["q_measured"].reshape(n, p), (n, n, p)).copy()
    if setup.teams:
        places[samples["member_of"].T != samples["member_of"]] = np.nan
    if setup.radio is not None:
        places[~np.eye(n, dtype=bool)] = np.nan
        age = (round(simulation.time / setup.timestep) - state.link_step) * setup.timestep
        carried = age.reshape(-1, 1) * state.heard_velocity
        heard = (state.heard_position + carried).reshape(n, -1, p)
        for i, row in enumerate(samples["heard_from"].reshape(n, -1).astype(int)):
            places[i, row[row > 0] - 1] = heard[i, row > 0]
    if setup.apart:
        places[:, samples["lost"][0] > 0] = np.nan
    return places


def observed(simulation: Simulation, rows: Array) -> Array:
    """What robots observe in the last sample, shape (n, width)."""
    samples, setup = Samples(simulation, rows[-1:]), simulation.world.setup
    n, p = simulation.count, simulation.axes
    q = samples["q_measured"].reshape(n, p)
    speed = setup.max_speed if np.isfinite(setup.max_speed) else 2.0
    parts = np.zeros((n, 4 + min(n - 1, TEAMMATES) + 2 * bool(setup.opponents), p))
    center, velocity = samples["target_position_measured"], samples["target_velocity_measured"]
    radius = np.full((n, 1), setup.radius)
    if setup.estimating:
        center, velocity = (samples[f"target_{name}estimate"].reshape(n, p) for name in ("", "velocity_"))
    if setup.teams:
        member = samples["member_of"][0].astype(int) - 1
        center, velocity = (samples[f"team_{name}"].reshape(-1, p)[member] for name in ("center", "velocity"))
        radius = samples["team_radius"][0, member, None]
    parts[:, 0] = (center - q) / radius
    parts[:, 1] = velocity / speed
    parts[:, 2] = samples["v_measured"].reshape(n, p) / speed
    mates = teammates(simulation, samples)
    m = len(setup.obstacle_radius)
    places = np.broadcast_to(samples["obstacle_position"].reshape(1, m, p), (n, m, p))
    if setup.shaped:
        places = simulation.plant.state.obstacle_point.reshape(-1, m, p)[:n]
    if setup.sensing.lidar:
        places = simulation.plant.state.lidar_point.reshape(n, m, p)
    sizes = np.append(setup.seen_radius, setup.robot_radius)
    far = np.full((n, m + n), setup.sensing.obstacles)
    far[:, m:] = np.where(np.isnan(mates).any(axis=2), setup.sensing.robots, -np.inf)
    if any(getattr(each, "teammates", None) == "heard" for each in setup.behaviors):
        far[:, m:] = -np.inf
    far[:, m:][np.eye(n, dtype=bool)] = -np.inf
    ways = np.concatenate([places, np.broadcast_to(q, (n, n, p))], axis=1) - q[:, None]
    length = np.linalg.norm(ways, axis=2)
    gap = length - sizes - np.asarray(setup.robot_radius).reshape(-1, 1)
    gap = np.where((gap <= far) & (length < 1e7), gap, np.inf)
    for i in np.flatnonzero(np.isfinite(gap).any(axis=1)):
        worst = gap[i].argmin()
        parts[i, 3] = ways[i, worst] * (gap[i, worst] / length[i, worst]) / radius[i]
    for i in range(n):
        others = np.delete(mates[i], i, axis=0) - q[i]
        others = others[np.isfinite(others).all(axis=1)]
        nearest = np.argsort(np.linalg.norm(others, axis=1), kind="stable")[:TEAMMATES]
        parts[i, 4 : 4 + len(nearest)] = others[nearest] / radius[i]
    if setup.opponents:
        coming = samples["opponent_status"][0] == 1.0
        first = m - len(coming)
        theirs = samples["obstacle_position"].reshape(m, p)[first:][coming]
        speeds = simulation.plant.state.obstacle_velocity[first:][coming]
        if len(theirs):
            nearest = np.linalg.norm(theirs - q[:, None], axis=2).argmin(axis=1)
            parts[:, -2], parts[:, -1] = (theirs[nearest] - q) / radius, speeds[nearest] / speed
    return parts.reshape(n, -1)


def rewards(simulation: Simulation, rows: Array, commanded: Array, reward: Reward) -> Array:
    """Reward of each robot, shape (n,)."""
    samples, setup = Samples(simulation, rows[-1:]), simulation.world.setup
    n, p = commanded.shape
    q, center, radius = samples["q"].reshape(n, p), samples["target_position"], np.full(n, setup.radius)
    nearest, even = samples["robot_distance_min"][0], np.full(n, setup.edges[1].min(initial=np.inf))
    if setup.teams:
        member, lost = samples["member_of"][0].astype(int) - 1, samples["lost"][0] > 0.0
        center = samples["team_center"].reshape(-1, p)[member]
        radius = samples["team_radius"][0, member]
        left = np.array([np.sum((member == own) & ~lost) for own in member])
        even = 2.0 * radius * np.sin(np.pi / left)  # chord of a regular polygon
        apart = np.linalg.norm(q[:, None] - q, axis=2)
        apart[(member[:, None] != member) | lost | lost[:, None] | np.eye(n, dtype=bool)] = np.inf
        nearest = apart.min(axis=1)
    distance = np.linalg.norm(q - center, axis=1)
    clearance = Samples(simulation, rows)["clearance"].reshape(len(rows), n, -1).min(axis=(0, 2))
    found = -reward.radius * np.abs(distance - radius) / radius
    if np.isfinite(even).all():
        found -= reward.spacing * np.maximum(1.0 - nearest / even, 0.0)
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
    window |= {"team": "north"} if case.startswith("teams") else {}
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
    assert simulation.fleet.senses.sound.all()
    if case == "teams":
        assert (simulation.plant.state.member_of != [1, 1, 1, 1, 1, 2, 2, 2, 2]).sum() == 2


def test_what_is_wrong_anywhere_in_a_record_is_noticed() -> None:
    simulation = Simulation("main")
    simulation.reset()
    senses, state = simulation.fleet.senses, simulation.plant.state
    for signal, value, sound in [
        ("clearance", np.nan, 0.0),
        ("disturbance", np.inf, 0.0),
        ("clearance", np.inf, 1.0),
        ("q", simulation.session.bound, 0.0),
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
