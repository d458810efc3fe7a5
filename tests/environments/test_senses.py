"""What robots observe where each knows only what it sees and hears, and where each has a team of its own."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from escort_mj import Scenario, load_scenario
from escort_mj.environments import Simulation
from escort_mj.errors import UsageError

Array = NDArray[np.float64]
SHORT: dict[str, Any] = {"duration": 1.0, "expect": []}
TARGET, NEAREST, TEAMMATES = slice(0, 4), slice(6, 8), slice(8, None)  # columns in the plane


def flown(scenario: Scenario, pushed: tuple[int, ...] = ()) -> Array:
    """What robots observe while all rest but those that are pushed, shape (commands, n, width)."""
    simulation = Simulation(scenario)
    simulation.reset(seed=4)
    command = np.zeros((simulation.count, simulation.axes))
    command[[*pushed]] = 0.5
    found = [simulation.observe()]
    for _ in range(40):
        simulation.step(command)
        found.append(simulation.observe())
    return np.array(found)


def same_by_robot(one: Array, other: Array) -> list[bool]:
    return [np.array_equal(one[:, i], other[:, i]) for i in range(one.shape[1])]


def test_a_robot_that_neither_sees_nor_hears_of_the_target_observes_nothing_of_where_it_goes() -> None:
    changes = SHORT | {"communication": {"graph": {"edges": [[1, 2], [3, 4]]}, "rate": 50}}
    scenario = load_scenario("knowledge/blind", changes)  # robot 1 sees the target
    there, elsewhere = (flown(scenario.replace({"target.position": [0, path]})) for path in ("0", "t**2"))
    assert same_by_robot(there, elsewhere) == [False, False, True, True, True]


def test_a_robot_observes_teammates_as_it_hears_them() -> None:
    changes = SHORT | {"communication": {"graph": {"edges": [[1, 2], [2, 3]]}, "rate": 50}}
    changes |= {"mission.behaviors[0].teammates": "heard"}
    scenario = load_scenario("knowledge/crossing", changes)
    rest, moved = flown(scenario), flown(scenario, pushed=(2,))
    assert same_by_robot(rest, moved) == [True, False, False, *[True] * 5]
    assert not rest[:, 3:, TEAMMATES].any()  # they hear nobody
    assert rest[-1, 1, TEAMMATES][:4].any() and not rest[-1, 1, TEAMMATES][4:].any()  # it hears two


def test_a_robot_that_is_seen_but_not_heard_is_a_body_to_keep_away_from() -> None:
    changes = SHORT | {"communication": {"graph": {"edges": [[1, 2]]}}, "obstacles": []}
    scenario = load_scenario("knowledge/blind", changes | {"sensing": {}})
    simulation = Simulation(scenario)
    simulation.reset(seed=4)
    q, seen = simulation.plant.state.q, simulation.observe()
    gap = np.linalg.norm(q - q[4], axis=1)[:4].min() - 2.0 * simulation.world.setup.robot_radius[0]
    assert np.linalg.norm(seen[4, NEAREST]) * 3.0 == pytest.approx(gap)
    nothing = Simulation(scenario.replace({"sensing.radius.robots": 0.8}))
    nothing.reset(seed=4)
    assert not nothing.observe()[:, NEAREST].any()


def test_with_perfect_knowledge_and_radio_robots_observe_what_they_do_without() -> None:
    changes = SHORT | {"sensing": {}, "knowledge": None, "communication": None}
    plain = load_scenario("knowledge/blind", changes)
    perfect = plain.replace({"knowledge": {}, "communication": {}})
    assert perfect.knowledge is not None and perfect.communication is not None
    np.testing.assert_array_equal(flown(perfect, (1,)), flown(plain, (1,)))


def test_observations_and_rewards_are_of_the_team_that_a_robot_is_in_now() -> None:
    changes = SHORT | {"teams[1].demand": [{"robots": 4}, {"after": 0.4, "robots": 5}]}
    simulation = Simulation(load_scenario("pursuit/handover", changes | {"teams[1].radius": 3.0}))
    simulation.reset()
    state, before = simulation.plant.state, None
    for _ in range(40):
        rewards = simulation.step()
        own = state.member_of.astype(int) - 1
        center, radius = state.team_center[own], np.array([2.5, 3.0])[own, None]
        np.testing.assert_allclose(simulation.observe()[:, :2], (center - state.q) / radius, atol=1e-12)
        shown = simulation.observe()[:, TEAMMATES].reshape(9, 4, 2)
        mates = [
            sorted(np.linalg.norm(state.q[own == team] - q, axis=1))[1:5]
            for q, team in zip(state.q, own, strict=True)
        ]
        for row, distances, each in zip(shown, mates, radius, strict=True):
            found = np.linalg.norm(row, axis=1) * each
            np.testing.assert_allclose(found[: len(distances)], distances)
            assert not found[len(distances) :].any()
        off = np.abs(np.linalg.norm(state.q - center, axis=1) - radius[:, 0]) / radius[:, 0]
        assert (rewards <= -off + 1e-12).all()
        before = own if before is None else before
    assert (own != before).sum() == 1


def test_a_mission_without_any_target_is_refused() -> None:
    with pytest.raises(UsageError, match="target: found null"):
        Simulation("goals/swap")
