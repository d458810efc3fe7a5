"""Property 2 and the Coriolis matrix, on mechanisms whose mass matrix depends on the configuration."""

import mujoco
import numpy as np
import pytest

from escort_mj.world.properties import MassProperties

MECHANISMS = """
<mujoco>
  <worldbody>
    <body>
      <joint name="cart" type="slide" axis="1 0 0"/><geom size="0.2" mass="2"/>
      <body pos="0 0 -0.1">
        <joint type="hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.7" mass="0.5"/>
        <body pos="0 0 -0.7">
          <joint type="hinge" axis="0 1 0.3"/>
          <geom type="capsule" size="0.05 0.3" pos="0.1 0 -0.4" mass="0.8"/>
        </body>
      </body>
    </body>
    <body pos="5 0 0"><freejoint/><geom size="0.3" mass="3"/></body>
    <body pos="9 0 0">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><geom size="0.2" mass="1.5"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def properties() -> MassProperties:
    return MassProperties(mujoco.MjModel.from_xml_string(MECHANISMS))


def states(model: mujoco.MjModel, count: int = 20):
    random = np.random.default_rng(4)
    for _ in range(count):
        qpos = random.uniform(-2.0, 2.0, model.nq)
        mujoco.mj_normalizeQuat(model, qpos)
        yield qpos, random.uniform(-3.0, 3.0, model.nv)


def test_mass_matrices_are_mujocos(properties) -> None:
    model = properties.model
    data, whole = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    for qpos, _ in states(model):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        found = properties.mass_matrices(qpos)
        np.testing.assert_allclose(found[0], whole[:3, :3], rtol=0, atol=1e-12)
        np.testing.assert_allclose(found[1], whole[3:6, 3:6], rtol=0, atol=1e-12)
        np.testing.assert_allclose(found[2, :2, :2], whole[9:, 9:], rtol=0, atol=1e-12)
        assert not found[2, 2].any() and not found[2, :, 2].any()


def test_bias_is_mujocos(properties) -> None:
    model = properties.model
    data = mujoco.MjData(model)
    for qpos, qvel in states(model):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(properties.bias(qpos, qvel)[0], data.qfrc_bias[:3], rtol=0, atol=1e-12)


def test_a_pendulum_on_a_cart_by_hand() -> None:
    """M = [[m1 + m2, m2 l cos], [m2 l cos, m2 l^2 + I]]: C has one entry, -m2 l sin(angle) rate."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><geom size="0.2" mass="2"/>
        <body><joint type="hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 0.7" mass="0.5"/></body>
        </body></worldbody></mujoco>"""
    )
    coriolis = MassProperties(model).coriolis(np.array([0.3, 0.9]), np.array([1.1, -2.0]))[0]
    expected = np.zeros((2, 2))
    expected[0, 1] = -0.5 * 0.7 * np.sin(0.9) * -2.0
    np.testing.assert_allclose(coriolis, expected, rtol=0, atol=1e-8)


def test_both_residuals_vanish(properties) -> None:
    moving = 0.0
    for qpos, qvel in states(properties.model):
        residuals = properties.residuals(qpos, qvel)
        assert residuals.skew.shape == residuals.coriolis.shape == (3,)
        assert residuals.skew.max() < 1e-7
        assert residuals.coriolis.max() < 1e-7
        moving = max(moving, np.abs(properties.coriolis(qpos, qvel)).max())
    assert moving > 1.0


@pytest.mark.parametrize("planted", ["mass", "christoffel", "bias"])
def test_a_planted_error_is_caught(planted: str, properties, monkeypatch) -> None:
    qpos, qvel = next(states(properties.model))
    true_mass, true_coriolis, true_bias = properties.mass_matrices, properties.coriolis, properties.bias
    if planted == "mass":  # one that changes along a coordinate as no mechanism's does
        monkeypatch.setattr(properties, "mass_matrices", lambda q: true_mass(q) * (1.0 + 0.01 * q[0]))
    elif planted == "christoffel":
        monkeypatch.setattr(properties, "coriolis", lambda q, v: 0.99 * true_coriolis(q, v))
    else:
        monkeypatch.setattr(properties, "bias", lambda q, v: true_bias(q, 0.99 * v))
    residuals = properties.residuals(qpos, qvel)
    assert residuals.coriolis[0] > 1e-3
    assert (residuals.skew[0] > 1e-3) == (planted == "christoffel")
