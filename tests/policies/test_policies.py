"""Policies: both forms alike, closed forms, and what a body with a policy does in MuJoCo."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from escort_mj import Run, Scenario, load_scenario, run
from escort_mj.components.setup import Mover
from escort_mj.conformance.checking import check_plugin
from escort_mj.memory.layout import unpack_plan
from escort_mj.policies import POLICIES, Policy
from escort_mj.policies.body import policy_view
from escort_mj.policies.burst import Burst
from escort_mj.policies.flee import Flee
from escort_mj.policies.learned import Learned, inputs
from escort_mj.scenario.mission import Mission
from tests.control.twins import Kernel
from tests.oracle.policies import freest, possible_directions, velocity

Array = NDArray[np.float64]
STEPS = 60
SHORT = {"wait": 0.05, "dash": 0.04, "interval": 0.03, "reach": 1.0}


def quick(kind: type[Policy], axes: int) -> Policy:
    """A policy that changes its mind within a few steps."""
    given: dict[str, object] = {key: value for key, value in SHORT.items() if key in kind.model_fields}
    if kind is Learned:
        dice, widths = np.random.default_rng(axes), (inputs(axes), 9, 7, axes)
        given["network"] = [
            {"weights": dice.normal(size=(rows, columns)).tolist(), "bias": dice.normal(size=rows).tolist()}
            for columns, rows in pairwise(widths)
        ]
    return kind.model_validate({"speed": 1.5} | given)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("kind", POLICIES, ids=lambda kind: kind.__name__)
def test_both_forms_want_the_same(kind: type[Policy], axes: int) -> None:
    random = np.random.default_rng(axes)
    scenario = Scenario(
        axes=axes, target={"position": [0.0] * axes, "body": {"mass": 2.0}}, robots={"count": 5},
        obstacles=[{"motion": {"position": [9.0] + [0.0] * (axes - 1)}, "radius": 0.3}],
    )  # fmt: skip
    setup = Mission(scenario).setup
    policy, (obstacle, target) = quick(kind, axes), setup.movers
    kernel = Kernel(replace(setup, movers=(Mover(*obstacle[:5], policy), target)))
    state, memory = kernel.state, np.zeros((2, 8))
    seen_own = SimpleNamespace(**policy_view(state)._asdict())
    seen_own.mover_memory, seen_own.mover_wish = memory, np.zeros((2, axes))
    for step in range(STEPS):
        state.mover_position[:] = random.normal(scale=3.0, size=(2, axes))
        kernel.evaluate(step * setup.timestep, random.normal(scale=3.0, size=(5, axes)), np.zeros((5, axes)))
        assert velocity(policy, seen_own, 0) == state.mover_acts[0]
        assert np.abs(seen_own.mover_wish[0] - state.mover_wish[0]).max() < 1e-10
        kept = state.policy_memory
        assert np.abs(memory[0, : len(kept)] - kept).max(initial=0.0) < 1e-10
    assert np.linalg.norm(state.mover_wish[0]) <= 1.5 + 1e-12
    assert not unpack_plan(kernel.packed.ctypes.data, axes).mover_policy[1] >= 0


@pytest.mark.parametrize("axes", [2, 3])
def test_the_freest_direction_halves_the_largest_gap(axes: int) -> None:
    random = np.random.default_rng(5)
    others, here, tried = random.normal(size=(6, axes)), np.full(axes, 0.1), random.normal(size=(20000, axes))
    ways = (others - here) / np.linalg.norm(others - here, axis=1, keepdims=True)
    clear = np.arccos((ways @ freest(here, others, 1)).max())
    tried /= np.linalg.norm(tried, axis=1, keepdims=True)
    best = np.arccos((tried @ ways.T).max(axis=1)).max()
    assert best - (0.01 if axes == 2 else 0.07) < clear < best + 0.04


def test_directions_are_even() -> None:
    for axes, apart in ((2, 2 * np.pi / 360), (3, 0.08)):
        found = possible_directions(axes)
        assert np.allclose(np.linalg.norm(found, axis=1), 1.0)
        cosine = found @ found.T - 2.0 * np.eye(len(found))
        nearest = np.arccos(np.clip(cosine.max(axis=1), -1, 1))
        assert 0.8 * apart < nearest.min() and nearest.max() < 2.0 * apart


def test_the_longest_way_in_the_cell_ends_where_a_robot_is_as_near() -> None:
    here, others = np.zeros(2), np.array([[2.0, 0.0], [-1.0, 1.5], [-1.0, -1.8]])
    u = freest(here, others, 2)
    most = (others @ u / np.sum(others**2, axis=1)).max()
    corner = u / (2.0 * most)
    assert np.linalg.norm(others - corner, axis=1).min() == pytest.approx(np.linalg.norm(corner), rel=1e-9)
    sampled = np.random.default_rng(0).uniform(-3, 3, (4000, 2))
    inside = (
        np.linalg.norm(others[None] - sampled[:, None], axis=2) > np.linalg.norm(sampled, axis=1)[:, None]
    ).all(1)
    assert np.linalg.norm(sampled[inside], axis=1).max() < np.linalg.norm(corner) + 0.02


def alone(policy: dict[str, object], body: dict[str, float], duration: float = 2.0) -> Array:
    """Positions over time of a target with a policy whose only robot is out of its reach."""
    found = run(
        Scenario(
            duration=duration, target={"policy": policy, "body": body, "radius": 0.2},
            robots={"count": 1, "positions": [[-3.0, 0.0]], "mass": 1e6, "force_limit": 1e-3},
            mission={"behaviors": ["surface"], "radius": 3.0}, recording={"rate": 500},
        )
    )  # fmt: skip
    return np.asarray(found.trace.target_position.values)


def test_a_dash_accelerates_as_its_force_allows() -> None:
    place = alone({"policy": "burst", "speed": 50.0, "wait": 0.0}, {"mass": 2.0, "force_limit": 3.0})
    t = np.arange(len(place)) * 0.002
    assert place[-1, 0] == pytest.approx(0.5 * 1.5 * t[-1] ** 2, rel=3e-3)  # F / m = 1.5 m/s^2
    assert abs(place[-1, 1]) < 0.01 * place[-1, 0]


def test_drag_limits_the_speed() -> None:
    place = alone(
        {"policy": "flee", "speed": 50.0, "sight": 1e3}, {"mass": 1.0, "force_limit": 3.0, "drag": 2.0}, 6.0
    )
    assert (place[-1, 0] - place[-101, 0]) / 0.2 == pytest.approx(1.5, rel=1e-3)  # F / drag


def test_a_dash_waits_first() -> None:
    place = alone({"policy": "burst", "speed": 1.0, "wait": 1.0}, {"mass": 1.0, "force_limit": 100.0})
    assert not place[:499].any() and place[-1, 0] == pytest.approx(1.0, abs=0.02)


def led(leader: list[object], start: list[float], speed: float = 5.0) -> Array:
    """Positions over time of a target that follows an obstacle 2 m behind, shape (k, 2); k / 100 s."""
    policy = {"policy": "follow", "leader": "lead", "distance": 2, "speed": speed}
    found = run(Scenario(
        duration=4.0, recording={"rate": 100}, robots={"count": 1, "positions": [[-20.0, 0.0]]},
        target={"position": start, "policy": policy},
        obstacles=[{"name": "lead", "motion": {"position": leader}, "radius": 0.3}],
        mission={"behaviors": ["surface"], "radius": 20.0},
    ))  # fmt: skip
    return np.asarray(found.trace.target_position.values)


def test_a_follower_is_drawn_along_a_tractrix() -> None:
    place = led(["0.8*t", 0.0], [0.0, -2.0])
    way = 0.8 * 0.01 * np.arange(len(place)) / 2.0
    expected = 2.0 * np.column_stack([way - np.tanh(way), -1.0 / np.cosh(way)])
    assert np.abs(place - expected).max() < 0.01


def test_a_follower_keeps_its_distance() -> None:
    place = led([0.0, 0.0], [-5.0, 0.0], speed=50.0)
    left = place[50:, 0] + 2.0  # 3 m at first: gain 2, and at most 20 N on 1 kg
    assert np.diff(np.log(-left)) == pytest.approx(-2.0 * 0.01, rel=0.02)
    assert led([0.0, 0.0], [-1.0, 0.0])[-1, 0] == pytest.approx(-2.0, abs=0.01)  # it makes way
    assert led(["2*t", 0.0], [-2.0, 0.0], speed=1.0)[-1, 0] == pytest.approx(2.0, abs=0.05)  # it falls behind


def test_a_body_with_a_policy_is_light_unless_it_has_a_mass() -> None:
    for table, mass in (({}, 1000.0), ({"policy": "wander"}, 1.0), ({"policy": "wander", "mass": 3.0}, 3.0)):
        body = {"body": {"mass": table["mass"]} if "mass" in table else {}}
        policy = {"policy": table["policy"]} if "policy" in table else {}
        (mover,) = Mission(Scenario(target=policy | body)).setup.movers
        assert mover.mass == mass


PLUGIN = """
from typing import Literal
from escort_mj.plugins import Policy, unit_axis


