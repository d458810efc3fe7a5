"""Observations and rewards of one's own: what they are given, where they go, and what is refused."""

import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from escort_mj import load_scenario
from escort_mj.environments import Now, Observation, RewardTerm, Simulation
from escort_mj.environments.parallel import EscortParallelEnv
from escort_mj.environments.single import EscortEnv
from escort_mj.environments.vector import EscortVectorEnv
from escort_mj.errors import UsageError

Array = NDArray[np.float64]
SHORT: dict[str, Any] = {"duration": 1.0, "expect": []}


class Force(Observation):
    name, width, limit = "force", 2, 0.5

    def observe(self, now: Now) -> Array:
        return now["force"]


class Age(Observation):
    name, width = "age", 1

    def observe(self, now: Now) -> Array:
        return np.broadcast_to(now.time[:, None, None], (*now.commanded.shape[:2], 1))


class Calm(RewardTerm):
    name, weight = "calm", -0.25

    def reward(self, now: Now) -> Array:
        return np.square(now["v"]).sum(axis=-1)


OWN = (Age(), Calm(), Force())


def test_they_are_of_the_last_sample_and_come_after_the_usual_ones() -> None:
    plain, own = (Simulation("main", own=parts) for parts in ((), OWN))
    for each in (plain, own):
        each.reset(seed=4)
    command = np.full((own.count, own.axes), 0.5)
    usual = plain.width
    assert own.width == usual + 3
    for _ in range(5):
        before, found = plain.step(command), own.step(command)
        rows, state = own.run().trace, own.plant.state
        np.testing.assert_array_equal(own.observe()[:, :usual], plain.observe())
        np.testing.assert_array_equal(own.observe()[:, usual], own.time)
        np.testing.assert_array_equal(own.observe()[:, usual + 1 :], rows.force.values[-1])
        assert np.abs(own.observe_within()[:, usual + 1 :]).max() == 0.5 < np.abs(state.force).max()
        speed = np.square(rows.v.values[-1]).sum(axis=-1)
        np.testing.assert_array_equal(own.reward_terms["calm"], -0.25 * speed)
        np.testing.assert_allclose(found, before - 0.25 * speed, rtol=0, atol=1e-12)


def test_all_environments_give_the_same() -> None:
    scenario = load_scenario("main", SHORT)
    many = EscortVectorEnv(3, scenario, own=OWN, threads=2)
    alone = [EscortEnv(scenario, own=OWN) for _ in range(3)]
    agents = pickle.loads(pickle.dumps(EscortParallelEnv(scenario, own=OWN)))
    seen, _ = many.reset(seed=5)
    np.testing.assert_array_equal(seen, [each.reset(seed=5 + k)[0] for k, each in enumerate(alone)])
    np.testing.assert_array_equal(seen[0], [*agents.reset(seed=5)[0].values()])
    actions = np.random.default_rng(0).uniform(-1, 1, many.action_space.shape)
    for _ in range(4):
        seen, rewards, *_, infos = many.step(actions)
        assert many.observation_space.contains(seen)
        for k, each in enumerate(alone):
            observed, reward, *_, info = each.step(actions[k])
            np.testing.assert_array_equal(seen[k], observed)
            assert rewards[k] == reward
            np.testing.assert_array_equal(infos["reward_terms"]["calm"][k], info["reward_terms"]["calm"])
        found = agents.step(dict(zip(agents.agents, actions[0], strict=True)))
        np.testing.assert_array_equal(seen[0], [*found[0].values()])
        assert found[4]["robot_1"]["reward_terms"]["calm"] == infos["reward_terms"]["calm"][0, 0]
        np.testing.assert_array_equal(infos["rewards"][0], [*found[1].values()])


def test_a_snapshot_has_them_and_is_of_missions_with_the_same() -> None:
    simulation, other = Simulation("main", own=OWN), Simulation("main", own=OWN[:1])
    simulation.reset(seed=1)
    simulation.step(np.ones((simulation.count, 2)))
    seen, terms, moment = simulation.observe(), simulation.reward_terms, simulation.snapshot()
    simulation.step()
    simulation.restore(moment)
    np.testing.assert_array_equal(simulation.observe(), seen)
    assert {name: term.tolist() for name, term in simulation.reward_terms.items()} == {
        name: term.tolist() for name, term in terms.items()
    }
    with pytest.raises(UsageError, match="another mission"):
        other.restore(moment)


def part(base: type, **says: Any) -> Any:
    """Return a part that says and does so."""
    return type("Made", (base,), {"name": "made", "width": 1, **says})()


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ([Force], "own: found .*; expected objects of classes that derive from Observation or RewardTerm"),
        ([3], "own: found "),
        ([Calm(), Calm()], r"own\[1\].name: found 'calm', which another one has already"),
        ([part(RewardTerm, name="radius", reward=None)], "found 'radius', which another one has"),
        ([part(Observation, name="a b", observe=None)], 'name: found "a b"; expected a name'),
        ([part(Observation, width=0, observe=None)], "made.width: found 0; expected a whole number"),
        ([part(Observation, limit=-1, observe=None)], "made.limit: found -1; expected a number above 0"),
        ([part(RewardTerm, weight=np.nan, reward=None)], "made.weight: found NaN .*; expected a finite"),
    ],
)
def test_what_they_say_of_themselves_is_checked(own: Any, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        Simulation("main", own=own)


@pytest.mark.parametrize(
    ("own", "words"),
    [
        (
            part(Observation, observe=lambda s, now: now["q"]),
            r"made: found the shape \(1, 5, 2\); expected \(1, 5, 1\)",
        ),
        (part(Observation, observe=lambda s, now: None), r"made: found the shape \(\); expected"),
        (
            part(Observation, observe=lambda s, now: now["forces"]),
            "found the signal 'forces'; did you mean .force.",
        ),
        (
            part(Observation, observe=lambda s, now: now["lidar_range"]),
            "now: lidar_range: this mission does not record it",
        ),
        (
            part(RewardTerm, reward=lambda s, now: now["q"][..., 0] * np.nan),
            "made: found nan; expected finite",
        ),
        (
            part(RewardTerm, reward=lambda s, now: "none"),
            'made: found "none"; expected numbers',
        ),
    ],
)
def test_what_they_return_is_checked(own: Any, words: str) -> None:
    simulation = Simulation("main", own=[own])
    with pytest.raises(UsageError, match=words):
        simulation.reset()


def test_opponents_alone_have_none() -> None:
    with pytest.raises(UsageError, match="own: found parts for robots"):
        EscortEnv("pursuit/intruders", side="opponents", own=OWN)
