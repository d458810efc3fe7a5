"""Teams: the NumPy form beside the kernel, and who changes over, by hand."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from escort_mj import Scenario
from escort_mj.control.setup import Setup
from escort_mj.scenario.mission import Mission
from tests.control.twins import TOLERANCE, Kernel, assert_same
from tests.oracle.failure import KnownRobots as Formed
from tests.oracle.reference import ReferenceController
from tests.oracle.setup import setup_now
from tests.oracle.teams import Teams

STEP, STEPS = 0.1, 60
RADIO = {"rate": 5.0, "delay": 0.2, "loss": 0.2}
ESCORTS = {
    "b": [{"team": None}, {"after": 1.2, "team": "two"}],
    "c": [{"after": 1.5, "team": "one"}, {"after": 3.0, "team": None}, {"after": 4.5, "team": "two"}],
}
AVOID = {"behavior": "avoid_obstacles", "safe_distance": 0.3}

PHASES = [
    {"team": "two", "behaviors": [AVOID, "surface", "repulsion"]},
    {"team": "one", "after": 1.5, "behaviors": ["surface"],
     "when": {"quantity": "robot_distance", "below": 4.0, "scope": "team"}},
]  # fmt: skip


def mission(
    axes: int,
    behaviors: list[object],
    failures: object = (),
    outer: object = "nsb",
    laws: Sequence[object] = (None, None, None),
    limit: float | None = None,
    escorts: Mapping[str, object] | None = None,
    own: Mapping[int, object] | None = None,
    **keys: object,
) -> Setup:
    """Nine robots in three teams, one with two targets; losses and changes of targets where given."""
    rest = [0.0] * (axes - 1)
    targets = [
        {
            "name": name,
            "position": [f"{x} + {v}*t", *rest],
            "radius": 0.3,
            "escorted_by": (escorts or {}).get(name, []),
        }
        for name, x, v in (("a", 0, 0.3), ("b", 12, 0), ("c", 13.5, 0), ("d", -12, -0.2))
    ]
    teams = [
        {"name": "one", "robots": [2, 4, 6], "radius": 9 if escorts else 3,
         "radii": [{"after": 3.5, "radius": 4}] if escorts else [], "targets": targets[:1],
         "demand": [{"after": 2.0, "robots": 4}, {"after": 4.0, "robots": 2}]},
        {"name": "two", "robots": [1, 3, 5, 9], "radius": 4, "targets": targets[1:3],
         "demand": [{"robots": 3}]},
        {"name": "three", "robots": [7, 8], "radius": 2, "targets": targets[3:],
         "demand": [{"after": 4.0, "robots": 3}]},
    ]  # fmt: skip
    for team, law in zip(teams, laws, strict=True):
        team["controller"] = law
    return Mission(
        Scenario(
            axes=axes, physics={"timestep": STEP}, recording={"rate": 10}, seed=axes, target=None,
            teams=teams, robots={
                "count": 9, "radius": 0.2, "failures": failures, "force_limit": limit,
                "overrides": [{"robot": robot, "controller": law} for robot, law in (own or {}).items()],
            },
            **keys, obstacles=[{"position": [30.0] * axes, "radius": 0.5}],
            mission={"max_speed": 1.5, "outer": outer, "behaviors": behaviors, "supervisor": PHASES},
        )
    ).setup  # fmt: skip


@pytest.mark.crossed
@pytest.mark.parametrize("failures", [[], [{"robot": 4, "at": 1.0}, {"robot": 9, "at": 5.0}]])
@pytest.mark.parametrize(("axes", "spread"), [
    (2, "vertices"), (3, "repulsion"),
])  # fmt: skip
def test_kernel_and_twin_agree(axes: int, spread: object, failures: list[object]) -> None:
    """Of all that spreads, and with every outer loop, in tests/control/test_knowing_teams.py."""
    walk(axes, spread, failures=failures)


def test_they_agree_with_a_lidar() -> None:
    walk(2, "vertices", sensing={"lidar": {"rays": 24}})


@pytest.mark.crossed
@pytest.mark.parametrize("knows", [False, True])
@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("spread", ["vertices", "repulsion", "spacing"])
def test_they_agree_where_targets_change_teams(spread: object, axes: int, knows: bool) -> None:
    """One target has no team at first; another one leaves its team, is alone for a while, and joins again."""
    keys: dict[str, Any] = {"failures": [{"robot": 4, "at": 1.0}]}
    if knows:
        sight = {"robots": [1, 4, 7], "noise": {"position": 0.05, "velocity": 0.05}}
        knowledge = {"initial": {"position": 0.3, "velocity": 0.1}, "target": sight}
        keys = {"knowledge": {**knowledge, "estimator": "covariance_intersection"}, "communication": RADIO}
    if spread == "spacing" and axes == 3:
        pytest.skip("spacing is for two axes")
    kernel = walk(axes, spread, escorts=ESCORTS, **keys)
    assert kernel.state.obstacle_team.tolist() == [0, 1, 2, 2, 3]
    assert kernel.state.team_radius.tolist() == [4.0, 4.0, 2.0]


def test_targets_belong_to_their_team_from_the_step_on_that_begins_then() -> None:
    setup = mission(2, [AVOID, "surface"], escorts=ESCORTS)
    kernel, found = Kernel(setup), []
    kernel.state.mover_position[:] = [mover.path.position(0.0) for mover in setup.movers]
    for step in range(STEPS):
        state = kernel.evaluate(step * STEP, np.zeros((9, 2)), np.zeros((9, 2)))
        found.append(state.obstacle_team.astype(int).tolist())
        assert state.team_center[0, 0] == np.mean([[0.0, 12.0, 13.5, -12.0][j - 1] for j in range(1, 5)
                                                   if found[-1][j] == 1])  # fmt: skip
    assert found[:12] == [[0, 1, 0, 2, 3]] * 12 and found[12:15] == [[0, 1, 2, 2, 3]] * 3
    assert found[15:30] == [[0, 1, 2, 1, 3]] * 15 and found[30:45] == [[0, 1, 2, 0, 3]] * 15
    assert found[45:] == [[0, 1, 2, 2, 3]] * 15


@pytest.mark.crossed
@pytest.mark.parametrize("limit", [None, 20.0])
@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("laws", [
    ("asmc", None, {"law": "pd_smc", "slope": 7.0}),
    ({"law": "computed_torque", "acceleration_filter": 1.0}, {"law": "computed_torque"}, "pd"),
    ({"law": "super_twisting", "anti_windup": False}, {"initial_estimate": 3.0}, "terminal_smc"),
])  # fmt: skip
def test_they_agree_where_each_team_has_a_law(laws: object, axes: int, limit: float | None) -> None:
    """Robots change over, some saturate, and the gain of avoidance goes by the slope of their law."""
    walk(axes, "vertices", laws=laws, limit=limit, failures=[{"robot": 4, "at": 1.0}])


@pytest.mark.parametrize("laws", [(None, None, None), (None, "pd", {"law": "super_twisting"})])
def test_they_agree_where_robots_have_laws_of_their_own(laws: object) -> None:
    """Robots 4 and 7 keep theirs where they change over to other teams."""
    own = {4: "asmc", 7: {"law": "computed_torque", "slope": 7.0}, 9: "pd"}
    walk(2, "vertices", laws=laws, limit=20.0, own=own)


def test_the_derivative_goes_on_where_a_robot_changes_to_another_filter() -> None:
    """A ramp of 1 m/s^2, of which a slow filter has shown 0.6: the fast one begins there, and not at 8."""
    slow, fast = ({"law": "computed_torque", "acceleration_filter": lag} for lag in (2.0, 0.05))
    setup = replace(mission(2, [AVOID, "surface"], laws=(fast, slow, slow)), outside="velocity")
    kernel, q, members, rates = Kernel(setup), np.zeros((9, 2)), [], []
    for step in range(STEPS):
        kernel.state.v_d[:] = step * STEP
        state = kernel.evaluate(step * STEP, q, np.zeros((9, 2)))
        members.append(state.member_of.copy())
        rates.append(state.v_d_rate[:, 0].copy())
    changed = np.argwhere((np.diff(members, axis=0) != 0) & (np.array(members)[1:] == 1.0))
    assert len(changed)
    for step, robot in changed:
        before, after = rates[step][robot], rates[step + 1][robot]
        assert before < 0.7 and before < after < 1.0
    assert np.max(rates) <= 1.0 + 1e-12


def test_robots_of_two_teams_come_nearer_only_as_fast_as_their_margin_allows() -> None:
    teams = [
        {"name": name, "robots": [robot],
         "targets": [{"name": f"of_{name}", "position": [f"{x} + {v}*t", y]}]}
        for name, robot, x, y, v in (("left", 1, 0.0, 5.0, 1.0), ("right", 2, 0.9, -5.0, -1.0))
    ]  # fmt: skip
    setup = Mission(Scenario(
        target=None, teams=teams, robots={"positions": [[0, 0], [0.9, 0]]},
        mission={"outer": {"loop": "set_based", "rate": 4.0}, "behaviors": [AVOID, "surface"]},
    )).setup  # fmt: skip
    kernel = Kernel(setup)
    for rows, sign in ((kernel.state.mover_position, 0), (kernel.state.mover_velocity, 1)):
        paths = [mover.path for mover in setup.movers]
        rows[:] = [path.velocity(0.0) if sign else path.position(0.0) for path in paths]
    v = kernel.evaluate(0.0, np.array([[0.0, 0.0], [0.9, 0.0]]), np.zeros((2, 2))).v_d
    margin = 0.9 - 0.4 - 0.3  # both want 1 m/s; conditions have a stiffness of 1e4
    assert v[0, 0] - v[1, 0] == pytest.approx(4.0 * margin, rel=2e-4)


def walk(
    axes: int,
    spread: object,
    tolerance: float = TOLERANCE,
    avoid: object = AVOID,
    steps: int = STEPS,
    **more: Any,
) -> Kernel:
    """Lets both go a way together, and compares them at each step."""
    stack = [avoid, {"behavior": "connect", "distance": 3.0} if spread == "connect" else spread, "surface"]
    setup = mission(axes, stack, **more)
    random = np.random.default_rng(3)
    start = setup.obstacle_position[1:]
    q = start[[1, 0, 1, 0, 1, 0, 3, 3, 2]] + random.normal(scale=2.0, size=(9, axes))
    kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
    twin.reset(q)
    seen: set[object] = set()
    for step in range(steps):
        t = step * STEP
        speed = np.array([mover.path.velocity(t) for mover in setup.movers])
        place = np.array([mover.path.position(t) for mover in setup.movers])
        kernel.state.mover_position[:], kernel.state.mover_velocity[:] = place, speed
        twin.setup = replace(
            twin.setup, obstacle_position=np.vstack([setup.obstacle_position[:1], place]),
            obstacle_velocity=np.vstack([np.zeros((1, axes)), speed]),
        )  # fmt: skip
        twin._supervisor.setup = twin._holder.setup = twin.setup
        v = random.normal(scale=0.1, size=q.shape)
        state, signals = kernel.evaluate(t, q, v), twin.evaluate(t, q, v)
        assert_same(state, signals, tolerance)
        assert twin._teams is not None
        assert np.array_equal(state.member_of, twin._teams.members + 1)
        assert np.abs(state.team_center - twin._teams.center).max() < TOLERANCE
        assert np.array_equal(state.team_radius, twin._teams.radius)
        for number, each in enumerate(twin._teams.targets, 1):
            assert np.flatnonzero(state.obstacle_team == number).tolist() == sorted(each)
        if twin._minds is not None:
            assert np.array_equal(state.target_seen, twin._minds.seen)
            assert np.abs(state.belief_covariance - twin._minds.view.belief_covariance).max() < 1e-9
            assert np.array_equal(state.belief_fix, twin._minds.view.belief_fix)
        assert ((signals.phase != 1.0) | (state.member_of == 2.0)).all()
        assert ((signals.phase != 2.0) | (state.member_of == 1.0)).all()
        seen |= {tuple(map(int, state.member_of)), *signals.phase}
        q = q + STEP * signals.v_d
    assert len(seen) >= 6 and seen >= {0.0, 1.0, 2.0}
    return kernel


def standing(**demand: list[dict[str, float]]) -> tuple[Teams, Formed, Setup]:
    """Six robots on a line: 1 to 3 around a target at 0, and 4 to 6 around one at 10 m."""
    teams = [
        {"name": name, "robots": robots, "radius": 3, "demand": demand.get(name, []),
         "targets": [{"name": f"of_{name}", "position": [x, 0]}]}
        for name, robots, x in (("left", [1, 2, 3], 0), ("right", [4, 5, 6], 10))
    ]  # fmt: skip
    behaviors = [{"behavior": "avoid_obstacles", "safe_distance": 0.3}, "vertices", "surface"]
    setup = Mission(Scenario(
        target=None, teams=teams, robots={"positions": [[x, 0] for x in (-3, 2, 3, 6.5, 7, 13)]},
        mission={"behaviors": behaviors},
    )).setup  # fmt: skip
    return Teams(setup), Formed.whole(setup), setup_now(setup)


PLACES = np.array([[x, 0.0] for x in (-3, 2, 3, 6.5, 7, 13)])


def test_the_nearest_robot_that_can_be_spared_changes_over() -> None:
    teams, formed, setup = standing(left=[{"after": 1.0, "robots": 5}])
    teams.form(0.9, PLACES, formed, setup)
    assert teams.members.tolist() == [0, 0, 0, 1, 1, 1]
    teams.form(1.0, PLACES, formed, setup)
    assert teams.members.tolist() == [0, 0, 0, 0, 0, 1]  # one robot always stays


def test_a_team_keeps_what_it_needs_and_a_loss_is_made_good() -> None:
    teams, formed, setup = standing(left=[{"robots": 3}], right=[{"robots": 2}])
    lost = replace(formed, lost=np.array([True, False, False, False, False, False]))
    teams.form(0.0, PLACES, lost, setup)
    assert teams.members.tolist() == [0, 0, 0, 0, 1, 1]
    lost = replace(formed, lost=np.array([True, True, False, False, False, False]))
    teams.form(1.0, PLACES, lost, setup)
    assert teams.members.tolist() == [0, 0, 0, 0, 1, 1]


def test_a_changed_team_forms_again_evenly() -> None:
    teams, formed, setup = standing(left=[{"robots": 4}])
    formed = teams.form(0.0, PLACES, formed, setup)
    turned = np.einsum("iab,ib->ia", teams.rotation, formed.vertices)
    for number, count in ((0, 4), (1, 2)):
        points = turned[teams.members == number]
        angles = np.sort(np.arctan2(points[:, 1], points[:, 0]))
        assert len(points) == count and np.allclose(np.diff(angles), 2.0 * np.pi / count)
