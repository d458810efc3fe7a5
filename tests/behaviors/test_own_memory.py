"""What behaviors and rules of plugins integrate of their own: recorded, held where other phases rule."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from tests.plugged import COMPILED

TEXT = """
from typing import ClassVar, Literal
from escort_mj.plugins import Behavior, Memory, Robots, Rule, Task, Vec, keep_distance, norm, unit_axis

class Steady(Behavior):
    behavior: Literal["steady"] = "steady"
    missed: ClassVar[Memory] = Memory("m s", "integral of the radius error")
    gain: float = 0.8
    integral: float = 0.3

    def task(self, r: Robots) -> Task:
        return keep_distance(r.q - r.target, r.radius - self.integral * r.missed[0], self.gain)

    def missed_rate(self, r: Robots) -> Vec:
        return (norm(r.q - r.target) - r.radius) * unit_axis(r.q, 0)
COMPILED

class Gone(Rule):
    quantity: Literal["gone"] = "gone"
    way: ClassVar[Memory] = Memory("m", "way gone")

    def value(self, r: Robots):
        return r.way[-1]

    def way_rate(self, r: Robots) -> Vec:
        return norm(r.v) * unit_axis(r.q, -1)
COMPILED
"""
KEYS: dict[str, Any] = {"target": {"position": ["0.2*t", "0"]}, "duration": 2.0}
STEADY = {"target_feedforward": False, "behaviors": ["vertices", "steady"]}


def flown(folder: Path, mission: dict[str, Any], compiled: bool, **more: Any) -> Any:
    (folder / "own.py").write_text(TEXT.replace("COMPILED", COMPILED.strip("\n") if compiled else ""))
    keys = {"name": "own", "plugins": [str(folder / "own.py")], "mission": mission} | KEYS
    return escort_mj.run(keys, video=False, figures=False, **more).trace


def test_the_integral_is_that_of_the_rate_and_takes_the_error_out(tmp_path: Path, compiled: None) -> None:
    trace = flown(tmp_path, STEADY, compiled=True, duration=60.0)
    missed = trace["component_memory"].sel(memory="steady.missed").values
    error = np.linalg.norm(trace["q"].values - trace["target_position"].values[:, None], axis=2) - 5.0
    steps = np.diff(trace["time"].values)[:, None]
    trapezoids = np.cumsum(0.5 * steps * (error[1:] + error[:-1]), axis=0)
    np.testing.assert_allclose(missed[1:, :, 0], trapezoids, atol=0.02)
    assert not missed[..., 1].any() and np.abs(error[-1]).max() < 1e-6
    kept = flown(tmp_path, STEADY | {"behaviors": ["vertices", "surface"]}, compiled=True, duration=60.0)
    away = np.linalg.norm(kept["q"].values[-1] - kept["target_position"].values[-1], axis=1)
    assert np.abs(away - 5.0).max() > 0.2


@pytest.mark.parametrize("more", [{}, {"interpreted": True, "duration": 0.05}])
def test_python_machine_code_and_the_interpreted_loop_agree(tmp_path: Path, more: dict[str, Any]) -> None:
    found, expected = (flown(tmp_path, STEADY, compiled=each, **more) for each in (False, True))
    np.testing.assert_allclose(found["component_memory"], expected["component_memory"], rtol=0, atol=1e-13)


def test_it_stands_still_where_another_phase_rules(tmp_path: Path, compiled: None) -> None:
    phase = {"behaviors": ["surface"], "after": 0.5, "before": 1.5}
    trace = flown(tmp_path, STEADY | {"supervisor": [phase]}, compiled=True)
    missed, time = trace["component_memory"].values[:, 0, :, 0], trace["time"].values
    held = missed[(time > 0.51) & (time < 1.49)]
    assert np.ptp(held, axis=0).max() == 0.0 and np.ptp(missed[time < 0.49], axis=0).min() > 0.05
    assert np.abs(missed[-1] - held[-1]).min() > 1e-4


@pytest.mark.parametrize("compile_it", [False, True])
def test_a_rule_compares_what_it_keeps(tmp_path: Path, compiled: None, compile_it: bool) -> None:
    phase = {"behaviors": ["surface"], "when": {"quantity": "gone", "above": 0.5}}
    trace = flown(tmp_path, {"behaviors": ["surface"], "supervisor": [phase]}, compiled=compile_it)
    way = trace["component_memory"].sel(memory="gone.way").values[..., -1]
    speed = np.linalg.norm(trace["v"].values, axis=2)
    steps = np.diff(trace["time"].values)[:, None]
    np.testing.assert_allclose(way[1:], np.cumsum(0.5 * steps * (speed[1:] + speed[:-1]), axis=0), atol=0.02)
    ruled = trace["phase"].values == 1
    assert ruled.any() and (way[ruled] > 0.5).all() and (way[~ruled] < 0.53).all()
