"""Who is held up at the end: on synthetic ways, and in missions, each held up by something else."""

import re
from pathlib import Path

import numpy as np
import pytest

from escort_mj import Scenario
from escort_mj.api.runs import Run
from escort_mj.judging.judge import judge_log
from escort_mj.measuring import measure
from escort_mj.mission import fly
from tests.corpus import read
from tests.metrics.motions import TIME
from tests.metrics.test_arrival import _heads, _there

GOALS = {"behavior": "goal", "goals": [[8.0, 0.0], [8.0, 4.0]]}
MISSIONS = read(Path(__file__).with_name("stuck.yaml"))
BLOCKED, AROUND, SPACE = (Scenario(**MISSIONS[name]) for name in ("blocked", "around", "space"))


ROCK = r"held up: robot 1 at \(1\.3, -?[01](\.\d+)?\) m, 0\.5 m from rock"
GATE = r"held up: robot 1 at \(6\.2, -?[01](\.\d+)?\) m, 0\.5 m from gate"


def said(scenario: Scenario, **changes: object) -> str:
    """What a mission's outcome adds to its end."""
    run = fly(scenario.replace({key.replace("__", "."): value for key, value in changes.items()}))
    return run.message.partition("; ")[2]


def test_outcome_and_verdict_say_who_where_and_by_what(compiled: None) -> None:
    run = fly(BLOCKED)
    words = run.message.removeprefix("completed 25 s; ")
    assert re.fullmatch(ROCK, words)
    assert (
        run.verdicts[1].message == f"stuck at most 0: 1 (robot 1 at 25.00 s), {words}; at samples of 0.02 s"
    )


@pytest.mark.parametrize("outer", ["nsb", "barrier_filter"])
def test_every_outer_loop_says_it(compiled: None, outer: str) -> None:
    assert said(BLOCKED, mission__outer=outer).startswith("held up: robot 1 at (1.")


def test_who_finds_a_way_around_is_not_held_up(compiled: None) -> None:
    assert said(BLOCKED, mission__outer={"loop": "set_based", "patience": 1.0}, duration=40.0) == ""


def test_robots_of_an_escort_are_held_up_too(compiled: None) -> None:
    assert re.fullmatch(GATE, said(AROUND))
    drives_on = {"position": ["-0.1*t", "0"]}
    assert said(AROUND, target=drives_on).startswith("held up: robot 1 at (6.2, ")


def test_what_holds_up_is_what_keeps_its_distance_and_not_the_nearest_body(compiled: None) -> None:
    """A teammate passes nearer than the rock, but may come nearer yet."""
    wide = {"behavior": "avoid_obstacles", "safe_distance": 1.5, "teammate_distance": 0.2}
    waits = {"behavior": "goal", "goals": [[8.0, 0.0], [0.3, 0.9]]}
    words = said(BLOCKED, mission__behaviors=(wide, waits), robots__positions=[[0.0, 0.0], [0.3, 3.0]])
    assert words.startswith("held up: robot 1 at (0.3") and words.endswith("1.5 m from rock")


def test_in_space(compiled: None) -> None:
    assert re.fullmatch(r"held up: robot 1 at \(0\.8, \S+, \S+\) m, 0\.5 m from slab", said(SPACE))
    words = said(SPACE, mission__behaviors=SPACE.mission.behaviors[1:])
    assert re.fullmatch(r"held up: robot 1 at \(1\.3, \S+, \S+\) m, touching slab", words)


def test_who_is_too_weak_is_held_up_by_no_body(compiled: None) -> None:
    words = said(BLOCKED, robots__force_limit=1e-6, duration=8.0, mission__outer="nsb")
    assert words == "held up: robot 1 at (0, 0) m, by no body; robot 2 at (0, 4) m, by no body"


def test_failed_robots_are_named_as_such(compiled: None) -> None:
    dead = {"positions": [[0.0, 0.0], [0.0, 4.0]], "failures": [{"robot": 2, "at": 0.0}]}
    assert re.fullmatch(ROCK + r"; failed: robot 2 at \(0, 4\) m", said(BLOCKED, robots=dead))
    dead = {"positions": [[8.0, 0.0], [-8.0, 0.0]], "failures": [{"robot": 2, "at": 0.0}]}
    assert said(AROUND, robots=dead).endswith("0.5 m from gate; without robot 2, which failed")


def test_a_goal_of_an_earlier_phase_is_none(compiled: None) -> None:
    leave = [{"name": "escort", "after": 5.0, "behaviors": ["surface"]}]
    mission = {"radius": 3.0, "max_speed": 1.0, "behaviors": [GOALS], "supervisor": leave}
    assert said(AROUND, mission=mission, obstacles=()) == ""


