"""Every way to drive a mission: commanded, pushed, taken back to moments of its own and of none other."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import escort_mj
from escort_mj.environments import Simulation
from escort_mj.environments.fleet import Fleet
from escort_mj.errors import UsageError

WISH = np.array([[0.4, -0.2], [0.1, 0.3], [-0.5, 0.2], [0.0, -0.4], [0.3, 0.3]])
REST = np.zeros((5, 2))
PUSHED = 2, [30.0, 0.0], 0.03  # begins and ends between two samples, which are 0.02 s apart


class Way(NamedTuple):
    """One way to drive missions.

    Attributes:
        make: Starts the mission of a scenario.
        drive: Commands robots for a tenth of a second; returns what can be seen of them then.
        session: What of it has `snapshot` and `restore`.
        push: Pushes a robot; None where nothing is simulated that could be pushed.
    """

    make: Callable[[Any], Any]
    drive: Callable[[Any, np.ndarray], np.ndarray]
    session: Callable[[Any], Any] = lambda driven: driven
    push: Callable[[Any], Callable[..., None]] | None = lambda driven: driven.push


class Third:
    """The third mission of a fleet."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet

    def snapshot(self) -> Any:
        return self.fleet.snapshot(2)

    def restore(self, snapshot: Any) -> None:
        self.fleet.restore(2, snapshot)


def motion(session: Any) -> np.ndarray:
    return np.concatenate([session.plant.state.q, session.plant.state.v])


def begun(simulation: Simulation) -> Simulation:
    simulation.reset()
    return simulation


def of_environment(name: str, kind: str) -> Callable[[Any], Any]:
    def make(scenario: Any) -> Any:
        pytest.importorskip("gymnasium")
        if name == "parallel":
            pytest.importorskip("pettingzoo")
        module = __import__(f"escort_mj.environments.{name}", fromlist=[kind])
        environment = getattr(module, kind)(
            **{"scenario": scenario} | ({"num_envs": 3} if name == "vector" else {})
        )
        environment.reset()
        return environment

    return make


def step_live(mission: escort_mj.LiveMission, wish: np.ndarray) -> np.ndarray:
    mission.command(2.0 * wish)
    return motion(mission.step(0.1))


def step_simulation(simulation: Simulation, wish: np.ndarray) -> np.ndarray:
    earned = [simulation.step(wish) for _ in range(5)]
    return np.concatenate(
        [motion(simulation), simulation.observe().reshape(-1, 2), np.reshape(earned, (-1, 1)) * [1, 0]]
    )


def step_fleet(fleet: Fleet, wish: np.ndarray) -> np.ndarray:
    if waiting := [k for k in range(3) if not fleet.begun[k]]:
        for k in waiting:
            fleet.begin(k, 10 + k)
        fleet.advance(waiting, np.zeros((3, 5, 2)))
    for _ in range(5):
        fleet.advance(range(3), np.stack([REST, -wish, wish]))
    return np.concatenate([motion(fleet.missions[2]), fleet.observe()[2].reshape(-1, 2)])


def step_single(environment: Any, wish: np.ndarray) -> np.ndarray:
    for _ in range(5):
        found = environment.step(wish.astype(np.float32))
    return np.append(found[0], found[1])


def step_vector(environment: Any, wish: np.ndarray) -> np.ndarray:
    for _ in range(5):
        found = environment.step(np.stack([REST, -wish, wish]).astype(np.float32))
    return np.append(found[0][2], found[1][2])


def step_parallel(environment: Any, wish: np.ndarray) -> np.ndarray:
    for _ in range(5):
        found = environment.step(dict(zip(environment.agents, wish.astype(np.float32), strict=True)))
    return np.concatenate([*found[0].values(), list(found[1].values())])


def step_controller(controller: Any, wish: np.ndarray) -> np.ndarray:
    team = getattr(controller, "team", controller)
    for _ in range(50):
        now = float(team.snapshot()["clock"][1]) + team.timestep
        q, v = team.start + 0.1 * np.sin(now), 0.1 * np.cos(now) + REST
        if team is controller:
            force = controller(now, q, v, commanded=wish)
        else:
            force = controller(now, q[1], v[1], q, commanded=wish[1])
    return np.concatenate([np.atleast_2d(force), team.signals["rho_hat"], team.signals["q_d"]])


LOGS = tempfile.TemporaryDirectory()


@cache
def log() -> Path:
    """Robots that swing about their starts, as they would log it."""
    path, time = Path(LOGS.name) / "swinging.csv", np.linspace(0.0, 1.0, 41)
    start = escort_mj.Controller(scenario()).start.ravel()
    rows = np.column_stack([time, start + 0.1 * np.sin(np.outer(time, 1.0 + np.arange(10)))])
    names = ",".join(["time", *(f"robot_{robot}.{axis}" for robot in range(1, 6) for axis in "xy")])
    np.savetxt(path, rows, delimiter=",", header=names, comments="")
    return path


