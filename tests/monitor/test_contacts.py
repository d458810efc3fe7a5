"""Contacts: what the native log says, against MuJoCo read from Python at every step."""

import mujoco
import numpy as np
import pytest

from escort_mj.monitor.signals import (
    CLOSING_SPEED,
    DEPTH,
    FIRST,
    IMPULSE,
    PEAK_FORCE,
    SECOND,
    START,
    TOUCH_TIME,
)
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant
from tests.corpus import missions
from tests.world.episodes import both, told

HEAD_ON = {"robots": {"positions": [[-1.0, 0.0], [1.0, 0.05]], "mass": 2.0}, "obstacles": []}
INTO_OBSTACLE = {
    "robots": {"positions": [[4.0, 0.0], [0.0, 9.0]], "radius": 0.3},
    "obstacles": [{"position": [2.5, -0.52]}, {"position": [2.5, 0.52]}],
    "target": {"position": [0.0, 0.0]},
    "mission": {"radius": 1.0, "behaviors": ["surface"]},
}
INTO_TARGET = {
    "robots": {"positions": [[2.0, 0.0], [0.3, -2.0]]},
    "target": {"position": ["0.1*t", 0.0], "radius": 0.5},
    "mission": {"radius": 0.2, "behaviors": ["surface"]},
}
MISSIONS = missions(__file__)
ROLLING = {
    "robots": {"kind": "rolling_sphere", "positions": [[3.0, 0.1], [0.0, 6.0]], "radius": 0.3},
    "obstacles": [{"position": [1.5, 0.0], "radius": 0.3}],
    "mission": {"radius": 0.5, "behaviors": ["surface"]},
}
INTO_WALL = {
    "robots": {"positions": [[4.0, 0.2], [0.0, 9.0]], "radius": 0.3},
    "walls": [{"points": [[2.0, -1.0], [2.0, 1.0]]}],
    "target": {"position": [0.0, 0.0]},
    "mission": {"radius": 1.0, "behaviors": ["surface"]},
}


@pytest.mark.crossed
@pytest.mark.parametrize(
    ("keys", "steps", "least"),
    [
        (HEAD_ON, 600, 1),
        (INTO_OBSTACLE, 1500, 2),
        (INTO_TARGET, 1500, 2),
        (MISSIONS["crowd"], 1500, 20),
        (ROLLING, 2500, 3),
        (INTO_WALL, 1500, 1),
        (MISSIONS["pushed"], 1500, 2),
    ],
    ids=["head_on", "into_obstacle", "into_target", "crowd", "rolling", "into_wall", "pushed"],
)
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_episodes_are_those_of_mujoco(keys, steps, least, cone, make_world, drifting) -> None:
    world = drifting(**keys) if keys is HEAD_ON else make_world(**keys)
    world.model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC if cone == "elliptic" else 0

    def launch(plant: Plant) -> None:
        if keys is HEAD_ON:
            plant.data.qvel[[0, 2]] = [2.0, -2.0]

    found, expected, plant = both(world, steps, launch)
    assert len(found) >= least and found[:, PEAK_FORCE].max() > 0.0
    assert plant.state.contacts_untold[0] == 0.0
    np.testing.assert_array_equal(found[:, : TOUCH_TIME + 1], expected[:, : TOUCH_TIME + 1])
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    assert np.median(found[:, CLOSING_SPEED]) > 0.0


def grazing(drifting, rate: float):
    """Two robots that pass each other 20 m/s fast, and touch in step 60 alone."""
    world = drifting({"positions": [[-1.2, 0.0, 0.0], [1.2, 0.39999, 0.0]]}, axes=3, recording={"rate": rate})

    def launch(plant: Plant) -> None:
        plant.data.qvel[[0, 3]] = [10.0, -10.0]

    return world, launch


def test_a_touch_of_a_single_step_between_two_samples_is_seen(drifting) -> None:
    world, launch = grazing(drifting, 20.0)
    assert world.schedule.stride == 25
    log, clearance = [], []
    with native_loop(world):
        plant = Plant(world)
        launch(plant)
        for row in range(5):
            plant.step(world.schedule.stride if row else 1)
            log.append(plant.ended() if plant.has_ended else None)
            clearance.append(plant.state.clearance[:, 0].copy())
    assert [rows is not None for rows in log] == [False, False, False, True, False]
    (row,) = log[3]
    assert (row[FIRST], row[SECOND]) == (0.0, 1.0)
    assert row[START] == pytest.approx(60 * 0.002, abs=1e-12)
    assert row[TOUCH_TIME] == 0.002
    assert row[DEPTH] == pytest.approx(1e-5, abs=1e-7)
    assert row[PEAK_FORCE] > 0.0 and row[IMPULSE] == row[PEAK_FORCE] * 0.002
    clear = np.array(clearance)
    np.testing.assert_allclose(clear[3], -row[DEPTH], rtol=0, atol=1e-14)
    assert (clear[[0, 1, 2, 4]] > 0.0).all()


