"""Causes of touches: one mission for each rule, and touches that no rule may explain."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.metrics import METRICS
from escort_mj.metrics.causes import CAUSES, _Scene, causes_of, some_velocity
from escort_mj.mission import Flight, fly
from escort_mj.scenario import parse_scenario
from escort_mj.signals import EPISODE as COLUMNS
from tests.control.test_conditions import slack


def recomputed_touches_unexplained(again: Any) -> float:
    """In test_recomputed.py, robots without motors start on their way into each other; those with do not."""
    return again.contacts() if np.abs(again.force).max() > 1e-9 else 0.0


HEAD = "target: null\n"
AT_A_ROCK = """
robots: {positions: [[0, 0]]}
obstacles: [{name: rock, position: [3, 0]}]
mission: {max_speed: 2, outer: OUTER, behaviors: [BEHAVIORS {behavior: goal, goals: [[6, 0]]}]}
"""
BLIND = AT_A_ROCK.replace("OUTER", "nsb").replace("BEHAVIORS", "")
AVOIDING = AT_A_ROCK.replace("OUTER", "set_based").replace(
    "BEHAVIORS", "{behavior: avoid_obstacles, safe_distance: 0.3},"
)
STAYING = """
mission:
  outer: set_based
  max_speed: 1
  behaviors: [{behavior: avoid_obstacles, safe_distance: 0.3}, {behavior: goal, goals: GOALS}]
"""
CART = "obstacles: [{name: cart, shape: box, size: [0.5, 0.9], motion: {position: ['-5 + SPEED*t', 0]}}]\n"
CORRIDOR = "walls: [{points: [[-6, 0], [1, 0]], corridor: 2}, {points: [[1, -1.5], [1, 1.5]]}]\n"
ALONE = "robots: {positions: [[0, 0]]}\n" + STAYING.replace("GOALS", "[[0, 0]]")
LEAPING = ALONE + CART.replace("0.9", "0.2").replace("-5 + SPEED*t", "-0.95 + 6*max(t - 1.5, 0)")
STUBBORN = ALONE.replace("set_based", "nsb").replace("{behavior: avoid_obstacles, safe_distance: 0.3}, ", "")
STUBBORN += CART.replace("SPEED", "0.9") + "duration: 6\n"
VESSEL = """
duration: 3
robots:
  kind: {kind: surface_vessel, heading: -2.7}
  radius: 0.4
  mass: 0.9
  force_limit: 0.4
  positions: [[0, 0]]
obstacles: [{name: ball, radius: 0.5, motion: {position: ["4.3 - 2.3*t", -0.54]}}]
sensing: {radius: {obstacles: 3}}
""" + STAYING.replace("GOALS", "[[-2, -2.4]]").replace("max_speed: 1", "max_speed: 0.5")
PAIR = "robots: {positions: [[0, 0], [0.9, 0]]}\n" + STAYING.replace("GOALS", "[[0, 0], [0.9, 0]]")


THROWN = """
duration: 2
target: {position: [0, 0], radius: 0.3}
robots: {positions: [[2, 0], [-2, 0.1]], force_limit: 10, radius: 0.2, FAILURES}
mission:
  outer: set_based
  max_speed: 2
  radius: 2
  behaviors: [{behavior: avoid_obstacles, safe_distance: 0.4, teammate_distance: 0.4}, surface]
