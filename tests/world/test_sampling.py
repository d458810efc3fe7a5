"""Many samples taken at once are those that are taken one by one."""

from collections.abc import Callable

import numpy as np
import pytest

from escort_mj.world.build import World
from escort_mj.world.callback import native_loop
from escort_mj.world.contacts import ENDED
from escort_mj.world.plant import Plant
from escort_mj.world.sampling import FEW, MOST_NUMBERS, MOST_SAMPLES, room_for

SAMPLES = 300
MEETINGS = {
    "positions": [[0, 0], [0.5, 0], [0, 5], [0.9, 5]],
    "velocities": [[1, 0], [0, 0], [1, 0], [0, 0]],
}


def one_by_one(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Samples and ended episodes, Python looking at every sample."""
    samples, episodes = [], []
    for row in range(SAMPLES):
        plant.step(plant.world.stride if row else 1)
        samples.append(plant.record.copy())
        episodes.append(plant.ended())
    return np.array(samples), np.vstack(episodes)


def many_at_once(plant: Plant, most: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The same, as many at once as there is room for."""
    samples, episodes, left = [], [], SAMPLES
    while left:
        samples.append(plant.samples(min(left, most)).copy())
        episodes.append(plant.ended())
        left -= len(samples[-1])
    return np.vstack(samples), np.vstack(episodes)


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
        plant.state.tally[ENDED] = other.state.tally[ENDED] = room - 1.0
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
    period = meetings.stride * meetings.setup.timestep
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
        room = room_for(record)
        assert room == 1 or FEW <= room <= MOST_SAMPLES and room * record <= MOST_NUMBERS
