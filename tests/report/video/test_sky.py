"""The sky is drawn unless the floor hides all of it."""

import mujoco
import pytest

from escort_mj.report.video.film import skip_sky

WORLD = """
<mujoco>
  <worldbody>
    <geom type="plane" size="{size}" euler="{slope} 0 0"/>
    <geom type="sphere" size="1" pos="0 0 1"/>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(
    ("size", "slope", "elevation", "drawn"),
    [
        ("0 0 1", 0, -60, False),
        ("0 0 1", 0, -10, True),
        ("0 0 1", 0, 30, True),  # from below
        ("0 0 1", -40, -60, True),  # falls away
        ("20 20 1", 0, -60, True),  # ends somewhere
    ],
)
def test_sky(size: str, slope: float, elevation: float, drawn: bool) -> None:
    model = mujoco.MjModel.from_xml_string(WORLD.format(size=size, slope=slope))
    data, scene, camera = mujoco.MjData(model), mujoco.MjvScene(model, 100), mujoco.MjvCamera()
    mujoco.mj_forward(model, data)
    camera.distance, camera.azimuth, camera.elevation = 10.0, 90.0, elevation
    what = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, what, scene)
    skip_sky(scene, 16 / 9)
    assert scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] == drawn
