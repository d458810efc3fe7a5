"""Robots whose motors fail, in physics: what they still do, and what the others make of it."""

import numpy as np
import pytest

from escort_mj.mission import fly
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.schema.scenario import Scenario
from tests.corpus import missions

MISSIONS = missions(__file__)


def failing(*failures: dict, **keys: object) -> dict:
    """The planar mission with failures."""
    return {**MISSIONS["planar"], **keys, "robots": {**MISSIONS["planar"]["robots"], "failures": failures}}


def forces(record: dict[str, np.ndarray], robot: int) -> np.ndarray:
    return record["force"][:, robot - 1]


def test_dead_motors_give_no_force(make_world, record_steps) -> None:
    record = record_steps(make_world(**failing({"robot": 2, "at": 0.5})), 1000)
    time, force = record["time"], forces(record, 2)
    assert not force[time > 0.499].any()
    assert force[time < 0.499].all()
    assert forces(record, 1).all()


def test_the_team_knows_when_told(make_world, record_steps) -> None:
    record = record_steps(make_world(**failing({"robot": 2, "at": 0.5, "notice": 0.3})), 1000)
    time, lost = record["time"], record["lost"]
    np.testing.assert_array_equal(lost[:, 1], time > 0.799)
    assert not lost[:, [0, 2, 3, 4]].any()
    tau = record["tau"][:, 1]
    assert tau[time < 0.799].all() and not tau[time > 0.799].any()  # no longer asked of it


def test_stuck_motors_keep_their_force(make_world, record_steps) -> None:
    record = record_steps(make_world(**failing({"robot": 2, "at": 0.5, "kind": "stuck"})), 1000)
    time, force = record["time"], forces(record, 2)
    before = force[time < 0.499][-1]
    assert before.any()
    np.testing.assert_array_equal(force[time > 0.499], np.broadcast_to(before, (np.sum(time > 0.499), 2)))


def test_mad_motors_throw_a_new_force_every_half_second(make_world, record_steps) -> None:
    mad = {"robot": 2, "at": 0.25, "kind": "mad", "force": 3.0}
    record = record_steps(make_world(**failing(mad)), 1500)
    time, force = record["time"], forces(record, 2)
    thrown = force[time > 0.249]
    whole = thrown[: 250 * (len(thrown) // 250)].reshape(-1, 250, 2)
    np.testing.assert_array_equal(whole, np.broadcast_to(whole[:, :1], whole.shape))
    assert len(np.unique(whole[:, 0], axis=0)) == len(whole)
    assert np.abs(thrown).max() <= 3.0
    other = record_steps(make_world(**failing({**mad, "force": None})), 1500)
    np.testing.assert_allclose(forces(other, 2)[time > 0.249], thrown * (10.0 / 3.0))


@pytest.mark.parametrize("kind", ["dead", "stuck", "mad"])
def test_a_failure_changes_nothing_before_it(make_world, record_steps, kind: str) -> None:
    """The same bits as with a failure still to come; a mission without any goes through the loops of four."""
    later = record_steps(make_world(**failing({"robot": 2, "at": 2.5, "kind": kind})), 600)
    failed = record_steps(make_world(**failing({"robot": 2, "at": 1.0, "kind": kind})), 600)
    early = later["time"] < 0.999
    for name, values in later.items():
        np.testing.assert_array_equal(values[early], failed[name][early], err_msg=name)
    assert (later["q"][-1] != failed["q"][-1]).any()
    whole = record_steps(make_world(**MISSIONS["planar"]), 600)
    np.testing.assert_allclose(failed["q"][early], whole["q"][early], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    "behaviors", [["chords", "surface"], ["vertices", "surface"], ["repulsion", "surface"]]
)
def test_the_others_close_the_ring(behaviors: list[str], compiled: None) -> None:
    failures = ({"robot": 2, "at": 20.0}, {"robot": 5, "at": 30.0})
    mission = {"radius": 3.0, "max_speed": 2.0, "behaviors": ["avoid_obstacles", *behaviors]}
    start = [[3 * np.cos(a), 3 * np.sin(a)] for a in 2 * np.pi * np.arange(5) / 5 + 0.1]
    keys = failing(*failures, duration=90.0, mission=mission)
    run = fly(Scenario.model_validate({**keys, "robots": {**keys["robots"], "positions": start}}))
    assert run.outcome is Outcome.COMPLETED
    assert run.metrics["energy_ratio"]["value"] < 1.01
    assert run.metrics["contacts"]["value"] == 0
    assert run.metrics["radius_error_mean"]["value"] < 0.02


def test_a_lost_robot_may_drift_wherever_it_will(compiled: None) -> None:
    """At 5 N for 100 s it is far beyond where a mission counts as diverged."""
    keys = failing({"robot": 2, "at": 0.2, "kind": "stuck", "notice": 0.0}, duration=100.0)
    run = fly(Scenario.model_validate(keys))
    assert run.outcome is Outcome.COMPLETED
    offset = run.trace["q"].values[-1] - run.trace["target_position"].values[-1]
    assert np.linalg.norm(offset[1]) > 1000.0
    assert np.linalg.norm(offset[[0, 2, 3, 4]], axis=1).max() < 3.1
