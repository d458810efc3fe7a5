"""Ground effect: the curve of Cheeseman and Bennett."""

import numpy as np
import pytest

from escort_mj.conformance.stand import Stand
from escort_mj.disturbances.ground_effect import GroundEffect
from escort_mj.scenario.schema.scenario import Scenario

# Height in radii, and the ratio of thrusts: 16/15 and so on.
CURVE = [(0.5, 4.0 / 3.0), (1.0, 16.0 / 15.0), (1.5, 36.0 / 35.0), (2.0, 64.0 / 63.0), (0.1, 4.0 / 3.0)]


@pytest.mark.parametrize(("axes", "ground"), [(3, 0.0), (2, -1.5)])
def test_thrust_gains_what_the_curve_says(axes: int, ground: float) -> None:
    effect = GroundEffect(thrust=3.0, rotor_radius=0.2, ground=ground, offset=0.05)
    stand = Stand(effect, Scenario, len(CURVE), axes)
    stand.state.q[:, -1] = [ground - 0.05 + 0.2 * height for height, _ in CURVE]
    stand.call()
    found = stand.state.disturbance_force
    np.testing.assert_allclose(1.0 + found[:, -1] / 3.0, [ratio for _, ratio in CURVE], rtol=1e-12)
    assert np.abs(found[:, :-1]).max() == 0.0