def test_at_any_rate_of_samples_who_moves_is_not_at_rest(compiled: None) -> None:
    far = {"behavior": "goal", "goals": [[99.0, 0.0], [99.0, 4.0]]}
    moving = BLOCKED.replace({"obstacles": (), "mission.behaviors": (far,)})
    for rate in (0.1, 0.5, 50):
        assert said(moving, recording__rate=rate) == ""
        assert said(BLOCKED, recording__rate=rate).startswith("held up: robot 1 at (1.3, ")


def test_who_reaches_a_goal_meanwhile_is_on_its_way(compiled: None) -> None:
    slow = {"target": None, "obstacles": (), "duration": 9.0, "robots.radius": 0.2, "mission.max_speed": 0.03}
    goals = {"behavior": "goal", "goals": [[[0.22, 0.0], [3.0, 0.0]], [[0.0, 4.0], [0.22, 4.0]]]}
    assert said(BLOCKED, **slow, mission__behaviors=(goals,)) == ""


@pytest.mark.slow
def test_a_log_says_it_and_does_not_blame_bodies_that_it_lacks(compiled: None, tmp_path) -> None:
    log = Run(fly(BLOCKED)).save(tmp_path / "run").export(tmp_path / "log.csv")
    assert re.search(ROCK + "$", judge_log(log, BLOCKED).message)
    cart = {"shape": "box", "size": [1.0, 2.0], "motion": {"position": ["3 + 0*t", 0]}, "name": "cart"}
    words = judge_log(log, BLOCKED.replace(obstacles=(cart,))).message
    assert re.search(r"cart not in the log, and not judged; held up: robot 1 at \S+ \S+ m$", words)


def found(make_trace, q: np.ndarray, error: np.ndarray | float, **given: object):
    """What the metric says of one robot at places with errors of `surface`, which has a radius of 5 m."""
    errors = np.stack([np.zeros((len(TIME), 1)), np.broadcast_to(error, (len(TIME), 1))], axis=2)
    place = np.pad(q[:, None, None], ((0, 0), (0, 0), (0, 1)))
    return measure("stuck", make_trace(TIME, q=place, task_error=errors, **given))


def test_at_rest_is_who_neither_moves_nor_comes_nearer(make_trace) -> None:
    still, creeping = np.zeros(len(TIME)), 0.02 * TIME
    assert found(make_trace, still, 2.0).value == 1.0
    assert found(make_trace, still, 0.2).value == 0.0  # within 5 % of the radius
    assert found(make_trace, creeping, (2.0 - creeping)[:, None]).value == 0.0  # slowly on its way
    assert found(make_trace, creeping, 2.0).value == 1.0  # along a wall
    assert found(make_trace, 0.05 * TIME, 2.0).value == 0.0
    blip = np.where(np.abs(TIME - 8.0) < 0.1, 0.2, 2.0)[:, None]
    assert found(make_trace, still, blip).value == 0.0  # it was there for a moment


def test_no_place_no_value(make_trace) -> None:
    found = measure("stuck", make_trace(TIME, truth=False, about={"behaviors": ["guard", "chords"]}))
    assert found.reason == "robots have neither goals nor places in a formation"
    assert measure("stuck", make_trace(TIME[:200])).reason == "the window is shorter than 5 s"


def test_many_are_counted_and_the_first_are_placed(make_trace) -> None:
    errors = np.full((len(TIME), 9, 2), 2.0)
    many = measure("stuck", make_trace(TIME, robots=9, task_error=errors, robot_distance_min=1.0))
    assert many.value == 9.0 and many.manner.count("robot ") == 6 + 6 and many.manner.endswith("; 3 more")


def recomputed_stuck(again) -> float | None:
    """Rests for 5 s, and is not at its goal, or 5 % off the radius all the time."""
    headed, surface = _heads(again), "surface" in str(again.case.keys.get("mission", "surface"))
    if again.time[-1] < 5.0 or not (headed or surface):
        return None
    late = again.time >= again.time[-1] - 5.0 - 1e-9
    place = again.q[late]
    if headed:
        there, away, at = _there(again)
        off, away = ~there[-1] & (at[late][0] == at[-1]), away[late]
    else:
        target = again.signal("target_position")[late][:, None]
        away = np.abs(np.linalg.norm(place - target, axis=2) - again.case.radius)
        off = (away > 0.05 * again.case.radius).all(axis=0)
    still = (np.linalg.norm(place - place[-1], axis=2) <= again.case.robot).all(axis=0)
    return float((still & (away[0] - away[-1] < 0.25 * again.case.robot) & off).sum())
