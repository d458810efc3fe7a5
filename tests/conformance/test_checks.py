"""Plugins that are wrong in one way each: the check that is there for it says so."""

import math

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


class TestLaws:
    def test_a_right_one(self, compiled, tmp_path):
        assert not only_wrong(tmp_path, LAW + COMPILED, check_law)

    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("return r.rho_hat", "return 1 + r.rho_hat"), "at rest"),
            (("return r.rho_hat", "return float('nan') * r.e + r.rho_hat"), "finite"),
            (("return r.rho_hat", "return r.e**0.5 + r.rho_hat"), "runs"),
            (("return r.rho_hat", "return r.e[::2] + r.rho_hat"), "runs"),
            (("return r.rho_hat", "r.e[:] += r.e\n        return r.rho_hat"), "runs"),
            (("return r.rho_hat", "return r.tau + r.rho_hat"), "runs"),
            (("return self.int", "return COUNT.append(1) or len(COUNT) * self.int"), "deterministic"),
        ],
    )  # fmt: skip
    def test_a_wrong_one_is_found_by_its_check(self, compiled, tmp_path, change, check):
        assert change[0] in LAW
        text = LAW.replace(*change).replace("class Pid", "COUNT = []\n\n\nclass Pid")
        assert is_found(tmp_path, text, check_law, check)

    def test_forms_that_differ(self, compiled, tmp_path):
        """Whole numbers of machine code overflow."""
        wraps = "n = 4_000_000_000\n        return (2.0 if n * n < 0 else 1.0) * self.int"
        text = LAW.replace("return self.int", wraps) + COMPILED
        assert only_wrong(tmp_path, text, check_law) == ["forms agree"]


class TestParameters:
    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("position error [N/m]", "position error"), "parameters"),
            (('"""Gain of the velocity error [N s/m]."""', ""), "parameters"),
        ],
    )
    def test_a_wrong_one_is_found_by_its_check(self, tmp_path, change, check):
        assert change[0] in LAW
        assert only_wrong(tmp_path, LAW.replace(*change), check_parameters) == [check]

    def test_a_wrong_default_is_refused_before(self, tmp_path):
        with pytest.raises(PluginError, match="found the default -30.0"):
            only_wrong(tmp_path, LAW.replace("= 30.0", "= -30.0"), check_parameters)

    def test_right_ones_are_told_with_default_and_bounds(self, tmp_path):
        row = next(row for row in told(tmp_path, LAW, check_parameters) if row.name == "parameters")
        assert row.held and "integral_gain 20.0 >= 0" in row.words


class TestBehaviors:
    def test_a_right_one(self, compiled, tmp_path):
        assert not only_wrong(tmp_path, BEHAVIOR, check_behavior)

    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("return keep(", "return across(unit_axis(r.q, -1), unit_axis(r.q, -1), abs(height))  # "),
             "keeps to its task"),
            (("return keep", "return 2  # "), "runs"),
            (("return keep", "return None  # "), "runs"),
            (("unit_axis(r.q, -1)", "unit_axis(r.q, 0)"), "Jacobian"),
            (("height = ", "height = 0.1 * r.q[0] * r.q[0] + "), "Jacobian"),
            (("self.gain)", "-self.gain)"), "works"),
            (("height = ", "height = 1.0 / (r.q[0] - r.target[0]) + "), "no singularity"),
        ],
    )  # fmt: skip
    def test_a_wrong_one_is_found_by_its_check(self, compiled, tmp_path, change, check):
        assert change[0] in BEHAVIOR
        assert is_found(tmp_path, BEHAVIOR.replace(*change), check_behavior, check)

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


class TestEstimators:
    def test_a_right_one(self, compiled, tmp_path):
        assert not only_wrong(tmp_path, ESTIMATOR + COMPILED, check_estimator)

    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("elapsed = ", "r.seen.belief[r.i - 1] += 1.0; elapsed = "), "keeps to its robot"),
            (("self.alpha * error", "-self.alpha * error"), "finds the target"),
            (("velocity + faster)", "velocity + faster).with_fix(r.time + 1.0)"), "times"),
            (("elapsed = ", "r.seen.belief_covariance[r.i, 1] += 1.0; elapsed = "), "covariance"),
            (("elapsed = ", "r.seen.belief_covariance[r.i] *= -1.0; elapsed = "), "covariance"),
            (("elapsed * r.", "elapsed * np.log(r.belief.position) * r."), "runs"),
            (("elapsed * r.", "float('nan') * r."), "finite"),
            (("elapsed = ", "r.seen.seen_position[r.i] += 1.0; elapsed = "), "runs"),
            (("return r.believe(", "return 1, ("), "runs"),
        ],
    )
    def test_a_wrong_one_is_found_by_its_check(self, compiled, tmp_path, change, check):
        assert change[0] in ESTIMATOR
        text = "import numpy as np\n" + ESTIMATOR.replace(*change)
        assert is_found(tmp_path, text, check_estimator, check)

    def test_forms_that_differ(self, compiled, tmp_path):
        wraps = "n = 4_000_000_000\n        faster = (0.9 if n * n < 0 else 1.0) * self.beta"
        text = ESTIMATOR.replace("faster = self.beta", wraps) + COMPILED
        assert only_wrong(tmp_path, text, check_estimator) == ["forms agree"]


class TestRecords:
    def test_right_ones(self, compiled, tmp_path):
        assert not only_wrong(tmp_path, METRIC, try_metric)
        assert not only_wrong(tmp_path, EXPECTATION, check_expectation)

    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("return float", "return -float"), "runs"),
            (("return float", "return 1 / 0 + float"), "runs"),
            (("return float", "COUNT.append(1)\n    return len(COUNT) + float"), "deterministic"),
            (("return float", 'trace["tau"].values[:] += 1.0\n    return float'), "runs"),
            (("far.max()", "far[-1].max()"), "grows"),
        ],
    )
    def test_a_wrong_metric_is_found_by_its_check(self, compiled, tmp_path, change, check):
        assert change[0] in METRIC
        assert is_found(tmp_path, METRIC.replace(*change) + "\n\nCOUNT = []\n", try_metric, check)

    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("return Judgment(", "return dict("), "judges"),
            (("self.near - far", "far - self.near"), "judges"),
            (("far = ", "1 / 0; far = "), "judges"),
        ],
    )
    def test_a_wrong_expectation_is_found_by_its_check(self, compiled, tmp_path, change, check):
        assert change[0] in EXPECTATION
        assert only_wrong(tmp_path, EXPECTATION.replace(*change), check_expectation) == [check]


class TestKinds:
    def test_a_right_one(self, compiled, tmp_path):
        assert not only_wrong(tmp_path, KIND, check_kind)

    @pytest.mark.parametrize(
        ("change", "check"),
        [
            (("return self.load", "return 0.0"), "mass"),
            (('pos="0 0 0.1"', 'pos="0 0 -1"'), "clear of the floor"),
            (('<motor name="x" joint="x"/>', '<motor name="x" joint="x" gear="-1"/>'), "pushes"),
        ],
    )
    def test_a_wrong_one_is_found_by_its_check(self, compiled, tmp_path, change, check):
        assert change[0] in KIND
        assert only_wrong(tmp_path, KIND.replace(*change), check_kind) == [check]

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
