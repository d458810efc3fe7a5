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
from escort_mj.record.outcome import Outcome

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


def part(base: type | tuple[type, ...], **says: Any) -> Any:
    """Return a part that says and does so."""
    bases = base if isinstance(base, tuple) else (base,)
    return type("Made", bases, {"name": "made", "width": 1, **says})()


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
    wide = Simulation("main", own=[Age(), Calm(), part(Observation, name="force", width=3, observe=None)])
    for stranger in (other, wide):
        with pytest.raises(UsageError, match="another mission"):
            stranger.restore(moment)


def test_one_object_may_be_both_and_changes_nothing_for_others() -> None:
    class Both(Observation, RewardTerm):
        name, width = "both", 2

        def observe(self, now: Now) -> Array:
            return now.commanded

        def reward(self, now: Now) -> Array:
            now.commanded[:] = 7.0
            return now.commanded[..., 0]

    simulation = Simulation(
        "main", own=[Both(), part(RewardTerm, reward=lambda s, now: now.commanded[..., 1])]
    )
    simulation.reset()
    simulation.step(np.full((5, 2), 0.25))
    assert np.unique(simulation.observe()[:, -2:]).tolist() == [0.25]
    assert {*simulation.reward_terms["both"], *simulation.reward_terms["made"]} == {0.25}


@pytest.mark.parametrize("fails_at", [4, 11])
def test_a_mission_goes_on_after_one_of_them_failed(fails_at: int) -> None:
    calls = iter(range(1, 100))

    def reward(part: object, now: Now) -> Array:
        assert next(calls) != fails_at, "failed"
        return np.zeros(now.commanded.shape[:2])

    short = load_scenario("main", {"duration": 0.2, "expect": []})
    simulation, plain = Simulation(short, own=[part(RewardTerm, reward=reward)]), Simulation(short)
    for each in (simulation, plain):
        each.reset(seed=1)
    for k in range(2, 12):
        plain.step()
        if k == fails_at:
            with pytest.raises(AssertionError, match="failed"):
                simulation.step()
        else:
            simulation.step()
    assert simulation.outcome is plain.outcome is Outcome.COMPLETED
    np.testing.assert_array_equal(simulation.run().trace.q.values, plain.run().trace.q.values)
    with pytest.raises(UsageError, match="not under way"):
        simulation.step()


def test_a_reward_that_is_no_number_where_a_mission_broke_is_0() -> None:
    wild = load_scenario("main", {**SHORT, "robots.mass": 1e-3, "robots.force_limit": 1e6})
    far = part(RewardTerm, reward=lambda s, now: np.exp2(np.abs(now["q"]).sum(axis=-1)))
    environment = EscortVectorEnv(2, wild, "force", own=[far])
    environment.reset(seed=1)
    with np.errstate(over="ignore"):
        _, rewards, terminated, _, infos = environment.step(np.ones((2, 5, 2), np.float32))
    assert terminated.all()
    assert np.isfinite(rewards).all()
    assert not infos["reward_terms"]["made"].any()


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ([Force], "own: found .*; expected a list of objects of classes that derive from"),
        ({Force()}, "own: found .*; expected a list of objects of classes that"),
        ([3], "own: found "),
        ([type("Nameless", (Observation,), {"width": 1, "observe": None})()], r"own\[0\].name: found None"),
        ([part((Observation, RewardTerm), width="1", observe=None, reward=None)], 'made.width: found "1"'),
        ([part(Observation, limit=np.ones(1), observe=None)], "made.limit: found an array of the shape"),
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
        (part(Observation, observe=lambda s, now: 3), r"made: found the shape \(\); expected"),
        (part(Observation, observe=lambda s, now: None), "made: found None; expected numbers"),
        (
            part(Observation, observe=lambda s, now: 1j * now.time),
            "made: found an array .*; expected numbers",
        ),
        (part(Observation, observe=lambda s, now: now[["q"]]), r"now: found the signal \['q'\]"),
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
