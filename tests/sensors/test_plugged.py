"""Sensors of plugins: both forms, what they keep, and wrong ones."""

import re
from pathlib import Path

import numpy as np
import pytest

from escort_mj import Run, load_scenario, run
from escort_mj.conformance import check_plugin
from escort_mj.errors import PluginError, ScenarioError
from escort_mj.record.outcome import Outcome
from escort_mj.sensors import SENSORS, Plain, Sensor, plain

SCENARIO = """
duration: 1
plugins: [own.py]
target: {position: [0.3*t, sin(t)]}
robots: {count: 3, kind: diff_drive}
recording: {rate: 500}
sensing: {position: own, target_velocity: {sensor: own, drift: 0.5}, heading: own}
"""
NAME = '    sensor: Literal["own"] = "own"\n'
COMPILED = NAME + "    compiled: ClassVar[bool] = True\n"
MEASURES = '    measures: ClassVar[tuple[str, ...]] = ("{}",)\n'
DRIFTING = (
    '''
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat

from escort_mj.plugins import Memory, Sensor, Values


class Drifting(Sensor):
    """Its error drifts, and it shows what was a step before."""

'''
    + NAME
    + '''    drift: NonNegativeFloat = 0.1
    """Standard deviation of the bias after one second [1/s^0.5]."""
    bias: ClassVar[Memory] = Memory("m", "error")
    before: ClassVar[Memory] = Memory("m", "error a step before")

    def shows(self, r: Values) -> Any:
        """Return the measured value."""
        return r.truth + r.before

    def bias_next(self, r: Values) -> Any:
        """Return the bias a step later."""
        return r.bias + self.drift * np.sqrt(r.timestep) * np.where(r.draw < 0.5, r.normal, r.second_normal)

    def before_next(self, r: Values) -> Any:
        """Return the bias."""
        return r.bias
'''
)


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


def test_it_passes_its_checks(compiled: None, hurried: None, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(DRIFTING.replace(NAME, COMPILED))
    assert not [check for check in check_plugin(str(tmp_path / "own.py")) if not check.held]


@pytest.mark.parametrize(
    ("change", "form", "said"),
    [
        (("return r.truth + r.before", "return None"), NAME, r"own.py:\d+: TypeError: shows returned None"),
        (
            ("return r.truth + r.before", "return r.truth / (r.time < 0.5)"),
            COMPILED,
            r"own.py:\d+: Drifting gave robot 1 a measurement that is not a finite number",
        ),
        (("        return r.bias\n", "        return 1 // 0\n"), NAME, r"own.py:\d+: ZeroDivisionError"),
    ],
    ids=["nothing", "infinite", "raises"],
)
def test_what_it_does_wrong_ends_the_run_with_its_place(
    compiled: None, tmp_path: Path, change: tuple[str, str], form: str, said: str
) -> None:
    found = flown(tmp_path, DRIFTING.replace(*change).replace(NAME, form))
    assert found.outcome is Outcome.FAILED
    assert re.search(said, found.message), found.message


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("def shows", "def show"), 'has no shows(self, r); did you mean "show"?'),
        (("def bias_next", "def bias_nxt"), "has no bias_next(self, r)"),
        ((NAME, NAME + MEASURES.format("place")), "found measures = ('place',)"),
        ((NAME, NAME + MEASURES.format("velocity")), 'found "own"; allowed are plain'),
    ],
)
def test_a_wrong_one_is_one_message(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    assert change[0] in DRIFTING
    with pytest.raises((PluginError, ScenarioError)) as caught:
        flown(tmp_path, DRIFTING.replace(*change))
    assert said in str(caught.value)


def test_robots_without_a_heading_cannot_measure_it(tmp_path: Path) -> None:
    words = "sensing.heading: found own; robot 1 is a point_mass, which has no heading"
    with pytest.raises(ScenarioError, match=words):
        flown(tmp_path, DRIFTING, "robots.kind=point_mass")


def test_the_plain_sensor_has_no_equation() -> None:
    assert Plain.shows is Sensor.shows and not Plain.equated()