class East(Policy):
    'Always east.'

    policy: Literal["east"] = "east"

    def velocity(self, r):
        return WISH * unit_axis(r.q, 0)
"""


def flown(folder: Path, wish: str) -> Run:
    (folder / "east.py").write_text(PLUGIN.replace("WISH", wish))
    text = "plugins: [east.py]\ntarget: {policy: {policy: east, speed: 2.0}}\nduration: 1\n"
    (folder / "mission.yaml").write_text(text)
    return run(load_scenario(folder / "mission.yaml"))


def test_a_plugin_has_a_policy(hurried: None, tmp_path: Path) -> None:
    found = flown(tmp_path, "self.speed")
    assert found.trace.target_position.values[-1, 0] == pytest.approx(1.9, abs=0.01)  # 20 N on 1 kg for 0.1 s
    (row,) = [row for row in check_plugin(str(tmp_path / "east.py")) if row.name == "keeps to its speed"]
    assert row.held


def test_a_plugin_has_a_policy_for_opponents_and_targets_of_teams(tmp_path: Path) -> None:
    (tmp_path / "east.py").write_text(PLUGIN.replace("WISH", "self.speed"))
    team = "{name: one, robots: [1, 2, 3, 4, 5], targets: [{name: a, policy: east}]}"
    text = f"plugins: [east.py]\ntarget: null\nopponents: [{{policy: east}}]\nteams: [{team}]\n"
    (tmp_path / "mission.yaml").write_text(text)
    setup = Mission(load_scenario(tmp_path / "mission.yaml")).setup
    assert [mover.policy and mover.policy.policy for mover in setup.movers] == ["east", "east"]


def test_a_plugin_whose_policy_fails_says_where(tmp_path: Path) -> None:
    found = flown(tmp_path, "1 // int(r.time < 0.1)")
    assert found.outcome.value == "failed" and "east.py:12: ZeroDivisionError" in found.message


def test_nobody_in_sight_is_no_alarm() -> None:
    assert not alone({"policy": "flee", "sight": 1.0}, {"mass": 1.0}, 0.2).any()
    assert (Flee().sight, Burst().wait) == (5.0, 5.0)
