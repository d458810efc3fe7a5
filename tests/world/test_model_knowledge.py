"""What laws are told of the model: MuJoCo's own mass matrix and bias force, and nothing where none asks."""

import mujoco
import numpy as np
import pytest

from escort_mj.monitor.mass import mass_block
from escort_mj.native.compiler.declarations import jitted
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant

TREE = """
<mujoco>
  <worldbody>
    <body><joint type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body>
    <body pos="1 0 0"><freejoint/><geom size="0.3 0.2 0.1" type="box" mass="2" pos="0.1 0.2 0.3"/>
      <body pos="0.5 0 0"><joint axis="0 1 0"/><geom size="0.2" mass="0.7" pos="0 0 0.4"/>
        <body pos="0.5 0 0"><joint axis="1 0 0"/><geom size="0.2" mass="0.3" pos="0 0.3 0.4"/></body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@jitted
def read(mass: int, sizes: int, starts: int, columns: int, first: int, count: int, block: np.ndarray) -> None:
    mass_block(mass, sizes, starts, columns, first, count, block)


@pytest.mark.parametrize(("first", "count"), [(0, 1), (1, 2), (1, 3), (2, 3), (4, 5), (0, 9), (8, 1)])
def test_a_block_is_that_of_the_full_matrix(first: int, count: int) -> None:
    model = mujoco.MjModel.from_xml_string(TREE)
    data = mujoco.MjData(model)
    data.qpos[:] += np.linspace(-1.0, 1.0, model.nq)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    block = np.full(count * count, np.nan)
    places = (data.M, model.M_rownnz, model.M_rowadr, model.M_colind)
    read(*(place.ctypes.data for place in places), first, count, block)
    end = first + count
    np.testing.assert_array_equal(block.reshape(count, count), full[first:end, first:end])
    assert count < 9 or np.count_nonzero(full - np.diag(np.diag(full))) > 20


WORLDS = {
    "plane": {"robots": {"count": 3, "overrides": [{"robot": 2, "mass": 2.5}]}},
    "space": {"axes": 3, "physics": {"gravity": [0.5, 0, -9.81]}, "robots": {"count": 4, "mass": 1.7}},
    "rolling": {"robots": {"kind": "rolling_sphere", "count": 3, "mass": 1.3}},
}


@pytest.mark.parametrize("law", ["pd", "computed_torque"])
@pytest.mark.parametrize("keys", WORLDS.values(), ids=WORLDS)
def test_the_law_is_told_mass_and_bias(keys: dict, law: str, make_world) -> None:
    world = make_world(controller=law, **keys)
    with native_loop(world):
        plant = Plant(world)
        plant.step(20)
        mujoco.mj_forward(world.model, plant.data)
    p, state = world.setup.axes, plant.state
    full = np.zeros((world.model.nv, world.model.nv))
    mujoco.mj_fullM(world.model, plant.data, full)
    for i, mass in enumerate(world.team.mass):
        first = world.model.body(f"robot_{i + 1}").dofadr[0]
        block = full[first : first + p, first : first + p]
        np.testing.assert_array_equal(state.model_mass[i].reshape(p, p), block)
        np.testing.assert_allclose(block, mass * np.eye(p), rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(state.model_bias[i], plant.data.qfrc_bias[first : first + p])
    if p == 3:
        assert state.model_bias[:, 2] == pytest.approx(9.81 * 1.7)


@pytest.mark.parametrize("law", ["apd_smc", "asmc", "pd_smc", "super_twisting"])
def test_the_others_are_told_nothing(law: str, make_world) -> None:
    plant = Plant(make_world(controller=law))
    assert plant.state.model_mass.size == plant.state.model_bias.size == plant.state.v_d_rate.size == 0


@pytest.mark.parametrize("law", ["pd", "computed_torque"])
def test_a_heavy_team_does_not_sag(law: str, make_world, record_steps) -> None:
    """In MuJoCo's own physics, with gravity: on its places at rest the team stays."""
    corners = [[5, 0, 0], [-5, 0, 0], [0, 5, 0], [0, -5, 0], [0, 0, 5], [0, 0, -5]]
    world = make_world(
        axes=3,
        physics={"gravity": [0, 0, -9.81]},
        robots={"positions": corners, "mass": 2.0, "force_limit": 50},
        mission={"behaviors": ["surface"]},
        controller=law,
    )
    record = record_steps(world, 500)
    assert np.abs(record["q"] - np.array(corners)).max() < 1e-9
    np.testing.assert_allclose(record["force"][:, :, 2], 2.0 * 9.81, rtol=1e-9)