"""


@pytest.mark.parametrize(
    ("change", "force", "met", "cause"),
    [
        ({}, [-60.0, 0.0], "target", True),
        ({"target.position": [0, 9], "mission.radius": 9.2}, [-60.0, 1.6], "robot_2", False),
        (
            {"target.position": [0, 9], "mission.radius": 9.2, "robots.failures": [{"robot": 2, "at": 0.1}]},
            [-60.0, 1.6],
            "robot_2",
            True,
        ),
    ],
    ids=["at a target", "at a robot, which has to make room", "at a robot without motors"],
)
def test_a_push_beyond_the_motors_is_a_cause(change: Any, force: Any, met: str, cause: bool) -> None:
    scenario = parse_scenario(THROWN.replace(", FAILURES", "")).replace(change)
    mission = escort_mj.start(scenario).step(0.3)
    mission.push(1, force, 0.3)
    first = causes_of(mission.step(1.5).run().trace)[0]
    assert first.bodies == ("robot_1", met)
    assert (first.cause == "pushed") is cause


@cache
def flown(text: str) -> Flight:
    """A mission, flown once for all tests."""
    flight = fly(parse_scenario(HEAD + ("" if "duration" in text else "duration: 3\n") + text))
    assert flight.outcome.good
    return flight


def causes(text: str) -> list[str]:
    flight = flown(text)
    found = causes_of(flight.recording)
    assert flight.measures["touches_unexplained"].value == sum(each.cause == "unexplained" for each in found)
    return [each.cause for each in found]


@pytest.mark.slow_cases("2")
@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("rate", [2, 50])
def test_causes_are_of_samples_and_found_at_any_rate_of_them(rate: int) -> None:
    judged = f"recording: {{rate: {rate}}}\nexpect: [{{metric: touches_unexplained, at_most: 9}}]\n"
    flight = fly(parse_scenario(HEAD + "duration: 3\n" + judged + LEAPING))
    assert flight.outcome.good and len(causes_of(flight.recording)) > 0
    assert flight.verdicts[1].message.endswith(f"at samples of {1 / rate:g} s")


@pytest.mark.parametrize(
    ("text", "first"),
    [
        (AVOIDING + "uncertainty: {disturbance: [12, 0]}\n", "disturbed"),
        (AVOIDING + "sensing: {position: {bias: [-0.6, 0]}}\n", "misled"),
        (AVOIDING.replace("[[0, 0]]", "[[2, 0]], velocities: [[6, 0]]"), "started"),
        (ALONE + CART.replace("SPEED", "4").replace("0.9", "2"), "outrun"),
        (LEAPING, "outrun"),
        (ALONE + CART.replace("SPEED", "0.9") + "duration: 7\n" + CORRIDOR, "boxed in"),
        (VESSEL, "overtaxed"),
    ],
)
def test_rules_find_causes(text: str, first: str) -> None:
    assert causes(text)[0] == first


COASTING = """\
duration: 3
target: null
obstacles: [{position: ROCK, radius: 0.5}]
robots:
  positions: [[0, 0], [6, 0], [9, 9]]
  radius: 0.15
  failures: [{robot: 1, at: 1}, {robot: 2, at: 1}]
mission:
  max_speed: 1.5
  behaviors:
    - {behavior: avoid_obstacles, safe_distance: 0.4, teammate_distance: 0.2}
    - {behavior: goal, goals: [[8, 0], [-2, 0], [9, 9]]}
