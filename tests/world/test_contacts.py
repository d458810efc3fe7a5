"""Contacts and clearances: what the native watch records, against MuJoCo read from Python at every step."""

import mujoco
import numpy as np
import pytest

from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant

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
CROWD = {
    "axes": 3,
    "seed": 4,
    "robots": {"count": 9, "placement": {"within": 2.0, "least_gap": 0.05}, "radius": 0.25},
    "mission": {"radius": 0.3, "behaviors": ["surface"]},
    "target": {"radius": 0.2},
    "physics": {"solver": "cg"},
}
ROLLING = {
    "robots": {"kind": "rolling_sphere", "positions": [[3.0, 0.1], [0.0, 6.0]], "radius": 0.3},
    "obstacles": [{"position": [1.5, 0.0], "radius": 0.3}],
    "mission": {"radius": 0.5, "behaviors": ["surface"]},
}


def look(plant: Plant) -> tuple[int, float, set[frozenset[str]]]:
    """Touching pairs that matter, and their largest normal force, as MuJoCo's own functions give them."""
    model, data = plant.world.model, plant.data
    pairs, largest, force = set(), 0.0, np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        names = frozenset(model.geom(int(geom)).name for geom in contact.geom)
        if "floor" in names or contact.efc_address < 0:
            continue
        mujoco.mj_contactForce(model, data, index, force)
        pairs.add(names)
        largest = max(largest, force[0])
    return len(pairs), largest, pairs


@pytest.mark.parametrize(
    ("keys", "steps", "least"),
    [
        (HEAD_ON, 600, 1),
        (INTO_OBSTACLE, 1500, 2),
        (INTO_TARGET, 1500, 2),
        (CROWD, 1500, 5),
        (ROLLING, 2500, 1),
    ],
    ids=["head_on", "into_obstacle", "into_target", "crowd", "rolling"],
)
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_contacts_are_those_of_mujoco(keys, steps, least, cone, make_world, drifting, record_steps) -> None:
    world = drifting(**keys) if keys is HEAD_ON else make_world(**keys)
    world.model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC if cone == "elliptic" else 0
    seen = []

    def launch(plant: Plant) -> None:
        if keys is HEAD_ON:
            plant.data.qvel[[0, 2]] = [2.0, -2.0]

    fine = world.stride
    record = record_steps(world, steps, launch, lambda plant: seen.append(look(plant)))
    counts, forces = np.array([c for c, _, _ in seen], float), np.array([f for _, f, _ in seen])
    assert counts.max() >= least and forces.max() > 0.0
    for index in range(steps):  # the worst since the sample before
        first = index - (index - 1) % fine if index else 0
        assert record["contacts"][index] == counts[first : index + 1].max()
        assert record["contact_force"][index] == pytest.approx(forces[first : index + 1].max(), rel=1e-12)
    onsets = np.cumsum(
        [len(now - before) for before, now in zip([set(), *_pairs(seen)], _pairs(seen), strict=False)]
    )
    np.testing.assert_array_equal(record["contact_onsets"], onsets)


def _pairs(seen: list) -> list[set]:
    return [pairs for _, _, pairs in seen]


def grazing(drifting, rate: float):
    """Two robots that pass each other 20 m/s fast, and touch in step 60 alone."""
    world = drifting({"positions": [[-1.2, 0.0, 0.0], [1.2, 0.39999, 0.0]]}, axes=3, recording={"rate": rate})

    def launch(plant: Plant) -> None:
        plant.data.qvel[[0, 3]] = [10.0, -10.0]

    return world, launch


def test_a_touch_of_a_single_step_between_two_samples_is_seen(drifting, record_steps) -> None:
    fine = record_steps(*_with_steps(grazing(drifting, 500.0), 110))
    assert np.flatnonzero(fine["contacts"]).tolist() == [60]
    world, launch = grazing(drifting, 20.0)
    assert world.stride == 25
    samples = []
    with native_loop(world):
        plant = Plant(world)
        launch(plant)
        for row in range(5):
            plant.step(world.stride if row else 1)
            samples.append(
                (
                    float(plant.state.contacts[0]),
                    float(plant.state.contact_force[0]),
                    float(plant.state.contact_onsets[0]),
                    float(plant.state.robot_clearance_worst[0]),
                )
            )
    contacts, forces, onsets, clearance = np.array(samples).T
    assert contacts.tolist() == [0, 0, 0, 1, 0]
    assert onsets.tolist() == [0, 0, 0, 1, 1]
    assert forces[3] == fine["contact_force"][60] > 0.0
    assert (forces[[0, 1, 2, 4]] == 0.0).all()
    assert clearance[3] == pytest.approx(-1e-5, abs=1e-7)
    assert (clearance[[0, 1, 2, 4]] > 0.0).all()


def _with_steps(made: tuple, steps: int) -> tuple:
    world, launch = made
    return world, steps, launch


def test_the_clearance_at_first_touch_is_no_longer_positive(make_world, record_steps) -> None:
    """Robots and obstacles of one height: contact in MuJoCo and a clearance below zero are the same event."""
    world = make_world(**INTO_OBSTACLE, recording={"rate": 500})
    clear, touching = [], []

    def watch(plant: Plant) -> None:
        clear.append(plant.state.obstacle_clearance_worst.min())
        touching.append(plant.state.contacts[0] > 0.0)

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


def test_one_touch_that_relieves_another_is_an_onset(drifting, record_steps) -> None:
    """Robot 1 leaves robot 2 in the very step in which robots 3 and 4 meet."""
    lateral = 0.39999
    world = drifting(
        {"positions": [[-1.2, 0.0], [1.2, lateral], [-1.22, 5.0], [1.22, 5.0 + lateral]]},
        recording={"rate": 500},
    )

    def launch(plant: Plant) -> None:
        plant.data.qvel[[0, 2, 4, 6]] = [10.0, -10.0, 10.0, -10.0]

    record = record_steps(world, 110, launch)
    assert np.flatnonzero(record["contacts"]).tolist() == [60, 61]
    assert record["contact_onsets"][-1] == 2
