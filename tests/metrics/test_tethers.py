"""How far tethers are stretched, on synthetic ways; `world.test_tethers` has what they do."""

import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME
from tests.synthetic import make_trace


def recomputed_tether_stretch_max(again):
    """Over a mission of `test_recomputed`."""
    tethers = again.case.keys["robots"].get("tethers", [])
    if not tethers:
        return None
    gaps = [again.q[:, a["between"][0] - 1] - again.target for a in tethers]  # all are to the target
    return float(
        max((np.linalg.norm(gap, axis=1) - a["length"]).max() for gap, a in zip(gaps, tethers, strict=True))
    )


def test_the_most_stretched_one_and_when():
    q = np.zeros((len(TIME), 3, 2))
    q[:, 1, 0] = 2.0 + np.sin(TIME)
    q[:, 2, 1] = 1.0
    trace = make_trace(TIME, robots=3, q=q)
    trace.attrs["tethers"], trace.attrs["tether_length"] = [1, 2, 0, 3], [2.5, 4.0]
    found = measure("tether_stretch_max", trace)
    assert found.value == pytest.approx(0.5, abs=1e-3) and found.bodies == ("robot_1", "robot_2")
    assert np.sin(found.time) == pytest.approx(1.0, abs=1e-3)
    assert measure("tether_stretch_max", trace, after=3.5, before=5.5).value == pytest.approx(
        max(-0.5 + np.sin(3.5), -0.5 + np.sin(5.5)), abs=0.02
    )


def test_without_tethers_there_is_none():
    found = measure("tether_stretch_max", make_trace(TIME, robots=2))
    assert found.value is None and found.reason == "no robot is on a tether"
