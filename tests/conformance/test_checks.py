"""Plugins that are wrong in one way each: the check that is there for it says so."""

import math
from pathlib import Path

import pytest

from escort_mj.conformance.behaviors import check_behavior
from escort_mj.conformance.estimators import check_estimator
from escort_mj.conformance.kinds import check_kind
from escort_mj.conformance.laws import check_law
from escort_mj.conformance.parameters import check_parameters
from escort_mj.conformance.records import check_expectation, try_metric
from escort_mj.conformance.stand import BrokenError, CheckResult
from escort_mj.errors import PluginError
from escort_mj.scenario.reader.catalog import assemble, scenario_type, scenario_type_with
from escort_mj.scenario.reader.plugins import load_plugin, source_of
from escort_mj.scenario.schema.scenario import Scenario
from tests.corpus import read
from tests.plugged import BEHAVIOR, COMPILED, ESTIMATOR, EXPECTATION, KIND, LAW, METRIC


def told(folder, text, checks):
    """What checks say of the only member of a plugin, one after another: name, whether it holds, words."""
    (folder / "own.py").write_text(text)
    plugin = load_plugin(source_of("own.py", folder))
    (member,) = plugin.members
    kind = Scenario if checks in (check_parameters, try_metric) else scenario_type(assemble([plugin]))
    try:
        yield from checks(member, kind)
    except BrokenError as broken:
        yield CheckResult(broken.name, False, str(broken))


def only_wrong(folder, text, checks):
    return [row.name for row in told(folder, text, checks) if not row.held]


def is_found(folder, text, checks, name):
    """Whether a check finds something wrong; those after it are not made."""
    return any(row.name == name and not row.held for row in told(folder, text, checks))


pytestmark = pytest.mark.usefixtures("hurried")  # what is wrong in one way is so in the first draws


CHECKS = {
    "law": (LAW, check_law),
    "parameters": (LAW, check_parameters),
    "behavior": (BEHAVIOR, check_behavior),
    "estimator": (ESTIMATOR, check_estimator),
    "metric": (METRIC, try_metric),
    "expectation": (EXPECTATION, check_expectation),
    "kind": (KIND, check_kind),
}
FAULTS = [
    (kind, case) for kind, several in read(Path(__file__).with_name("wrong.yaml")).items() for case in several
]


@pytest.mark.slow_cases("estimator", "metric")
@pytest.mark.parametrize("kind", CHECKS)
def test_a_right_one(compiled, tmp_path, kind):
    text, checks = CHECKS[kind]
    compilable = kind in ("law", "estimator")
    assert not only_wrong(tmp_path, text + COMPILED * compilable, checks)


@pytest.mark.slow_cases("metric-case31", "estimator-case26", "law-case7")
@pytest.mark.parametrize(("kind", "case"), FAULTS)
def test_a_wrong_one_is_found_by_its_check(compiled, tmp_path, kind, case):
    (text, checks), (old, new) = CHECKS[kind], case["change"]
    assert old in text
    text = case.get("before", "") + text.replace(old, new) + case.get("more", "")
    text += COMPILED * case.get("compiled", False)
    if case.get("alone"):
        assert only_wrong(tmp_path, text, checks) == [case["check"]]
    else:
        assert is_found(tmp_path, text, checks, case["check"])


class TestParameters:
    def test_a_wrong_default_is_refused_before(self, tmp_path):
        with pytest.raises(PluginError, match="found the default -30.0"):
            only_wrong(tmp_path, LAW.replace("= 30.0", "= -30.0"), check_parameters)

    def test_right_ones_are_told_with_default_and_bounds(self, tmp_path):
        row = next(row for row in told(tmp_path, LAW, check_parameters) if row.name == "parameters")
        assert row.held and "integral_gain 20.0 >= 0" in row.words


class TestBehaviors:
    @pytest.mark.slow_cases("wrong0")
    @pytest.mark.parametrize(("gain", "wrong"), [("self.gain", []), ("-self.gain", ["works"])])
    def test_one_that_keeps_off_obstacles_meets_some(self, compiled, tmp_path, gain, wrong):
        text = BEHAVIOR.replace("across, keep, unit_axis", "keep_distance, norm, only")
        text = text.replace("height = r.q[-1] - r.target[-1]", "x = r.q - r.obstacle(0)")
        text = text.replace(
            "keep(height, self.height, unit_axis(r.q, -1), self.gain)",
            f"only(norm(x) < self.height, keep_distance(x, self.height, {gain}))",
        )
        assert only_wrong(tmp_path, text, check_behavior) == wrong
        told_of = {row.name: row.words for row in told(tmp_path, text, check_behavior)}
        assert "along" in told_of["keeps to its task"]


class TestKinds:
    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (('name="y" type="slide"', 'name="y" type="hinge"'), "begins with the joints x, y and z"),
            (('<geom name="body"', '<geom name="hull"'), 'has no <geom name="body">'),
            (("</worldbody>", ""), "its MJCF cannot be read"),
            (('parts["load_ball"]', 'parts["load_bell"]'), "KeyError: 'load_bell'"),
            (
                ('<geom name="ball"', '<joint name="j" type="hinge"/><geom name="ball"'),
                "coordinates() says 2",
            ),
            (('"mass", str(self.load)', '"mass", "-1"'), "MuJoCo refuses its body"),
        ],
    )
    def test_a_body_that_cannot_be_built_is_one_message(self, compiled, tmp_path, change, said):
        from escort_mj.conformance import check_plugin

        assert change[0] in KIND
        (tmp_path / "own.py").write_text(KIND.replace(*change))
        last = [*check_plugin(str(tmp_path / "own.py"))][-1]
        assert not last.held
        assert said in last.words
        assert "\n" not in last.words


SLOWER = """
from typing import ClassVar, Literal

from escort_mj.robots.quadrotor import Quadrotor


class Slower(Quadrotor):
    part: ClassVar[str] = "quadrotor"
    kind: Literal["slower"] = "slower"
    attitude_frequency: float = 10.0
"""


class TestKindsOfShippedParts:
    def test_one_derived_from_a_kind_that_ships(self, compiled, tmp_path):
        assert not only_wrong(tmp_path, SLOWER, check_kind)

    def test_a_part_that_does_not_ship(self, tmp_path):
        text = SLOWER.replace('= "quadrotor"', '= "hovercraft"')
        with pytest.raises(PluginError, match="the kind slower: models/ has no part hovercraft"):
            only_wrong(tmp_path, text, check_kind)


def test_types_made_for_plugins_leave_the_plain_one_alone(tmp_path):
    (tmp_path / "own.py").write_text(METRIC)
    kind = scenario_type_with([str(tmp_path / "own.py")])
    table = {"expect": ({"metric": "farthest", "at_most": 1.0},)}
    assert kind.model_validate(table).expect[0].definition.unit == "m"
    assert kind.model_validate({}).model_dump() == kind.__mro__[2].model_validate({}).model_dump()
    assert math.isinf(kind.model_validate(table).expect[0].definition.most)