def test_a_grazing_miss_of_one_millimeter_is_no_contact(drifting) -> None:
    world = drifting({"positions": [[-1.2, 0.0, 0.0], [1.2, 0.401, 0.0]]}, axes=3)
    with native_loop(world):
        plant = Plant(world)
        plant.data.qvel[[0, 3]] = [10.0, -10.0]
        plant.step(121)
        assert plant.state.clearance[0, 0] > 0.0
        assert not len(told(plant))
        plant.reset()
        plant.data.qvel[[0, 3]] = [10.0, -10.0]
        nearest = np.inf
        for _ in range(121):
            plant.step(1)
            nearest = min(nearest, float(plant.state.clearance[0, 0]))
        assert nearest == pytest.approx(0.001, abs=1e-12)


def test_the_clearance_at_first_touch_is_no_longer_positive(make_world, record_steps) -> None:
    """Robots and obstacles of one height: contact in MuJoCo and a clearance below zero are the same event."""
    world = make_world(**INTO_OBSTACLE, recording={"rate": 500})
    clear, touching = [], []

    def watch(plant: Plant) -> None:
        clear.append(plant.state.clearance[:, 2].min())
        touching.append(len(plant.under_way()) > 0)

    record_steps(world, 1500, after=watch)
    assert any(touching)
    assert touching == [value < 0.0 for value in clear]


def test_point_masses_never_touch_the_floor(make_world) -> None:
    world = make_world(robots={"positions": [[3, 0], [0, 3]], "overrides": [{"robot": 1, "radius": 1.0}]})
    with native_loop(world):
        plant = Plant(world)
        for _ in range(50):
            plant.step(1)
            assert plant.data.ncon == 0


def test_balls_on_the_floor_have_one_long_episode_each(make_world) -> None:
    world = make_world(robots={"kind": "rolling_sphere", "positions": [[3, 0], [0, 3], [-3, 0]]})
    found, expected, _ = both(world, 700)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    floor = len(world.bodies.names) - 1
    lasting = found[found[:, TOUCH_TIME] > 1.0]
    assert sorted(lasting[:, FIRST]) == [0.0, 1.0, 2.0] and (lasting[:, SECOND] == floor).all()


def test_one_touch_that_relieves_another_is_an_episode_of_its_own(drifting) -> None:
    """Robot 1 leaves robot 2 in the very step in which robots 3 and 4 meet."""
    lateral = 0.39999
    world = drifting(
        {"positions": [[-1.2, 0.0], [1.2, lateral], [-1.22, 5.0], [1.22, 5.0 + lateral]]},
    )
    with native_loop(world):
        plant = Plant(world)
        plant.data.qvel[[0, 2, 4, 6]] = [10.0, -10.0, 10.0, -10.0]
        plant.step(110)
    rows = told(plant)
    assert rows[:, [FIRST, SECOND]].tolist() == [[0.0, 1.0], [2.0, 3.0]]
    np.testing.assert_allclose(rows[:, START], [0.12, 0.122], atol=1e-12)


def test_a_log_that_overflows_is_counted(drifting) -> None:
    """Nobody takes ended episodes off: when there is no room left, every further one counts."""
    world = drifting({"positions": [[0.0, 0.0], [0.45, 0.0]]})
    with native_loop(world):
        plant = Plant(world)
        room = len(plant.state.episodes)
        meetings = room + 5
        for _ in range(meetings):
            for place in (0.39, 0.45):
                plant.data.qpos[2], plant.data.qvel[:] = place, 0.0
                plant.step(1)
        assert len(plant.ended()) == room
        assert plant.state.contacts_untold[0] == 5.0


def test_more_pairs_at_once_than_there_is_room_for_are_counted(drifting) -> None:
    """40 robots on one heap: 780 pairs touch, there is room for 8 a body."""
    world = drifting({"positions": [[0.001 * i, 0.0] for i in range(40)]})
    with native_loop(world):
        plant = Plant(world)
        plant.step(1)
        room = plant.state.touches.shape[1]
        assert plant.data.ncon == 780 > room
        assert len(plant.under_way()) == room == 8 * len(world.bodies.names)
        assert plant.state.contacts_untold[0] == 780 - room


def test_forward_between_steps_counts_nothing_twice(make_world) -> None:
    """In contact, where warm starts differ and only totals can be compared."""
    keys = {"robots": {"positions": [[3, 0]]}, "obstacles": [{"position": [1.5, 0]}]}
    touching = make_world(**keys, mission={"radius": 0.5, "behaviors": ["surface"]})
    with native_loop(touching):
        plant = Plant(touching)
        while not len(plant.under_way()):
            plant.step(1)
        state = plant.state
        totals = [
            state.effort,
            state.work,
            state.saturated_time,
            state.watched_step,
            state.turn,
            state.under_way,
            state.ended,
        ]
        for _ in range(5):
            mujoco.mj_forward(touching.model, plant.data)
            log = plant.under_way()
            after_one = [total.copy() for total in totals]
            for _ in range(4):
                mujoco.mj_forward(touching.model, plant.data)
            for now, once in zip(totals, after_one, strict=True):
                assert np.array_equal(now, once)
            np.testing.assert_array_equal(plant.under_way(), log)
            plant.step(2)  # the first of the same time
            assert plant.under_way()[0, TOUCH_TIME] == pytest.approx(log[0, TOUCH_TIME] + 0.002)
