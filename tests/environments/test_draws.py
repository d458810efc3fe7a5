"""Values of scenario keys that are drawn for each mission of an environment, or set for one."""

import pickle
from typing import Any

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.environments import Simulation
from escort_mj.environments.draws import STREAM
from escort_mj.errors import ScenarioError, UsageError

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.vector import AutoresetMode  # noqa: E402

from escort_mj.environments.parallel import EscortParallelEnv  # noqa: E402
from escort_mj.environments.single import EscortEnv  # noqa: E402
from escort_mj.environments.vector import EscortVectorEnv  # noqa: E402
from tests.environments.test_vector import pair, same, steps  # noqa: E402

SHORT = {"duration": 0.107, "expect": []}
OVER: dict[str, Any] = {
    "robots.mass": {"low": 0.5, "high": 2.0, "scale": "log"},
    "mission.max_speed": {"low": 1, "high": 3, "whole": True},
    "mission.radius": [3.0, 4.0],
    "controller": ["apd_smc", "asmc"],
}


@pytest.fixture
def scenario():
    return load_scenario("main", SHORT)


def as_in_a_run(scenario: Any, values: dict[str, Any], seed: int, commands: list[Any]) -> Any:
    """The observations of a simulation of the scenario that has these values itself."""
    simulation = Simulation(scenario.replace(values))
    simulation.reset(seed)
    return [simulation.step(command) for command in commands], simulation.session.samples


@pytest.mark.parametrize("seed", [0, 7])
def test_a_mission_is_that_of_the_scenario_with_its_values(compiled: None, scenario: Any, seed: int) -> None:
    commands = [*np.random.default_rng(3).uniform(-1.0, 1.0, (4, 5, 2))]
    simulation = Simulation(scenario, sample=OVER)
    simulation.reset(seed)
    rewards = [simulation.step(command) for command in commands]
    told, samples = as_in_a_run(scenario, simulation.values, seed, commands)
    assert list(simulation.values) == list(OVER) and simulation.scenario.robots.mass != 1.0
    np.testing.assert_array_equal(rewards, told)
    np.testing.assert_array_equal(simulation.session.samples, samples)
    assert simulation.scale == pytest.approx(simulation.values["mission.max_speed"])


def test_values_are_those_of_the_ranges_by_the_seed_alone(compiled: None, scenario: Any) -> None:
    environment, other = EscortEnv(scenario, sample=OVER), EscortEnv(scenario, sample=OVER)
    drawn = [environment.reset(seed=seed)[1]["set"] for seed in range(40)]
    assert drawn[3] == other.reset(seed=3)[1]["set"] and drawn[3] != drawn[4]
    masses = np.array([one["robots.mass"] for one in drawn])
    assert 0.5 <= masses.min() < 0.7 and 1.6 < masses.max() < 2.0
    assert {one["mission.max_speed"] for one in drawn} == {1, 2, 3}
    assert {one["controller"] for one in drawn} == {"apd_smc", "asmc"}
    share = np.random.default_rng((5, STREAM)).random(4)[0]
    assert masses[5] == pytest.approx(0.5 * 4.0**share)
    later = [environment.reset()[1]["set"] for _ in range(2)], [other.reset(seed=39), other.reset()[1]["set"]]
    assert later[0][0] == later[1][1] and later[0][0] != later[0][1]


def test_nothing_is_said_where_nothing_is_drawn_or_set(compiled: None, scenario: Any) -> None:
    assert EscortEnv(scenario).reset(seed=1)[1] == {}
    assert EscortVectorEnv(2, scenario).reset(seed=1)[1] == {}
    assert all("set" not in info for info in EscortParallelEnv(scenario).reset(seed=1)[1].values())


@pytest.mark.slow_cases("DISABLED", "NEXT_STEP")
@pytest.mark.parametrize("mode", AutoresetMode)
def test_the_vector_environment_draws_what_single_ones_draw(
    compiled: None, scenario: Any, mode: AutoresetMode
) -> None:
    said = 0
    for ours, theirs in steps(pair(scenario, mode, sample=OVER), 14):
        assert same(ours, theirs)
        said += "set" in ours[-1]
    assert said >= 2


