"""Missions in which robots know only what they see and hear."""

from pathlib import Path

import numpy as np
import pytest

import escort_mj
from escort_mj import Controller, Run, load_scenario

FOLDER = Path(__file__).parents[2] / "scenarios" / "knowledge"
NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
LAWFUL = ("q", "v", "v_d", "tau", "rho_hat", "target_position_measured", "task_error")


def same(one: Run, other: Run, names: tuple[str, ...]) -> bool:
    return all(one.trace[name].values.tobytes() == other.trace[name].values.tobytes() for name in names)


@pytest.mark.parametrize("estimator", ["hold", "predict"])
@pytest.mark.parametrize("name", ["main", "main_3d"])
def test_perfect_messages_change_no_bit(name: str, estimator: str, compiled: None) -> None:
    """Everybody sees the target and hears everybody in every step, at once."""
    scenario = load_scenario(name, ["duration=6", "expect=[]"])
    perfect = scenario.replace({"knowledge": {"estimator": estimator}, "communication": {}})
    one, other = escort_mj.run(scenario), escort_mj.run(perfect)
    assert same(one, other, LAWFUL)
    assert (other.trace["information_age"].values == 0.0).all()
    assert np.array_equal(
        other.trace["target_estimate"].values[:, 2], other.trace["target_position_measured"].values
    )


def test_perfect_messages_show_teammates_as_sight_does(compiled: None) -> None:
    """Robots that cross, with noise: what is sent, at once and at every step, is what is measured."""
    base = load_scenario(FOLDER / "crossing.yaml", ["duration=12", "expect=[]", "communication={}"])
    heard, seen = (
        escort_mj.run(base.replace({"mission.behaviors.0.teammates": value})) for value in ("heard", True)
    )
    assert same(heard, seen, LAWFUL) and heard.trace["avoidance_active"].values.any()


def test_the_same_bits_in_threads(compiled: None) -> None:
    scenarios = [load_scenario(FOLDER / f"{name}.yaml", ["duration=4", "expect=[]"]) for name in NAMES]
    one, two = (list(escort_mj.run_many(scenarios, threads=threads, traces=True)) for threads in (1, 2))
    for name, alone, beside in zip(NAMES, one, two, strict=True):
        recorded = tuple(
            str(each) for each in alone.trace.variables if alone.trace[each].values.dtype.kind in "fi"
        )
        assert {"heard_from", "target_estimate"} <= set(recorded) or name == "lidar", name
        assert same(alone, beside, recorded), name


def test_a_controller_for_real_robots_is_given_what_is_measured() -> None:
    """What a scenario simulates of knowledge is added on demand."""
    scenario = load_scenario(FOLDER / "blind.yaml")
    plain = Controller(scenario.replace({"knowledge": None, "communication": None, "expect": []}))
    told, simulated = Controller(scenario), Controller(scenario, simulate=True)
    q, v, target = plain.start, np.zeros_like(plain.start), (np.array([1.0, 2.0]), np.array([0.1, 0.0]))
    for step in range(3):
        time = step * plain.timestep
        forces = [controller(time, q, v, target) for controller in (plain, told, simulated)]
        assert np.array_equal(forces[0], forces[1])
    assert not np.array_equal(forces[0], forces[2])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_twenty_seeds(name: str, compiled: None) -> None:
    scenario = load_scenario(FOLDER / f"{name}.yaml")
    runs = list(escort_mj.run_many([scenario.replace(seed=seed) for seed in range(20)]))
    assert [run.passed for run in runs] == [True] * 20
