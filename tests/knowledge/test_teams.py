"""Teams whose robots know only what they see and hear: what that is, by hand."""

import numpy as np
import pytest

import escort_mj
from escort_mj import Run, Scenario
from escort_mj.numerics.gaussian import START
from escort_mj.record.team import own_targets
from escort_mj.scenario.mission import Mission
from tests.control.twins import Kernel
from tests.oracle.noise import normal

STEP = 0.002
BEHAVIORS = [{"behavior": "avoid_obstacles", "safe_distance": 0.3}, "vertices", "surface"]
LAWFUL = ("q", "v", "v_d", "tau", "rho_hat", "task_error", "member_of")
SHORT = [
    "duration=8", "expect=[]", "robots.failures[0].at=5", "teams[1].demand[1].after=1.5",
    "teams[0].demand[1].after=3",
]  # fmt: skip


@pytest.mark.parametrize("estimator", ["hold", "predict"])
@pytest.mark.parametrize("keys", [
    {"mission.outer": "nsb"},
    {"mission.target_feedforward": False},  # conditions of robots of two teams then are in the same frame
])  # fmt: skip
def test_perfect_messages_change_no_bit(keys: dict[str, object], estimator: str, compiled: None) -> None:
    """Two robots change over, one on demand and one for another that fails."""
    base = escort_mj.load_scenario("pursuit/handover", SHORT).replace(keys)
    perfect = base.replace({"knowledge": {"estimator": estimator}, "communication": {}})
    one, other = escort_mj.run(base), escort_mj.run(perfect)
    assert (np.diff(one.trace["member_of"].values, axis=0) != 0).sum() == 2
    for name in LAWFUL:
        assert one.trace[name].values.tobytes() == other.trace[name].values.tobytes(), name
    left = other.trace["lost"].values == 0
    assert np.array_equal(other.trace["target_estimate"].values[left], own_targets(other.trace)[left])


def two(**keys: object) -> dict[str, object]:
    """Six robots: 1 to 4 around two targets, 5 and 6 around one at 20 m; from 1 s on, 5 to 7 need three."""
    teams = [
        {"name": "near", "robots": [1, 2, 3, 4], "radius": 3, "targets": [
            {"name": "a", "position": ["0.2*t", 1]}, {"name": "b", "position": ["0.2*t", -1]}]},
        {"name": "far", "robots": [5, 6], "radius": 2, "targets": [{"name": "c", "position": [20, "0.1*t"]}],
         "demand": [{"after": 1.0, "robots": 3}]},
    ]  # fmt: skip
    places = [[-3, 0], [0, 3.5], [0, -3.5], [3.5, 0], [18, 0], [22, 0.5]]
    mission = {"max_speed": 2.0, "behaviors": BEHAVIORS}
    return {"target": None, "teams": teams, "robots": {"positions": places}, "mission": mission, **keys}


@pytest.fixture(scope="module")
def flown(compiled: None) -> Run:
    """One robot of each team sees; all hear each other, with errors in all that is seen and told."""
    sight = {"robots": [1, 5], "rate": 50, "noise": {"position": 0.05, "velocity": 0.05}}
    knowledge = {"target": sight, "estimator": "kalman", "initial": {"position": 0.5}}
    radio = {"rate": 10, "delay": 0.1, "loss": 0.3, "range": 8.0}
    return escort_mj.run(Scenario(duration=4.0, **two(knowledge=knowledge, communication=radio)))


def test_robots_take_estimates_of_members_only(compiled: None) -> None:
    """All hear each other at once; each knows the middle of its own team's targets, exactly."""
    keys = two(knowledge={"target": {"robots": [1, 5]}}, communication={})
    trace = escort_mj.run(Scenario(duration=2.0, recording={"rate": 100}, **keys)).trace
    assert (trace["heard_from"].values[1:] > 0).all()
    off = np.linalg.norm(trace["target_estimate"].values - own_targets(trace), axis=2)
    assert off.max() < 1e-12
    changed = trace["member_of"].values[:, 3] == 2
    assert changed.any() and not changed.all()
    assert np.abs(trace["target_estimate"].values[changed, 3] - [20.0, 0.15]).max() < 0.06


def walked(time: float, **keys: object) -> Kernel:
    """The controller after it has been called at every step up to a time, with robots and targets at rest."""
    setup = Mission(Scenario(duration=4.0, **two(**keys))).setup
    kernel = Kernel(setup)
    q = np.array(two()["robots"]["positions"], dtype=float)  # type: ignore[index, call-overload]
    kernel.state.mover_position[:] = [mover.path.position(0.0) for mover in setup.movers]
    kernel.state.mover_velocity[:] = 0.0
    for step in range(round(time / STEP) + 1):
        kernel.evaluate(step * STEP, q, np.zeros_like(q))
    return kernel


def test_a_robot_that_changes_over_begins_as_at_the_start() -> None:
    """It is told where its new targets are, with new errors, and no longer knows of its old ones."""
    initial = {"position": 0.5, "velocity": 0.1}
    state = walked(1.0, knowledge={"target": {"robots": [1, 5]}, "initial": initial}).state
    assert state.member_of.tolist() == [1, 1, 1, 2, 2, 2]
    deviation = np.repeat([0.5, 0.1], 2)
    for robot, step, center in ((3, round(1.0 / STEP), [20.0, 0.0]), (2, 0, [0.0, 0.0])):
        told = deviation * normal(4, 0, START, robot, step) + [*center, 0.0, 0.0]
        assert np.allclose(state.belief[robot], told, rtol=0.0, atol=1e-14)
        assert state.belief_fix[robot] == pytest.approx(step * STEP)
        assert np.allclose(state.belief_covariance[robot].reshape(4, 4), np.diag(deviation**2))


