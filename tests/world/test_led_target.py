"""A target that is led: MuJoCo has it where the law has it, and what it drives through is a touch."""

from collections.abc import Callable

import numpy as np
import pytest

from escort_mj.monitor.signals import (
    CLOSING_SPEED,
    DEPTH,
    END,
    FIRST,
    IMPULSE,
    PEAK_FORCE,
    SECOND,
    START,
    TOUCH_TIME,
)
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.shapes import nearest_on_shape
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant
from tests.corpus import missions
from tests.world.episodes import told

DT, R = 0.002, 0.3
MISSIONS = missions(__file__)


def mission(target: dict, axes: int = 2, **keys) -> Scenario:
    far = [[0.0, 40.0, *[0.0] * (axes - 2)], [0.0, -40.0, *[0.0] * (axes - 2)]]
    return Scenario.model_validate(
        {
            "axes": axes,
            "target": target,
            "robots": {"positions": far, "force_limit": 1e-12},
            "mission": {"radius": 40.0, "behaviors": ["surface"]},
            **keys,
        }
    )


@pytest.mark.parametrize("target", MISSIONS["violent"].values(), ids=list(MISSIONS["violent"]))
def test_mujoco_has_it_where_the_law_has_it_at_every_step(target: dict, compiled: None) -> None:
    world = build(mission(target))
    fastest, before = 0.0, None
    with native_loop(world):
        plant = Plant(world)
        for _ in range(100):
            plant.step(1)
            here = plant.data.geom("target_body").xpos[:2]
            np.testing.assert_allclose(here, plant.state.target_position, rtol=0.0, atol=1e-14)
            if before is not None:
                fastest = max(fastest, float(np.linalg.norm(here - before)) / DT)
            before = here.copy()
    assert fastest > 90.0


def touches_of(world: World, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """The log of episodes, and the target's position at every step."""
    places = []
    with native_loop(world):
        plant = Plant(world)
        for _ in range(steps):
            plant.step(1)
            places.append(plant.state.target_position.copy())
        return told(plant), np.array(places)


OBSTACLES = {
    "sphere": {"radius": 0.6},
    "box": {"shape": "box", "size": [0.8, 0.5, 0.4]},
    "ellipsoid": {"shape": "ellipsoid", "size": [0.8, 0.5, 0.6]},
}


@pytest.mark.parametrize(
    ("axes", "shape"),
    [(2, "sphere"), (2, "box"), (3, "ellipsoid"), (3, "sphere"), (4, "sphere"), (9, "sphere")],
)
def test_what_it_drives_through_is_a_touch_of_each_unbroken_stretch(
    axes: int, shape: str, compiled: None
) -> None:
    """Back and forth past the obstacle's center by 0.1 m: one episode for each pass."""
    target = {"position": ["3*cos(2*t)", "0.1", *["0"] * (axes - 2)], "radius": R}
    scenario = mission(target, axes, obstacles=[OBSTACLES[shape] | {"position": [0.0] * axes}])
    found, places = touches_of(build(scenario), 2200)
    (body,) = obstacles_of(scenario)
    if body.is_sphere:
        gaps = np.linalg.norm(places, axis=1) - 0.6 - R
    else:
        gaps = nearest_on_shape(body.solid, np.pad(places, ((0, 0), (0, 3 - axes))))[1] - R
    inside = gaps < 0.0
    starts = np.flatnonzero(inside & ~np.roll(inside, 1))
    ends = np.flatnonzero(~inside & np.roll(inside, 1))
    assert len(found) == len(starts) == 3
    for row, first, last in zip(found, starts, ends, strict=True):
        assert (row[FIRST], row[SECOND]) == (2.0, 3.0)
        assert row[START] == pytest.approx(DT * first, abs=1e-9)
        assert row[END] == pytest.approx(DT * last, abs=1e-9)
        assert row[TOUCH_TIME] == pytest.approx(DT * (last - first), abs=1e-9)
        assert row[PEAK_FORCE] == row[IMPULSE] == 0.0
        if shape == "sphere":
            assert row[DEPTH] == pytest.approx(-gaps[first:last].min(), abs=1e-12)
            speed = (
                6.0 * abs(np.sin(2.0 * DT * first)) * abs(places[first, 0]) / np.linalg.norm(places[first])
            )
            assert row[CLOSING_SPEED] == pytest.approx(speed, rel=1e-9)


def test_what_moves_is_left_to_mujoco(compiled: None) -> None:
    """A rock that is driven has forces, and stays one body of one touch at a time."""
    rock = {"motion": {"position": ["2", "0.001*t"]}, "radius": 0.6}
    found, _ = touches_of(build(mission({"position": ["t", "0"], "radius": R}, obstacles=[rock])), 700)
    assert len(found) and (found[:, PEAK_FORCE] > 0.0).all()


def test_displacements_are_those_of_every_step(compiled: None, record_steps: Callable[..., dict]) -> None:
    """Of the target and of a rock that is driven, the largest since the sample before."""
    rock = {"motion": {"position": ["20+2*sin(40*t)", "0"]}, "radius": 0.6}
    still = {"position": [-20.0, 0.0]}
    scenario = mission({"position": ["cos(50*t)", "sin(90*t)"]}, obstacles=[rock, still])
    fine = build(
        scenario.model_copy(update={"recording": scenario.recording.model_copy(update={"rate": 500})})
    )
    every = record_steps(fine, 201)
    sampled = record_steps(build(scenario), 201)
    moved = np.linalg.norm(np.diff(every["target_position"], axis=0), axis=1) / DT
    rocks = np.linalg.norm(np.diff(every["obstacle_position"], axis=0), axis=2) / DT
    np.testing.assert_allclose(every["target_speed_max"][1:, ...].ravel(), moved, rtol=1e-12)
    np.testing.assert_allclose(every["obstacle_speed_max"][1:], rocks, rtol=1e-9, atol=1e-12)
    stride = 10  # at the default rate of 50 samples a second
    worst = moved.reshape(-1, stride).max(axis=1)
    np.testing.assert_allclose(sampled["target_speed_max"].ravel()[stride::stride], worst, rtol=1e-12)
    assert rocks[:, 0].max() > 50.0 and not rocks[:, 1].any()
