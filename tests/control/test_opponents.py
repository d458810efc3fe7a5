"""Opponents and what is done against them: the NumPy form beside the kernel, and rules by hand."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj import Scenario
from escort_mj.components.movers import INTERCEPTED, REACHED
from escort_mj.control.setup import Setup
from escort_mj.scenario.mission import Mission
from tests.control.twins import TOLERANCE, Kernel
from tests.oracle.opponents import Watch
from tests.oracle.reference import ReferenceController
from tests.oracle.setup import setup_now

STEP, STEPS = 0.1, 150
AVOID = {"behavior": "avoid_obstacles", "safe_distance": 0.3}


def mission(axes: int, behavior: dict[str, object], outer: str, **more: object) -> Setup:
    """Opponents that come one after the other, more of them than robots."""
    target = {"position": ["0.2*t", *["0"] * (axes - 1)]}
    return Mission(
        Scenario(
            axes=axes, physics={"timestep": STEP}, recording={"rate": 10}, seed=axes,
            robots={"count": 5, "radius": 0.2}, **{"target": target} | more,
            obstacles=[{"position": [30.0] * axes, "radius": 0.5}],
            opponents=[
                {"count": 4, "interval": 1.0, "distance": 9.0},
                {"name": "late", "count": 3, "start": 2.0, "distance": 12.0, "capture_distance": 0.6},
            ],
            mission={"max_speed": 1.5, "outer": outer, "behaviors": [AVOID, behavior, "surface"]},
        )
    ).setup  # fmt: skip


@pytest.mark.crossed
@pytest.mark.parametrize("outer", ["nsb", "set_based"])
@pytest.mark.parametrize(
    "behavior",
    [
        {"behavior": "guard", "alert": 6.0},
        {"behavior": "guard", "distance": 1.5},
        {"behavior": "intercept", "quarry": "opponents"},
    ],
    ids=["alert", "guard", "intercept"],
)
@pytest.mark.parametrize("axes", [2, 3])
def test_kernel_and_twin_agree(axes: int, behavior: dict[str, object], outer: str) -> None:
    seen = fly(mission(axes, behavior, outer))
    assert {0.0, 1.0, INTERCEPTED} <= seen


@pytest.mark.crossed
@pytest.mark.parametrize("behavior", [
    {"behavior": "guard", "alert": 6.0}, {"behavior": "intercept", "quarry": "opponents"},
], ids=["guard", "intercept"])  # fmt: skip
@pytest.mark.parametrize("escorts", [[], [{"after": 4.0, "team": None}, {"after": 8.0, "team": "two"}]])
@pytest.mark.parametrize(("axes", "outer"), [(2, "nsb"), (2, "set_based"), (3, "nsb")])
def test_they_agree_with_teams(
    axes: int, outer: str, escorts: list[object], behavior: dict[str, object]
) -> None:
    aside, one = [0.0] * (axes - 1), {"name": "one", "robots": [1, 3], "radius": 2.0}
    c = {"name": "c", "position": [6.0, *aside], "escorted_by": escorts}
    teams = [
        one | {"targets": [{"name": "a", "position": [-4.0, *aside]}]},
        {"name": "two", "robots": [2, 4, 5], "radius": 4.0, "demand": [{"after": 5.0, "robots": 4}],
         "radii": [{"after": 6.0, "radius": 5.0}], "targets": [{"name": "b", "position": [3.0, *aside]}, c]},
    ]  # fmt: skip
    seen = fly(mission(axes, behavior, outer, target=None, teams=teams))
    assert {0.0, 1.0, INTERCEPTED} <= seen


def test_with_teams_the_one_whose_target_is_nearest_guards_and_any_target_can_be_reached() -> None:
    teams = [
        {"name": "one", "robots": [1], "radius": 1.5, "targets": [{"name": "a", "position": [0, 0]}]},
        {"name": "two", "robots": [2, 3], "radius": 1.5, "targets": [{"name": "b", "position": [10, 0]}]},
    ]  # fmt: skip
    setup = Mission(Scenario(
        target=None, teams=teams, robots={"positions": [[8, 3], [10, 3], [10, -3]]},
        opponents=[{"count": 3, "positions": [[8, 6], [7, 6], [10, 0.6 + 1e-9]], "policy": "straight"}],
        mission={"behaviors": ["guard", "surface"]},
    )).setup  # fmt: skip
    kernel, q = Kernel(setup), np.array([[8.0, 3.0], [10.0, 3.0], [10.0, -3.0]])
    place = np.array([mover.path.position(0.0) for mover in setup.movers])
    kernel.state.mover_position[:] = place
    state = kernel.evaluate(0.0, q, np.zeros((3, 2)))
    assert state.opponent_status.tolist() == [1.0, 1.0, 1.0]
    assert state.threat.tolist() == [
        0.0,
        3.0,
        1.0,
    ]  # the first robot is nearest to two, but in the other team
    ways = place[1] - place[2:]  # to b
    assert np.allclose(state.mover_wish[2:], ways / np.linalg.norm(ways, axis=1, keepdims=True))
    kernel.state.mover_position[4, 1] -= 2e-9
    assert kernel.evaluate(0.01, q, np.zeros((3, 2))).opponent_status.tolist() == [1.0, 1.0, REACHED]
    assert not state.target_position.any()  # what is recorded of a target that is not there


def test_a_target_without_a_team_is_not_attacked() -> None:
    """The opponent stands at the farther target, which belongs to the team from 0.02 s on."""
    targets = [
        {"name": "a", "position": [0, 0]},
        {"name": "b", "position": [2, 0], "escorted_by": [{"team": None}, {"after": 0.02, "team": "one"}]},
    ]
    setup = Mission(Scenario(
        target=None, robots={"positions": [[0, 4]]}, mission={"behaviors": ["surface"]},
        teams=[{"name": "one", "robots": [1], "radius": 4, "targets": targets}],
        opponents=[{"positions": [[2, 0.55]], "policy": "straight"}],
    )).setup  # fmt: skip
    kernel, found = Kernel(setup), []
    place = np.array([mover.path.position(0.0) for mover in setup.movers])
    for t in (0.0, 0.01, 0.02):
        kernel.state.mover_position[:] = place
        state = kernel.evaluate(t, np.array([[0.0, 4.0]]), np.zeros((1, 2)))
        found.append((state.opponent_status[0], *(state.mover_wish[2] / np.linalg.norm(state.mover_wish[2]))))
    away = -np.array([2.0, 0.55]) / np.hypot(2.0, 0.55)
    assert np.allclose(found[:2], [[1.0, *away]] * 2) and found[2][0] == REACHED


def fly(setup: Setup) -> set[float]:
    """Lets both go a way together, and compares them at each step; returns what became of opponents."""
    axes = setup.axes
    random = np.random.default_rng(3)
    q = random.normal(scale=2.0, size=(5, axes))
    kernel, twin = Kernel(setup), ReferenceController(setup)
    twin.reset(q)
    start = setup.obstacle_position[1:]
    count = len(start) - 7  # targets of teams, which rest
    pace, aside = random.uniform(0.05, 0.12, (len(start), 1)), random.normal(scale=0.6, size=start.shape)
    pace[:count] = aside[:count] = 0.0
    seen: set[float] = set()
    for step in range(STEPS):
        t = step * STEP
        place = start * (1.0 - pace * t) + aside * np.sin(0.5 * t)
        speed = -pace * start + 0.5 * aside * np.cos(0.5 * t)
        kernel.state.mover_position[:], kernel.state.mover_velocity[:] = place, speed
        twin.setup = replace(
            twin.setup, obstacle_position=np.vstack([setup.obstacle_position[:1], place]),
            obstacle_velocity=np.vstack([np.zeros((1, axes)), speed]),
        )  # fmt: skip
        v = random.normal(scale=0.1, size=q.shape)
        state, signals = kernel.evaluate(t, q, v), twin.evaluate(t, q, v)
        assert np.abs(state.v_d - signals.v_d).max() < TOLERANCE
        assert np.abs(state.tau - signals.tau).max() < TOLERANCE * np.abs(signals.tau).max()
        watch = twin._watch
        assert watch is not None and twin._threats is not None
        assert np.array_equal(state.opponent_status, watch.status)
        assert np.array_equal(state.interceptor, watch.interceptor)
        assert np.array_equal(state.threat, twin._threats.number)
        seen |= {*watch.status.tolist()}
        q = q + STEP * signals.v_d
    return seen


def standing(opponents: list[dict[str, object]]) -> tuple[Setup, Watch]:
    """Two robots beside a target, and opponents that all come at once."""
    scenario = Scenario(
        target={"radius": 0.3}, robots={"positions": [[3, 0], [0, 3]], "radius": 0.2}, opponents=opponents,
        mission={"radius": 3, "behaviors": ["guard", "surface"]},
    )  # fmt: skip
    setup = setup_now(Mission(scenario).setup)
    return setup, Watch(setup)


def watched(opponents: list[dict[str, object]]) -> Watch:
    setup, watch = standing(opponents)
    watch.judge(0.0, np.array([[3.0, 0.0], [0.0, 3.0]]), np.zeros(2), np.zeros(2, bool), setup)
    return watch


def test_an_opponent_is_intercepted_within_the_gap_and_no_farther() -> None:
    near, far = 3.0 + 0.2 + 0.2 + 0.3 - 1e-9, 3.0 + 0.2 + 0.2 + 0.3 + 1e-9
    watch = watched([{"count": 2, "positions": [[near, 0], [0, far]]}])
    assert watch.status.tolist() == [INTERCEPTED, 1.0] and watch.interceptor.tolist() == [1, 0]


def test_an_opponent_has_reached_the_target_at_the_gap() -> None:
    at = 0.3 + 0.2 + 0.1
    assert watched([{"positions": [[at - 1e-9, 0.0]]}]).status.tolist() == [REACHED]
    assert watched([{"positions": [[at + 1e-9, 0.0]]}]).status.tolist() == [1.0]


def test_the_nearest_robot_guards_and_keeps_its_opponent() -> None:
    setup, watch = standing([{"count": 2, "positions": [[8, 0], [0, 8]]}])
    nobody = np.zeros(2, bool)
    watch.judge(0.0, np.array([[3.0, 0.0], [0.0, 3.0]]), np.zeros(2), nobody, setup)
    assert watch.assign(np.array([[3.0, 0], [0, 3.0]]), np.zeros(2), nobody, setup).number.tolist() == [1, 2]
    between = np.array([[2.0, 2.2], [2.2, 2.0]])  # each a little nearer to the other's opponent
    assert watch.assign(between, np.zeros(2), nobody, setup).number.tolist() == [1, 2]
    swapped = np.array([[0.0, 3.0], [3.0, 0.0]])
    assert watch.assign(swapped, np.zeros(2), nobody, setup).number.tolist() == [2, 1]
    lost = np.array([True, False])
    assert watch.assign(swapped, np.zeros(2), lost, setup).number.tolist() == [0, 1]


def test_an_opponent_is_not_asked_before_its_start_and_holds_its_place() -> None:
    patient = {"policy": "patient", "distance": 9.0, "speed": 1.5}
    setup = Mission(
        Scenario(
            target={"radius": 0.3}, robots={"positions": [[3, 0], [0, 3]]},
            opponents=[{"positions": [[-9, 0]], "start": 1.0, "policy": patient}],
            mission={"radius": 3, "behaviors": ["guard", "surface"]},
        )
    ).setup  # fmt: skip
    kernel, q = Kernel(setup), np.array([[3.0, 0.0], [0.0, 3.0]])
    kernel.state.mover_position[:] = [[-9.0, 6.0]]  # pushed away
    state = kernel.evaluate(0.0, q, np.zeros((2, 2)))
    assert np.allclose(state.mover_wish, [[0.0, -1.5]]) and not state.policy_memory.any()
    state = kernel.evaluate(1.0, q, np.zeros((2, 2)))
    assert state.mover_acts[0] == 0.0 and np.linalg.norm(state.mover_wish) == pytest.approx(1.5)
    kernel.state.mover_position[:] = [[-9.0, 0.0]]
    state = kernel.evaluate(1.1, q, np.zeros((2, 2)))
    assert state.mover_acts[0] == 1.0 and np.allclose(state.mover_wish, [[1.5, 0.0]])
