"""The native vector environment against Gymnasium's own vector of single ones, bit for bit."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.errors import UsageError

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import data_equivalence  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

from escort_mj.environments.single import EscortEnv  # noqa: E402
from escort_mj.environments.vector import EscortVectorEnv  # noqa: E402
from escort_mj.scenario import Scenario  # noqa: E402

WINDOW = {"clearance": ["robots", "robots"], "at_least": 0.0, "after": 0.031, "before": 0.05}
SHORT = {"duration": 0.107, "expect": [WINDOW]}
# Driven away at this speed, robots are soon too far from the target: missions end at different times.
AWAY = {"duration": 600.0, "mission.max_speed": 40.0, "expect": [], "recording.rate": 2.0}
Pair = tuple[EscortVectorEnv, SyncVectorEnv]


def pair(scenario: Scenario, mode: AutoresetMode, threads: int = 2, **options: Any) -> Pair:
    ours = EscortVectorEnv(3, scenario, threads=threads, autoreset_mode=mode, **options)
    theirs = SyncVectorEnv([lambda: EscortEnv(scenario, **options)] * 3, autoreset_mode=mode)
    return ours, theirs


def steps(environments: Pair, count: int, push: float = 0.0) -> Iterator[tuple[Any, Any]]:
    """What both say of the same actions; reset where the mode asks for it."""
    dice = np.random.default_rng(1)
    ours, theirs = environments
    yield ours.reset(seed=5), theirs.reset(seed=5)
    for _ in range(count):
        actions = dice.uniform(-1.0, 1.0, ours.action_space.shape).astype(np.float32)
        actions[1] += np.float32(push)
        found = ours.step(actions), theirs.step(actions)
        yield found
        over = found[0][2] | found[0][3]
        if over.any() and ours.autoreset_mode is AutoresetMode.DISABLED:
            yield tuple(one.reset(options={"reset_mask": over}) for one in environments)  # type: ignore[misc]


def same(ours: Any, theirs: Any) -> bool:
    """Whether two answers agree in every bit, type and key."""
    if isinstance(ours, dict):
        return ours.keys() == theirs.keys() and all(same(ours[key], theirs[key]) for key in ours)
    if isinstance(ours, tuple):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(ours, np.ndarray) and ours.dtype == object:
        return all(map(same, ours, theirs))
    return bool(data_equivalence(ours, theirs, exact=True))


@pytest.mark.crossed
@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("name", ["main", "paper/case1_3d", "knowledge/blind", "pursuit/handover"])
def test_every_mission_has_the_bits_of_a_single_one(name: str, mode: AutoresetMode) -> None:
    environments = pair(load_scenario(name, SHORT), mode)
    ended = 0
    for ours, theirs in steps(environments, 16):
        assert same(ours, theirs)
        ended += len(ours) == 5 and bool(ours[3].all())
    assert ended >= 2


@pytest.mark.parametrize("mode", AutoresetMode)
def test_missions_that_break_end_alone(mode: AutoresetMode) -> None:
    environments = pair(load_scenario("paper/case1_2d", AWAY), mode)
    broke = 0
    for ours, theirs in steps(environments, 12, push=2.0):
        assert same(ours, theirs)
        broke += len(ours) == 5 and bool(ours[2][1]) and not ours[2][[0, 2]].any()
    assert broke >= 1


@pytest.mark.slow_cases("raid")
@pytest.mark.crossed
@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize(("name", "groups"), [("pursuit/intruders", 2), ("pursuit/raid", 1)])
def test_opponents_are_commanded_until_none_is_left(name: str, groups: int, mode: AutoresetMode) -> None:
    soon = {"start": 0.02, "interval": 0.02, "distance": 7.0, "capture_distance": 2.0, "count": 2}
    changes = {f"opponents[{k}].{key}": value for k in range(groups) for key, value in soon.items()}
    scenario = load_scenario(name, {"duration": 4.0, "expect": [], "recording.rate": 10.0} | changes)
    terminated = truncated = 0
    for ours, theirs in steps(pair(scenario, mode, side="opponents"), 60, push=0.5):
        assert same(ours, theirs)
        if len(ours) == 5:
            terminated, truncated = terminated + int(ours[2].sum()), truncated + int(ours[3].sum())
    assert terminated >= 1 and truncated >= 1


def test_obstacles_that_are_no_spheres_and_forces() -> None:
    walls = {"obstacles[0]": {"shape": "box", "size": [1.0, 4.0], "position": [7.0, 4.5]}}
    scenario = load_scenario("main", SHORT | walls)
    for ours, theirs in steps(pair(scenario, AutoresetMode.NEXT_STEP, command="force"), 8):
        assert same(ours, theirs)


def test_threads_change_no_bit() -> None:
    scenario = load_scenario("main", SHORT)
    one = pair(scenario, AutoresetMode.SAME_STEP, threads=1)[0]
    two = pair(scenario, AutoresetMode.SAME_STEP, threads=2)[0]
    for ours, theirs in steps((one, two), 16):  # type: ignore[arg-type]
        assert same(ours, theirs)
    two.close()


def test_seeds_go_on() -> None:
    scenario = load_scenario("main", SHORT)
    environment = EscortVectorEnv(2, scenario)
    first, _ = environment.reset()
    second, _ = environment.reset()
    assert not (first == second).all(axis=(1, 2)).any()
    again, _ = environment.reset(seed=[scenario.seed, scenario.seed + 1])
    np.testing.assert_array_equal(again, first)
    np.testing.assert_array_equal(environment.reset()[0], second)


def test_what_cannot_be() -> None:
    scenario = load_scenario("main", SHORT)
    with pytest.raises(UsageError, match="at least 1"):
        EscortVectorEnv(0, scenario)
    with pytest.raises(UsageError, match="force_limit"):
        EscortVectorEnv(2, load_scenario("main", {"robots.force_limit": None}), "force")
    environment = EscortVectorEnv(2, scenario)
    rest = np.zeros((2, 5, 2), dtype=np.float32)
    with pytest.raises(UsageError, match="call reset"):
        environment.step(rest)
    environment.reset()
    with pytest.raises(UsageError, match=r"actions: found the shape \(5, 2\); .* shape \(2, 5, 2\)"):
        environment.step(rest[0])
    with pytest.raises(UsageError, match="seed: found 3 seeds; expected 2"):
        environment.reset(seed=[1, 2, 3])
    for wrong in ([True], [[True], True], [1, 0], None):
        with pytest.raises(UsageError, match="reset_mask: found .*; expected 2 flags, at least one set"):
            environment.reset(options={"reset_mask": wrong})
    with pytest.raises(UsageError, match='options: found "radius"; expected reset_mask and set'):
        environment.reset(options={"radius": 3})
    with pytest.raises(UsageError, match=r"actions: found nan at \[0, 0, 0\]"):
        environment.step(np.full_like(rest, np.nan))


def test_gymnasium_makes_it_by_name() -> None:
    scenario = load_scenario("main", SHORT)
    many = gymnasium.make_vec("escort_mj/Escort-v0", num_envs=2, scenario=scenario)
    assert isinstance(many.unwrapped, EscortVectorEnv)
    observed, _ = many.reset(seed=5)
    single, _ = gymnasium.make("escort_mj/Escort-v0", scenario=scenario).reset(seed=6)
    np.testing.assert_array_equal(observed[1], single)
    assert observed in many.observation_space
    many.close()