def replay(scenario: Any) -> escort_mj.LiveLog:
    return escort_mj.replay(log(), scenario)


def step_log(replayed: escort_mj.LiveLog, wish: np.ndarray) -> np.ndarray:
    replayed.step(0.1)
    return np.concatenate([motion(replayed), replayed["v_d"], replayed["target_position"][None]])


def controller(scenario: Any) -> escort_mj.Controller:
    return escort_mj.Controller(scenario, command="velocity")


def of_simulation(environment: Any) -> Simulation:
    return environment.simulation


def push_of_simulation(environment: Any) -> Any:
    return environment.simulation.push


WAYS = {
    "LiveMission": Way(lambda scenario: escort_mj.start(scenario, command="velocity"), step_live),
    "Simulation": Way(lambda scenario: begun(Simulation(scenario)), step_simulation),
    "Fleet": Way(
        lambda scenario: Fleet(scenario, 3, threads=2), step_fleet, Third, lambda f: f.missions[2].push
    ),
    "EscortEnv": Way(of_environment("single", "EscortEnv"), step_single, of_simulation, push_of_simulation),
    "EscortVectorEnv": Way(
        of_environment("vector", "EscortVectorEnv"),
        step_vector,
        lambda environment: Third(environment.fleet),
        lambda environment: environment.fleet.missions[2].push,
    ),
    "EscortParallelEnv": Way(
        of_environment("parallel", "EscortParallelEnv"), step_parallel, of_simulation, push_of_simulation
    ),
    "Controller": Way(controller, step_controller, push=None),
    "RobotController": Way(lambda scenario: controller(scenario).robot(2), step_controller, push=None),
    "LiveLog": Way(replay, step_log, push=None),
}


def scenario(**changes: Any) -> Any:
    return escort_mj.load_scenario("main", {"duration": 2.0, "expect": []} | changes)


@cache
def made(name: str, number: int = 0) -> Any:
    """A mission driven in a way, that all tests drive on."""
    return WAYS[name].make(scenario())


@cache
def foreign() -> list[Any]:
    """Moments of missions that nobody commands."""
    return [each(scenario()).snapshot() for each in (escort_mj.start, escort_mj.Controller)]


@pytest.mark.parametrize("name", WAYS)
def test_a_moment_comes_back_here_and_in_another_object(name: str) -> None:
    way = WAYS[name]
    driven, other = made(name), made(name, 1)
    way.drive(driven, WISH)
    then = way.session(driven).snapshot()
    first = way.drive(driven, -WISH)
    assert not np.array_equal(way.drive(driven, WISH), first)
    for each in (driven, other, driven):
        way.session(each).restore(then)
        np.testing.assert_array_equal(way.drive(each, -WISH), first)


@pytest.mark.parametrize("name", [name for name in WAYS if name != "LiveLog"])
def test_a_command_is_followed_and_a_push_is_felt(name: str) -> None:
    way, driven = WAYS[name], made(name)
    way.drive(driven, WISH)
    then = way.session(driven).snapshot()
    gone = way.drive(driven, WISH)
    way.session(driven).restore(then)
    assert not np.array_equal(way.drive(driven, REST), gone)
    way.session(driven).restore(then)
    if way.push is None:
        assert not hasattr(driven, "push"), (
            "nothing is simulated; of real robots, `bias` tells what pushes them"
        )
        return
    way.push(driven)(*PUSHED)
    underway = way.session(driven).snapshot()
    pushed = way.drive(driven, WISH)
    assert not np.array_equal(pushed, gone)
    way.session(driven).restore(then)
    np.testing.assert_array_equal(way.drive(driven, WISH), gone, err_msg="the push has not happened")
    way.session(driven).restore(underway)
    np.testing.assert_array_equal(way.drive(driven, WISH), pushed, err_msg="the push has")


@pytest.mark.parametrize("name", WAYS)
def test_moments_of_other_missions_are_refused(name: str) -> None:
    way = WAYS[name]
    driven, other = made(name), way.make(scenario(**{"mission.radius": 3.5}))
    way.drive(driven, WISH)
    way.drive(other, WISH)
    then = way.session(driven).snapshot()
    for each in (way.session(other).snapshot(), *foreign()):
        with pytest.raises(UsageError, match="^snapshot: "):
            way.session(driven).restore(each)
    going_on = way.drive(driven, WISH)
    way.session(driven).restore(then)
    np.testing.assert_array_equal(
        way.drive(driven, WISH), going_on, err_msg="what was refused changed something"
    )


def test_what_was_logged_stays_as_it_was() -> None:
    replayed = replay(scenario())
    for change in ("command", "push", "release", "move_target", "change"):
        with pytest.raises(UsageError, match="^a log of real robots: what has happened cannot be"):
            getattr(replayed, change)(2, [30.0, 0.0])