def parting(after: float) -> list[dict[str, object]]:
    """The teams of `two`, but one target of the near team parts."""
    near, far = two()["teams"]  # type: ignore[misc]
    near["targets"][1]["escorted_by"] = [{"after": after, "team": None}]
    return [near, {**far, "demand": []}]


def test_robots_whose_target_parts_begin_as_at_the_start() -> None:
    """All robots of its team, and no others, are told where the middle of their targets is now."""
    knowledge = {"target": {"robots": [1, 5]}, "initial": {"position": 0.5, "velocity": 0.1}}
    state, step = walked(1.0, knowledge=knowledge, teams=parting(1.0)).state, round(1.0 / STEP)
    assert state.told.tolist() == [1, 1, 1, 1, 0, 0]
    for robot, draw, center in ((1, step, [0.0, 1.0]), (3, step, [0.0, 1.0]), (5, 0, [20.0, 0.0])):
        told = np.repeat([0.5, 0.1], 2) * normal(4, 0, START, robot, draw) + [*center, 0.0, 0.0]
        assert np.allclose(state.belief[robot], told, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("estimator", ["consensus", "covariance_intersection", "kalman"])
def test_estimates_of_targets_that_have_parted_are_not_heard(estimator: str, compiled: None) -> None:
    """Messages take 0.2 s: all that arrive in that time after 1 s are about the old middle."""
    keys = two(knowledge={"target": {"robots": [1, 5]}, "estimator": estimator}, teams=parting(1.0))
    radio = {"rate": 20, "delay": 0.2}
    trace = escort_mj.run(Scenario(duration=2.0, recording={"rate": 500}, communication=radio, **keys)).trace
    middle = trace["team_center"].values[:, 0]
    assert np.abs(np.diff(middle, axis=0)[:, 1]).max() == pytest.approx(1.0)
    off = np.linalg.norm(trace["target_estimate"].values - own_targets(trace), axis=2)
    assert off[trace["time"].values > 0.5].max() < 0.01  # before, some believe in a target at rest


@pytest.mark.parametrize(("sight", "seers"), [
    ({}, {0, 1, 2, 3, 4, 5}),
    ({"range": 3.5}, {0, 3, 4, 5}),  # 2 and 3 are too far from the farther target
    ({"hidden": True}, {0, 3, 4, 5}),  # a target hides the other one, but not itself
])  # fmt: skip
def test_a_robot_measures_the_middle_while_it_sees_all_targets(
    sight: dict[str, object], seers: set[int]
) -> None:
    state = walked(0.0, knowledge={"target": sight}).state
    assert {*np.flatnonzero(state.target_seen).tolist()} == seers


@pytest.mark.parametrize("name", ["near", "far"])
def test_metrics_of_each_team_are_recomputed(flown: Run, name: str) -> None:
    trace, number = flown.trace, {"near": 1, "far": 2}[name]
    tail = trace["time"].values >= 0.8 * trace["time"].values[-1] - 1e-9
    member = trace["member_of"].values == number
    estimate, center = trace["target_estimate"].values, trace["team_center"].values[:, number - 1]
    off, late = estimate - center[:, None], member & tail[:, None]
    values = {key.partition(".")[2]: flown.values[key] for key in flown.values if key.startswith(name)}
    assert values["estimate_error_rms"] == pytest.approx(np.sqrt((off[late] ** 2).sum(axis=1).mean()))
    apart = [
        np.linalg.norm(row[here] - row[here].mean(axis=0), axis=1).max()
        for row, here in zip(estimate[tail], member[tail], strict=True)
    ]
    assert values["disagreement_max"] == pytest.approx(max(apart))
    assert values["information_age_max"] == pytest.approx(trace["information_age"].values[late].max())
    nees = [
        d @ np.linalg.solve(p, d)
        for d, p in zip(off[late], trace["target_covariance"].values[late], strict=True)
    ]
    assert values["estimate_consistency"] == pytest.approx(np.mean(nees) / 2.0)
    parts, least = 0.0, np.inf
    for heard, here, gap in zip(
        trace["heard_from"].values, member, [*np.diff(trace["time"].values), 0.0], strict=True
    ):
        graph = np.zeros((6, 6))
        for i, row in enumerate(heard):
            for j in row[row > 0] - 1:
                graph[i, j] = graph[j, i] = here[i] and here[j]
        second = np.linalg.eigvalsh((np.diag(graph.sum(axis=1)) - graph)[here][:, here])[1]
        parts, least = parts + gap * (second < 1e-9), min(least, second)
    assert values["disconnected_time"] == pytest.approx(parts)
    assert values["connectivity_min"] == pytest.approx(least, abs=1e-9)
    assert "message_rate" not in values and flown.values["message_rate"] > 0.0
    assert np.isnan(flown.values["estimate_error_rms"])  # of no target for all robots