def test_options_set_values_of_one_mission_also_in_place_of_draws(compiled: None, scenario: Any) -> None:
    environment = EscortEnv(scenario, sample={"robots.mass": [1.5]})
    options = {"set": {"robots.mass": 3, "robots.force_limit": 7.0}}
    _, info = environment.reset(seed=3, options=options)
    assert info == {"set": {"robots.mass": 3, "robots.force_limit": 7.0}}
    assert environment.simulation.world.team.mass == pytest.approx(3.0)
    assert environment.reset()[1] == {"set": {"robots.mass": 1.5}}
    agents = EscortParallelEnv(scenario).reset(seed=3, options=options)[1]
    assert all(told["set"] == info["set"] for told in agents.values())
    many = EscortVectorEnv(3, scenario)
    many.reset(seed=1)
    _, infos = many.reset(options={"set": {"robots.mass": 2}, "reset_mask": np.array([True, False, True])})
    assert infos["set"]["robots.mass"].tolist() == [2, 0, 2]
    assert infos["_set"].tolist() == infos["set"]["_robots.mass"].tolist() == [True, False, True]
    masses = [mission.world.team.mass[0] for mission in many.fleet.missions]
    assert masses == pytest.approx([2.0, 1.0, 2.0])


def test_a_snapshot_brings_its_values_along(compiled: None, scenario: Any) -> None:
    fleet = EscortVectorEnv(2, scenario, sample=OVER)
    fleet.reset(seed=1)
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (4, 2, 5, 2)).astype(np.float32)
    fleet.step(actions[0])
    moment = fleet.fleet.snapshot(0)
    told = [fleet.step(one)[0][0] for one in actions[1:]]
    fleet.reset(seed=8)
    fleet.fleet.restore(1, moment)
    assert fleet.fleet.values[1] == moment["values"] != fleet.fleet.values[0]
    again = [fleet.step(one[::-1].copy())[0][1] for one in actions[1:]]
    np.testing.assert_array_equal(told, again)


def test_a_pickled_environment_draws_the_same(compiled: None, scenario: Any) -> None:
    environment = EscortEnv(scenario, sample=OVER)
    copy = pickle.loads(pickle.dumps(environment))
    assert copy.reset(seed=2)[1] == environment.reset(seed=2)[1]


@pytest.mark.parametrize(
    ("sample", "error", "said"),
    [
        ({"robots.mas": [1.0]}, ScenarioError, 'robots.mas.*did you mean "mass"'),
        ({"robots.mass": [1.0, -1.0]}, ScenarioError, "robots.mass: .*-1"),
        ({"robots.mass": {"low": 1, "high": 0.5}}, ScenarioError, "high: found 0.5; expected more than low"),
        ({"robots.mass": {"low": 1}}, ScenarioError, "high: is missing"),
        ({"robots.mass": []}, ScenarioError, "robots.mass.*has no values"),
        ({"robots.mass": 2.0}, ScenarioError, "robots.mass"),
        ({"seed": [1, 2]}, UsageError, "seed: found among values"),
        (["robots.mass"], UsageError, "sample: found"),
    ],
)
def test_what_cannot_be_drawn(scenario: Any, sample: Any, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        EscortEnv(scenario, sample=sample)


@pytest.mark.parametrize(
    ("values", "error", "said"),
    [
        ({"robots.mas": 1.0}, ScenarioError, 'did you mean "mass"'),
        ({"robots.count": 7}, UsageError, r"robots\.count: .* one shape; robot 5 becomes 7"),
        ({"duration": 0.2}, UsageError, "duration: .* samples are taken at other times"),
        ({"seed": 4}, UsageError, "seed: found among values"),
        ([1], UsageError, "set: found"),
        ({3: 1}, UsageError, "set: found"),
    ],
)
@pytest.mark.parametrize(
    "make", [EscortEnv, lambda scenario: EscortVectorEnv(2, scenario), EscortParallelEnv]
)
def test_what_cannot_be_set(
    compiled: None, scenario: Any, make: Any, values: Any, error: type[Exception], said: str
) -> None:
    environment = make(scenario)
    before = environment.reset(seed=1)[0]
    with pytest.raises(error, match=said):
        environment.reset(seed=1, options={"set": values})
    np.testing.assert_equal(environment.reset(seed=1)[0], before)