def test_a_log_stepped_and_taken_back_is_judged_as_it_is_at_once() -> None:
    mission = scenario(duration=1.0, expect=[{"metric": "radius_error_mean", "at_most": 9.0}])
    replayed, whole = replay(mission), escort_mj.judge(log(), mission)
    replayed.step(0.4)
    then = replayed.snapshot()
    part = replayed.step(0.3).run()
    replayed.restore(then)
    while replayed.outcome is escort_mj.Outcome.RUNNING:
        replayed.step(0.013)
    stepped = replayed.run()
    assert (stepped.message, stepped.outcome) == (whole.message, whole.outcome)
    assert part.outcome is escort_mj.Outcome.INTERRUPTED and "0.7 s of swinging.csv" in part.message
    for name in whole.trace.data_vars.keys() - {"watch_value"}:
        np.testing.assert_array_equal(stepped.trace[name].values, whole.trace[name].values)
    assert stepped.values["radius_error_mean"] == pytest.approx(whole.values["radius_error_mean"], rel=1e-12)


def test_all_ways_feel_the_same_push() -> None:
    """Commanded alike at every sample, they have the same bits, also through a push that ends between two."""
    plain = scenario(**{"mission.max_speed": 2.0})
    simulation, mission = begun(Simulation(plain)), escort_mj.start(plain, command="velocity")
    fleet = Fleet(plain, 1)
    fleet.begin(0, plain.seed)
    fleet.advance([0], REST[None])
    for session in (simulation, mission, fleet.missions[0]):
        session.push(*PUSHED)
    for _ in range(5):
        simulation.step(WISH)
        fleet.advance([0], WISH[None])
        mission.command(2.0 * WISH)
        mission.step(0.02)
    np.testing.assert_array_equal(motion(simulation), motion(mission))
    np.testing.assert_array_equal(motion(fleet.missions[0]), motion(mission))
    ours, theirs = simulation.run(), mission.run()
    for name in ("q", "tau", "clearance"):
        np.testing.assert_array_equal(ours.trace[name].values, theirs.trace[name].values)
    for attribute in ("pushes", "interventions"):
        assert np.array_equal(ours.trace.attrs[attribute], theirs.trace.attrs[attribute])


def test_the_controller_gives_the_forces_of_a_commanded_mission() -> None:
    plain = scenario(uncertainty={}, sensing={})
    mission, told = escort_mj.start(plain, command="velocity"), controller(plain)
    told(0.0, mission["q"], mission["v"])
    for step in range(1, 40):
        mission.command(WISH * step / 20.0)
        mission.step()
        told(mission.time, mission["q"], mission["v"], commanded=WISH * step / 20.0)
        for name in ("v_d", "q_d", "tau"):
            np.testing.assert_allclose(told.signals[name], mission[name], rtol=1e-12, atol=1e-12)


def test_what_ends_after_a_moment_goes_on_from_it() -> None:
    simulation = begun(Simulation(scenario()))
    for _ in range(95):
        simulation.step(WISH)
    then = simulation.snapshot()
    while simulation.under_way:
        simulation.step(WISH)
    first = simulation.run()
    with pytest.raises(UsageError, match="call reset"):
        simulation.push(*PUSHED)
    simulation.restore(then)
    assert simulation.under_way and simulation.commands == 96
    while simulation.under_way:
        simulation.step(WISH)
    second = simulation.run()
    assert first.message == second.message == "completed 2 s"
    np.testing.assert_array_equal(first.trace["q"].values, second.trace["q"].values)


def test_a_moment_of_another_seed_suits_environments_alone() -> None:
    simulation, mission = begun(Simulation(scenario())), escort_mj.start(scenario())
    simulation.reset(7)
    then, q = simulation.snapshot(), simulation.plant.state.q.copy()
    simulation.reset(8)
    simulation.restore(then)
    assert simulation.scenario.seed == 7 and np.array_equal(simulation.plant.state.q, q)
    with pytest.raises(UsageError, match="snapshot: is that of another mission"):
        mission.restore(escort_mj.start(scenario(seed=7)).snapshot())


def test_who_is_not_commanded_says_so() -> None:
    with pytest.raises(UsageError, match='command: .* expected command="velocity"'):
        escort_mj.start(scenario()).command(WISH)
    team = escort_mj.Controller(scenario())
    with pytest.raises(UsageError, match='commanded: .* expected command="velocity"'):
        team(0.0, team.start, REST, commanded=WISH)
    with pytest.raises(UsageError, match=r"state: is now snapshot\(\) and restore\(snapshot\)"):
        team.state  # noqa: B018
    with pytest.raises(UsageError, match=r"state: is now snapshot\(\)"):
        team.robot(1).state = {}


def test_what_nobody_judges_is_not_watched_and_goes_as_it_would() -> None:
    mission = escort_mj.load_scenario("main", {"duration": 1.0})
    found = []
    for keep in (False, True):
        fleet = Fleet(mission, 3, threads=1, keep=keep)
        found.append(step_fleet(fleet, WISH))
        assert bool(fleet.missions[2].world.mission.watches) == keep
    np.testing.assert_array_equal(*found)
