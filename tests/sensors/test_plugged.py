"""Sensors of plugins: both forms, what they keep, and wrong ones."""

from pathlib import Path

import numpy as np
import pytest

from escort_mj import Run, load_scenario, run
from escort_mj.conformance import check_plugin
from escort_mj.errors import ScenarioError
from escort_mj.sensors import SENSORS, Plain, Sensor, plain
from tests.plugged import plugin

DRIFTING, SCENARIO = plugin("sensor")
NAME = '    sensor: Literal["own"] = "own"\n'
COMPILED = NAME + "    compiled: ClassVar[bool] = True\n"


def flown(folder: Path, text: str, *changes: str) -> Run:
    (folder / "own.py").write_text(text)
    (folder / "own.yaml").write_text(SCENARIO)
    return run(load_scenario(folder / "own.yaml", changes))


NAMES = ("q", "q_measured", "target_velocity_measured", "readings")


def bits(found: Run) -> list[bytes]:
    return [found.trace[name].values.tobytes() for name in NAMES]


def apart(one: Run, other: Run) -> float:
    return max(float(np.abs(one.trace[name].values - other.trace[name].values).max()) for name in NAMES)


def test_what_it_shows_and_keeps(compiled: None, tmp_path: Path) -> None:
    found = flown(tmp_path, DRIFTING)
    assert apart(flown(tmp_path, DRIFTING.replace(NAME, COMPILED)), found) < 1e-9
    trace = found.trace
    readings = trace["readings"]
    names = [
        f"{of}.{what}.{k}"
        for of in ("position", "target_velocity")
        for what in ("bias", "before")
        for k in "xy"
    ]
    assert readings["reading"].values.tolist() == [*names, "heading", "heading.bias", "heading.before"]
    assert readings["reading_unit"].values.tolist() == ["m"] * 8 + ["rad", "m", "m"]
    for axis in "xy":
        bias, before = (readings.sel(reading=f"position.{name}.{axis}").values for name in ("bias", "before"))
        assert not bias[0].any() and bias[1].all() and np.ptp(bias[1]) > 0.0
        assert (before[1:] == bias[:-1]).all(), "both move on from what was"
        shown = trace["q"].sel(axis=axis).values + before
        assert (trace["q_measured"].sel(axis=axis).values == shown).all()
    of_target = readings.sel(reading="target_velocity.bias.x").values
    assert (of_target == of_target[:, :1]).all(), "the target is measured once for the team"
    off = trace["target_velocity_measured"].values - trace["target_velocity"].values
    assert off[-1, 0] == pytest.approx(readings.sel(reading="target_velocity.before.x").values[-1, 0])
    assert (trace["v_measured"].values == trace["v"].values).all()


def test_steps_of_a_walk_have_their_size_and_robots_are_apart(compiled: None, tmp_path: Path) -> None:
    count = {"robots.count": "20", "robots.placement": "{within: 20, least_gap: 1}"}
    found = flown(tmp_path, DRIFTING.replace(NAME, COMPILED), *map("=".join, count.items()))
    steps = np.diff(found.trace["readings"].sel(reading=["position.bias.x", "heading.bias"]).values, axis=0)
    assert steps.std() == pytest.approx(0.1 * np.sqrt(0.002), rel=0.03)
    assert abs(steps.mean()) < 5.0 * steps.std() / np.sqrt(steps.size)
    several = steps.reshape(len(steps), -1)
    together = np.corrcoef(several.T) - np.eye(several.shape[1])
    assert np.abs(together).max() < 0.25, "robots and quantities have random numbers of their own"


@pytest.mark.slow
def test_what_ships_is_a_plugin_with_the_same_text(compiled: None, tmp_path: Path) -> None:
    """The file itself, with the name changed: compiled the same bits, in Python the same to rounding."""
    for kind in SENSORS:
        if not kind.equated():
            continue
        name = kind.model_fields["sensor"].default
        text = (Path(plain.__file__).parent / f"{name}.py").read_text().replace(f'"{name}"', '"own"')
        for module in ("sensors.sensor", "components.equations", "native.values"):
            text = text.replace(f"escort_mj.{module}", "escort_mj.plugins")
        used = "sensing={" + ", ".join(f"{quantity}: {{}}" for quantity in kind.measures) + "}"
        shipped = flown(tmp_path, text, used.replace("{}", name))
        assert apart(flown(tmp_path, text, used.replace("{}", "own")), shipped) < 1e-9
        assert bits(flown(tmp_path, text.replace(NAME, COMPILED), used.replace("{}", "own"))) == bits(shipped)


@pytest.mark.slow
def test_it_passes_its_checks(compiled: None, hurried: None, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(DRIFTING.replace(NAME, COMPILED))
    assert not [check for check in check_plugin(str(tmp_path / "own.py")) if not check.held]


def test_robots_without_a_heading_cannot_measure_it(tmp_path: Path) -> None:
    words = "sensing.heading: found own; robot 1 is a point_mass, which has no heading"
    with pytest.raises(ScenarioError, match=words):
        flown(tmp_path, DRIFTING, "robots.kind=point_mass")


def test_the_plain_sensor_has_no_equation() -> None:
    assert Plain.shows is Sensor.shows and not Plain.equated()
