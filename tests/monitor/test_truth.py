"""The truth channel against plain MuJoCo calls, and against the law, which may not feel it."""

import mujoco
import numpy as np
import pytest

from escort_mj.signals import LYAPUNOV, SIGNALS
from escort_mj.signals import TRUTH as TRUTH_CHANNEL
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant
from tests.corpus import missions

POSITIONS = [[5, 10], [-5, 5], [-5, -5], [5, -10], [5, 0]]
MISSIONS = missions(__file__)
ROLLING = {
    "robots": {"kind": "rolling_sphere", "positions": POSITIONS, "force_limit": 10},
    "mission": {"radius": 5.0},
}
TRUTH = {"recording": {"truth": True}}
WORLDS = {"plane": MISSIONS["loud"], "space": MISSIONS["in_space"], "rolling": ROLLING}


@pytest.fixture(params=WORLDS)
def world(request, make_world) -> World:
    return make_world(**WORLDS[request.param], **TRUTH)


def dense(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix


def test_mass_bias_and_external_force_are_mujocos(world) -> None:
    model, p = world.model, world.sizes["axis"]
    n = world.sizes["robot"]
    with native_loop(world):
        plant = Plant(world)
        plant.step(137)
        data, state = plant.data, plant.state
        matrix = dense(model, data)
        for i in range(n):
            dofs = model.body(f"robot_{i + 1}").dofadr[0] + np.arange(p)
            own = matrix[np.ix_(dofs, dofs)]
            tree = np.flatnonzero(model.dof_treeid == model.dof_treeid[dofs[0]])
            rest = np.setdiff1d(tree, dofs)
            np.testing.assert_allclose(state.mass_matrix[i].reshape(p, p), own, rtol=0, atol=1e-12)
            assert state.mass_coupling[i] == pytest.approx(
                np.linalg.norm(matrix[np.ix_(dofs, rest)]), abs=1e-12
            )
            np.testing.assert_allclose(state.bias_force[i], data.qfrc_bias[dofs], rtol=0, atol=1e-12)
            others = data.qfrc_applied + data.qfrc_passive + data.qfrc_constraint
            coupling = matrix[np.ix_(dofs, rest)] @ data.qacc[rest]
            np.testing.assert_allclose(state.external_force[i], others[dofs] - coupling, rtol=0, atol=1e-12)


def test_the_disturbance_is_all_that_is_external_to_free_masses(make_world, record_steps) -> None:
    record = record_steps(make_world(**MISSIONS["loud"], **TRUTH), 500)
    np.testing.assert_allclose(record["external_force"], record["disturbance"], rtol=0, atol=1e-12)
    assert np.abs(record["disturbance"]).max() > 0.1


def test_a_ball_is_moved_by_its_mass_and_by_friction(make_world, record_steps) -> None:
    """A ball that rolls without slipping has 7/5 of its mass: friction takes 2/7 of the motors' force."""
    record = record_steps(make_world(**ROLLING, **TRUTH), 400)
    np.testing.assert_allclose(record["mass_matrix"], np.broadcast_to(np.eye(2), (400, 5, 2, 2)), atol=1e-12)
    late = slice(300, 400)
    force, friction = record["force"][late], record["external_force"][late]
    assert np.abs(force).max() > 1.0
    assert np.abs(friction + 2.0 / 7.0 * force).max() < 0.02 * np.abs(force).max()


@pytest.mark.parametrize("name", WORLDS)
def test_the_law_feels_nothing_of_the_truth(name, make_world, record_steps) -> None:
    """With the truth channel, without it, and with garbage in its memory after every step: the same bits."""
    told = {signal.name for signal in SIGNALS if signal.channel in (TRUTH_CHANNEL, LYAPUNOV)}
    random = np.random.default_rng(8)

    def spoil(plant: Plant) -> None:
        for field in (*told, "mass_before", "reference_torque_before", "v_d_before", "pending"):
            memory = getattr(plant.state, field)
            memory[...] = 1e6 * random.standard_normal(memory.shape)

    without = record_steps(make_world(**WORLDS[name]), 300)
    with_it = record_steps(make_world(**WORLDS[name], **TRUTH), 300)
    spoiled = record_steps(make_world(**WORLDS[name], **TRUTH), 300, after=spoil)
    assert not told & set(without) and told <= set(with_it)
    for signal, values in without.items():
        assert values.tobytes() == with_it[signal].tobytes(), signal
        assert values.tobytes() == spoiled[signal].tobytes(), signal
    assert (with_it["lyapunov_change"] != spoiled["lyapunov_change"]).any()


def test_forward_at_the_same_time_books_nothing(make_world, record_steps) -> None:
    world = make_world(**MISSIONS["loud"], **TRUTH)
    plain = record_steps(world, 200)
    looked = record_steps(world, 200, after=lambda plant: mujoco.mj_forward(world.model, plant.data))
    for name in ("lyapunov", "lyapunov_change", "reference_torque"):
        assert plain[name].tobytes() == looked[name].tobytes(), name
