"""Many samples taken at once are those that are taken one by one."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from escort_mj.monitor.sampling import FEW, MOST_NUMBERS, MOST_SAMPLES, samples_kept
from escort_mj.scenario.geometry.steps import Schedule
from escort_mj.signals import columns
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant

SAMPLES = 300
MEETINGS = {
    "positions": [[0, 0], [0.5, 0], [0, 5], [0.9, 5]],
    "velocities": [[1, 0], [0, 0], [1, 0], [0, 0]],
}


def one_by_one(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Samples and ended episodes, Python looking at every sample."""
    samples, episodes = [], []
    for row in range(SAMPLES):
        plant.step(plant.world.schedule.stride if row else 1)
        samples.append(plant.record.copy())
        episodes.append(plant.ended())
    return np.array(samples), np.vstack(episodes)


def many_at_once(plant: Plant, most: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The same, as many at once as there is room for."""
    samples, episodes = np.empty((SAMPLES, plant.world.record_size)), []
    for start in range(0, SAMPLES, most):
        episodes.append(plant.fill(samples[start : start + most])[1])
    plant.fold_steps()
    return samples, np.vstack(episodes)


@pytest.fixture(scope="module")
def meetings(drifting: Callable[..., World]) -> World:
    """Two pairs of robots that meet one after the other."""
    return drifting(MEETINGS)


@pytest.mark.parametrize("most", [1, 7, SAMPLES])
def test_the_same_bits_however_many_at_once(meetings: World, most: int) -> None:
    with native_loop(meetings):
        samples, episodes = many_at_once(Plant(meetings), most)
        expected, ended = one_by_one(Plant(meetings))
    assert np.array_equal(samples, expected)
    assert np.array_equal(episodes, ended) and len(ended) == 2


def test_a_full_log_makes_it_look_more_often(meetings: World) -> None:
    """Both meetings end between two looks, and the log has room for one."""
    with native_loop(meetings):
        plant, other = Plant(meetings), Plant(meetings)
        room = len(plant.state.episodes)
        plant.state.ended[0] = other.state.ended[0] = room - 1.0
        samples, episodes = many_at_once(plant)
        expected, ended = one_by_one(other)
    assert np.array_equal(samples, expected)
    assert np.array_equal(episodes, ended) and len(ended) == room - 1 + 2
    assert plant.state.contacts_untold[0] == 0.0


def test_samples_after_single_steps_stay_on_their_grid(meetings: World) -> None:
    with native_loop(meetings):
        plant = Plant(meetings)
        plant.step(3)
        times = plant.samples(3)[:, 0]
    period = meetings.schedule.stride * meetings.setup.timestep
    np.testing.assert_allclose(times, [period, 2 * period, 3 * period], rtol=1e-12)


def test_truth_is_looked_at_sample_by_sample(make_world: Callable[..., World]) -> None:
    """What Python alone can find belongs to every sample."""
    world = make_world(robots={"positions": [[3, 0], [-3, 0]]}, recording={"truth": True})
    with native_loop(world):
        samples, _ = many_at_once(Plant(world))
        expected, _ = one_by_one(Plant(world))
    assert np.array_equal(samples, expected)


def test_room_is_bounded_for_any_size() -> None:
    for record in (1, 342, 10_000, 10_000_000):
        room = samples_kept(record)
        assert room == 1 or FEW <= room <= MOST_SAMPLES and room * record <= MOST_NUMBERS


WINDOWS = [
    {"clearance": ["robots", "robots"], "at_least": 0.0, "after": 0.028, "before": 0.51},
    {"settled": 1.0, "by": 0.018},
]


@pytest.fixture(scope="module")
def windows(drifting: Callable[..., World]) -> World:
    """The same, with further samples where windows begin and end."""
    world = drifting(MEETINGS, duration=0.602, expect=WINDOWS)
    assert world.schedule == Schedule(10, 301, (8, 9, 13, 14, 255, 301))
    return world


def test_further_samples_tell_of_the_steps_since_the_one_before(windows: World) -> None:
    """What is watched of every step, over samples wherever they are, is what it is over all steps."""
    schedule = windows.schedule
    with native_loop(windows):
        found = np.empty((schedule.count, windows.record_size))
        plant, rows = Plant(windows), []
        plant.fill(found)
        plant.fold_steps()
        plant.reset()
        for _ in range(schedule.last + 1):
            plant.step(1)
            rows.append(plant.record)
    every = np.array(rows)
    taken = [schedule.step(sample) for sample in range(schedule.count)]
    np.testing.assert_array_equal(found, every[taken])
    places = every[:, columns("q", windows.sizes)].reshape(len(every), 4, 2)
    gaps = np.linalg.norm(places[:, 0] - places[:, 1], axis=1) - 2 * windows.setup.robot_radius[0]
    least = found[:, columns("clearance", windows.sizes)].reshape(len(found), 4, -1)[:, 0, 0]
    expected = [gaps[before + 1 : step + 1].min() for before, step in pairwise([-1, *taken])]
    np.testing.assert_allclose(least, expected, atol=1e-12)


@pytest.mark.parametrize("most", [1, 7])
def test_further_samples_are_the_same_however_many_at_once(windows: World, most: int) -> None:
    with native_loop(windows):
        samples, _ = many_at_once(Plant(windows), most)
        whole, _ = many_at_once(Plant(windows))
    assert np.array_equal(samples, whole)


def test_back_to_a_mark(meetings: World) -> None:
    """What is simulated again from a mark is what it was, contacts included."""
    first, second = np.empty((2, 40, meetings.record_size))
    with native_loop(meetings):
        plant = Plant(meetings)
        plant.fill(np.empty((3, meetings.record_size)))
        mark = plant.mark()
        (_, ended), under_way = plant.fill(first), plant.under_way()
        plant.back_to(mark)
        _, again = plant.fill(second)
    assert np.array_equal(first, second) and np.array_equal(ended, again) and len(ended)
    assert np.array_equal(under_way, plant.under_way())