"""


@pytest.mark.parametrize(
    ("rock", "met"), [("[3.5, 0]", ("robot_2", "obstacle_1")), ("[4, 4]", ("robot_1", "robot_2"))]
)
def test_a_robot_without_motors_that_coasts_into_something_has_a_cause(rock: str, met: Any) -> None:
    first = causes_of(fly(parse_scenario(COASTING.replace("ROCK", rock))).recording)[0]
    assert (first.bodies, first.cause) == (met, "failed")


def test_who_is_pushed_into_another_is_pushed() -> None:
    found = causes(PAIR + CART.replace("SPEED", "4").replace("0.9", "2"))
    assert found[0] == "outrun"
    assert "pushed" in found
    assert "unexplained" not in found


@pytest.mark.parametrize(
    "text",
    [
        BLIND,
        STUBBORN,
        AVOIDING.replace("0.3}", "0.3, gain: printed}").replace(
            "set_based", "{loop: set_based, braking: 500}"
        )
        + "controller: {law: pd, derivative_gain: 1}\n",
    ],
    ids=["no avoidance", "it could have fled", "it brakes too late"],
)
def test_defects_of_avoidance_stay_unexplained(text: str) -> None:
    """Whatever lets robots run into things that they could have kept clear of is no cause."""
    assert causes(text)[0] == "unexplained"


@pytest.fixture(scope="module")
def hit() -> Any:
    """A record of a robot that stays where a cart comes, though it could flee, and when they touch."""
    trace = flown(STUBBORN).recording
    return trace, causes_of(trace)[0].time


def vectors(trace: Any, x: Any, y: Any = 0.0) -> tuple[tuple[str, str, str], np.ndarray]:
    """A signal of the robot with the same components."""
    shape = trace["v"].values.shape[:2]
    both = [np.broadcast_to(np.reshape(one, (-1, 1)), shape) for one in (x, y)]
    return ("time", "robot", "axis"), np.stack(both, axis=2)


@pytest.mark.parametrize(
    ("reference", "force", "cause"),
    [(1.0, 100.0, "overtaxed"), (-1.0, 100.0, "unexplained"), (1.0, 5.0, "unexplained")],
    ids=["it asks for all", "its reference leads into the cart", "it asks for little"],
)
def test_a_robot_whose_motors_give_all_on_a_clear_way_is_overtaxed(
    hit: Any, reference: float, force: float, cause: str
) -> None:
    trace, touched = hit
    gained = np.maximum(trace["time"].values - touched + 1.0, 0.0)  # 1 m/s^2
    changed = {"v_d": vectors(trace, reference), "tau": vectors(trace, force), "v": vectors(trace, gained)}
    assert causes_of(trace.assign(**changed))[0].cause == cause


@pytest.fixture(scope="module")
def crash() -> Any:
    """A record of a robot that flies into a rock at 2 m/s, and when they touch."""
    trace = flown(BLIND).recording
    return trace, causes_of(trace)[0].time


@pytest.mark.parametrize(
    ("reference", "force", "cause"),
    [(-1.0, -100.0, "overtaxed"), (2.0, -100.0, "unexplained"), (-1.0, -5.0, "unexplained")],
    ids=["its references led clear", "they led into the rock", "it asks for little"],
)
def test_a_robot_that_skids_is_overtaxed_where_its_references_led_clear(
    crash: Any, reference: float, force: float, cause: str
) -> None:
    """It stops, speeds up again for 0.2 s against motors that give all, and slows down too late."""
    trace, touched = crash
    left = touched - trace["time"].values
    v = 2.0 - 3.0 * np.maximum(1.0 - left, 0.0) + 14.0 * np.clip(0.3 - left, 0.0, 0.2)
    changed = {"v_d": vectors(trace, reference), "tau": vectors(trace, force), "v": vectors(trace, v)}
    assert causes_of(trace.assign(**changed))[0].cause == cause


@pytest.mark.slow
@pytest.mark.parametrize("mission", [1212, 1490], ids=["a vessel that drifts", "a quadrotor that tilts"])
def test_missions_of_the_safety_study_that_motors_decide(mission: int) -> None:
    """One touch each of these had no cause while references were followed from the answer on."""
    from benchmarks.safety import attempt

    found = {touch.cause for touch in attempt(mission).touches}
    assert "overtaxed" in found and "unexplained" not in found


@pytest.mark.parametrize(("thrust", "foreseen"), [(9.0, True), (7.0, False)])
def test_a_body_that_turns_faster_than_half_of_the_motors_is_not_foreseen(
    hit: Any, thrust: float, foreseen: bool
) -> None:
    trace, touched = hit
    time = trace["time"].values
    left, row = touched - time, int(np.searchsorted(time, touched))
    place = np.stack([-0.7 - 2.0 * left, 0.5 * 4.0 * left**2], axis=1)  # m, turns with 4 m/s^2
    scene = _Scene(trace.assign(obstacle_position=(("time", "obstacle", "axis"), place[:, np.newaxis])))
    found = scene._foreseen(trace["body"].values.tolist().index("cart"), row - 10, row, thrust)
    assert found == (row - 10 if foreseen else row)


def test_no_alarm_counts_while_a_robot_accelerates_against_its_motors(hit: Any) -> None:
    trace, touched = hit
    time = trace["time"].values
    row = int(np.searchsorted(time, touched))
    turned = row - 20
    v = 0.5 * np.abs(time - time[turned])  # slows down, then follows
    for force, found in ((100.0, row - 20), (5.0, row - 40), (-100.0, row)):
        scene = _Scene(trace.assign(v=vectors(trace, v), tau=vectors(trace, force)))
        assert abs(scene._answered(0, row - 40, row) - found) <= 3  # a window of 0.1 s, half of it


def test_without_touches_there_is_nothing_to_explain() -> None:
    assert causes(AVOIDING) == []


def test_every_cause_says_its_rule() -> None:
    assert list(CAUSES) == [
        *("pushed", "failed", "started", "disturbed", "misled", "outrun", "boxed in", "overtaxed"),
    ]


@pytest.mark.parametrize("axes", [2, 3])
def test_a_robot_is_boxed_in_where_a_linear_program_finds_no_velocity(axes: int) -> None:
    """Drawn half planes that clearly leave a velocity, and those that clearly leave none."""
    random, found = np.random.default_rng(axes), []
    for _ in range(100):
        r = random.normal(size=(int(random.integers(1, 9)), axes))
        r /= np.linalg.norm(r, axis=1, keepdims=True)
        b, most = random.normal(scale=0.7, size=len(r)), float(random.uniform(0.5, 2.0))
        room = slack(r, b, most)
        if abs(room) > 0.15 * most:  # a polyhedron fills less than the sphere
            assert some_velocity(r, b, most) == (room > 0.0), (r, b, most, room)
            found.append(room > 0.0)
    assert 20 < sum(found) < len(found) - 20


def test_a_rock_beside_the_way_boxes_nobody_in(crash: Any) -> None:
    """One that flies into a rock without avoidance could have stopped: every sample leaves a velocity."""
    scene = _Scene(crash[0])
    assert not scene._boxed_in(0, slice(0, 100), 2.0, 100.0)


@pytest.mark.parametrize(("rate", "touches", "long"), [(50, 200, False), (500, 20, False), (500, 200, True)])
def test_causes_are_left_out_of_a_summary_where_they_take_long(make_trace, rate, touches, long):
    """By touches times bodies times samples around each: of 500 a second there are ten times those of 50."""
    episodes = np.zeros((touches, len(COLUMNS)))
    trace = make_trace(np.arange(0.0, 4.0, 1.0 / rate), robots=3, episodes=episodes)
    metric = next(each for each in METRICS if each.name == "touches_unexplained")
    assert metric.dear is not None and metric.dear(trace) == long
