"""What plugins return and raise when they are called: sense, or one error with their file and line."""

import builtins
import functools
import inspect
import math
import re
import sys
from functools import partial

import numpy as np
import pytest

from escort_mj import load_scenario
from escort_mj.errors import NotLoggedError, PluginError, UsageError
from escort_mj.expect.verdicts import judge
from escort_mj.expectations.expectation import Judgment, Windowed
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric, metric_of
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.reader.plugins import load_plugin, source_of
from escort_mj.world.model.build import build
from tests.expectations.traces import watched
from tests.plugged import KIND, METRIC


def given(returned):
    """Return it, or raise it."""
    if isinstance(returned, BaseException):
        raise returned
    return returned


def measured(returned, **about):
    """What a metric gives whose function returns something, or raises it."""

    @metric(unit="m", **about)
    def own(trace):
        """Its meaning."""
        return given(returned)

    return metric_of(own).of(watched())


def judged(returned):
    """The verdict on an expectation that returns something, or raises it."""

    class Own(Windowed):
        """One of a test."""

        kind = "own"
        own: float = 1.0

        def judge(self, trace):
            return given(returned)

    return judge([Own()], watched(), Outcome.COMPLETED)[1]


class TestMetrics:
    @pytest.mark.parametrize(
        "dear", [lambda _: 1 / 0, lambda _: sys.exit(0), lambda _: "x", lambda _: print()]
    )
    def test_what_its_dear_does_and_returns_is_looked_at(self, dear):
        @metric(unit="m", dear=dear)
        def own(trace):
            """Its meaning."""
            return 1.0

        assert metric_of(own).of(watched()).value == 1.0
        found = metric_of(own).of(watched(), unless_dear=True)
        assert found.broken and found.reason.startswith(f"{__file__}:")

    @pytest.mark.parametrize("function", [print, functools.cache(lambda _: 1.0), type("Own", (), {})])
    def test_what_is_no_function_is_refused(self, function):
        with pytest.raises(UsageError, match="expected a function of a trace"):
            metric(unit="m")(function)

    def test_what_it_says_is_told_as_plain_text(self):
        assert measured(Measure(None, reason="\x1b[2Jgood\ud800")).reason == "?[2Jgood?"
        assert len(measured(ValueError("x" * 10**6)).reason) < 3000

    @pytest.mark.parametrize("returned", [2, 2.0, np.float32(2), np.array(2.0), Measure(2, 1.0, ["robot_1"])])
    def test_a_number_or_a_measure(self, returned):
        found = measured(returned)
        assert found.value == 2.0
        assert not found.broken

    @pytest.mark.parametrize("value", [math.inf, -1e-12, 0.0])
    def test_never_and_rounding(self, value):
        assert measured(value).value == value

    @pytest.mark.parametrize(
        ("returned", "words"),
        [
            (float("nan"), "found nan"),
            (np.ma.masked, "expected a number"),
            (NotLoggedError("q"), "NotLoggedError: the log does not contain q"),
            (-5.0, "found -5; by its own bounds, own is at least 0; @metric(least="),
            (-math.inf, "found -inf"),
            ("3", "found str; expected a number"),
            (1j, "found complex"),
            (np.zeros(1), "an array of shape (1,)"),
            (np.array("x"), "expected a number"),
            ([1.0], "expected a number"),
            (Measure("x"), "value: found str"),
            (Measure(float("nan")), "value: found nan"),
            (Measure(1.0, math.inf), "time: found inf; expected a finite number"),
            (Measure(1.0, -5.0), "time: found -5 s; expected a time of the run, from 0 to"),
            (Measure(1.0, 1e9), "time: found 1e+09 s; expected a time of the run"),
            (Measure(1.0, None, 5), "bodies: found int"),
            (Measure(1.0, None, "robot_1"), "bodies: found str"),
            (Measure(None, reason=5), "reason: found int"),
            (SystemExit(0), "SystemExit: 0"),
            (KeyboardInterrupt(), "KeyboardInterrupt"),
            (GeneratorExit(), "GeneratorExit"),
            (type("Own", (BaseException,), {})("gone"), "Own: gone"),
            (type("Own", (BaseException,), {"__str__": lambda _: sys.exit()})(), ": Own"),
        ],
        ids=repr,
    )
    def test_nonsense_is_an_error_of_the_plugin(self, returned, words, monkeypatch):
        monkeypatch.setattr("escort_mj.stopping.is_users", lambda: False)
        found = measured(returned)
        assert found.broken and found.value is None
        assert found.reason.startswith(f"{__file__}:")
        assert words in found.reason

    @pytest.mark.parametrize(
        "about", [{"grows": "x"}, {"of_team": 5}, {"watched": None}, {"moment": 1}, {"dear": 5}], ids=str
    )
    def test_what_it_says_of_itself_is_a_flag(self, about):
        (name,) = about
        with pytest.raises(UsageError, match=rf"@metric\({name}=.*\): expected (True or False|a function)"):
            measured(1.0, **about)

    def test_above_its_own_most(self):
        assert "at least 0 and at most 1" in measured(1.5, most=1.0).reason

    def test_what_a_user_interrupts_is_interrupted(self):
        with pytest.raises(KeyboardInterrupt):
            measured(KeyboardInterrupt())


class TestExpectations:
    def test_a_judgment(self):
        found = judged(Judgment(np.bool_(True), "w", np.float64(3.0), "m", 1, ["robot_1"], math.inf))
        assert found.held is True
        assert (found.value, found.bodies, found.broken) == (3.0, ("robot_1",), False)

    @pytest.mark.parametrize(
        ("returned", "words"),
        [
            (None, "NoneType; expected a Judgment"),
            (True, "bool; expected a Judgment"),
            (Judgment("no", "w"), "held: found str; expected True or False"),
            (Judgment(np.array([True, False]), "w"), "held: found ndarray"),
            (Judgment(1, "w"), "held: found int"),
            (Judgment(True, None), "words: found NoneType"),
            (Judgment(True, ""), "words: found none"),
            (Judgment(True, "w", "x"), "value: found str"),
            (Judgment(True, "w", float("nan")), "value: found nan"),
            (Judgment(True, "w", margin=float("nan")), "margin: found nan"),
            (Judgment(True, "w", margin=-3.0), "held is True and the margin -3"),
            (Judgment(False, "w", margin=0.5), "held is False and the margin 0.5"),
            (Judgment(False, "w", near_miss=True), "near_miss is True"),
            (Judgment(True, "w", bodies=5), "bodies: found int"),
            (Judgment(True, "w", time=float("nan")), "time: found nan"),
            (Judgment(True, "w", time=-5.0), "time: found -5 s; expected a time of the run, from 0 to"),
            (Judgment(True, "w", time=1e9), "time: found 1e+09 s; expected a time of the run"),
            (Judgment(True, "w", skip=None), "skip: found NoneType"),
            (Judgment(True, "w", skip="no mood"), "skip: found 'no mood'; expected none: a scenario says"),
            (SystemExit(0), "SystemExit: 0"),
            (NotLoggedError("q"), "NotLoggedError: the log does not contain q"),
        ],
        ids=repr,
    )
    def test_nonsense_is_an_error_of_the_plugin(self, returned, words):
        found = judged(returned)
        assert found.broken and not found.held and not found.passed
        assert f"{__file__}:" in found.found
        assert words in found.found

    def test_what_exits_while_it_says_what_it_demands(self):
        class Own(Windowed):
            """One of a test."""

            kind = "own"
            own: float = 1.0

            @property
            def demanded(self):
                sys.exit(0)

            def judge(self, trace):
                return Judgment(True, "w")

        found = judge([Own()], watched(), Outcome.COMPLETED)[1]
        assert found.broken and not found.passed


class TestKinds:
    TEXT = """\
from typing import ClassVar, Literal
from escort_mj.plugins import RobotKind
class Own(RobotKind):
    \"\"\"A kind.\"\"\"
    mjcf: ClassVar[str] = '<mujoco/>'
    kind: Literal["own"] = "own"
    def coordinates(self, axes):
        BODY
"""

    @pytest.mark.parametrize(
        ("body", "words"),
        [
            ("raise RecursionError", "own.py:8: RecursionError"),
            ("raise SystemExit(0)", "own.py:8: SystemExit: 0"),
            ("print('x')", "own.py:8: a plugin must not do this: it prints to standard output"),
            ("return 'x'", "coordinates returned 'x'; expected a whole number"),
            ("return -1", "coordinates returned -1; expected a whole number"),
            ("return self.coordinates(axes)", "RecursionError: maximum recursion depth"),
        ],
    )
    def test_wherever_it_is_called(self, tmp_path, body, words, request):
        request.addfinalizer(partial(sys.setrecursionlimit, sys.getrecursionlimit()))
        sys.setrecursionlimit(len(inspect.stack(0)) + 150)  # each call of its own looks for what it changed
        (tmp_path / "own.py").write_text(self.TEXT.replace("BODY", body))
        scenario = {"plugins": [str(tmp_path / "own.py")], "robots": {"count": 2, "kind": "own"}}
        with pytest.raises(PluginError, match=re.escape(words)):
            load_scenario(scenario)

    def test_mjcf_that_cannot_be_read_is_told_with_its_file(self, tmp_path):
        (tmp_path / "own.py").write_text(
            self.TEXT.replace("<mujoco/>", "<mujoco>").replace("BODY", "return 0")
        )
        scenario = {"plugins": [str(tmp_path / "own.py")], "robots": {"count": 2, "kind": "own"}}
        with pytest.raises(
            PluginError, match=rf"^{tmp_path}/own.py: the kind own: its MJCF cannot be read: "
        ):
            build(load_scenario(scenario))

    def test_a_flexible_part_is_refused(self, tmp_path):
        (tmp_path / "own.py").write_text(
            KIND.replace('<body name="load', '<flexcomp name="f"/><body name="load')
        )
        scenario = {"plugins": [str(tmp_path / "own.py")], "robots": {"kind": "crowned"}, "axes": 3}
        with pytest.raises(PluginError, match=rf"^{tmp_path}/own.py: the kind crowned: found <flexcomp>;"):
            build(load_scenario(scenario))

    def test_what_it_changes_in_the_process_at_its_second_call_is_found(self, tmp_path):
        body = 'self.load == 1 and __import__("random").seed(3); parts["load'
        (tmp_path / "own.py").write_text(KIND.replace('parts["load', body))
        heavy = [{"robot": 2, "kind": {"kind": "crowned", "load": 1}}]
        robots = {"count": 2, "kind": "crowned", "overrides": heavy}
        with pytest.raises(PluginError, match=rf"^{tmp_path}/own.py: the kind crowned: .* it seeds"):
            build(load_scenario({"plugins": [str(tmp_path / "own.py")], "robots": robots, "axes": 3}))


@pytest.mark.parametrize(
    "line",
    [
        "np.zeros = 5",
        "np.random.get_state = 5",
        "random.getstate = 5",
        "Law.force = 5",
        "os.path.join = 5",
    ],
)
def test_what_a_plugin_replaces_while_it_is_loaded_is_put_right_again(tmp_path, line):
    """Though it is looked for with functions of the same modules."""
    (tmp_path / "own.py").write_text(
        f"import os, random\nfrom escort_mj.plugins import Law\n{METRIC}\n{line}\n"
    )
    with pytest.raises(PluginError, match=f"it replaces .*{line.partition(' ')[0].rpartition('.')[2]}"):
        load_plugin(source_of("own.py", tmp_path))
    (tmp_path / "good.py").write_text(METRIC)
    load_plugin(source_of("good.py", tmp_path))


@pytest.mark.parametrize("line", ["builtins.len = lambda x: 0", "del builtins.print", "builtins.open = 3"])
def test_a_plugin_that_replaces_what_python_has_is_refused_by_name(line, tmp_path) -> None:
    (tmp_path / "own.py").write_text(f"import builtins\n{METRIC}\n{line}\n")
    kept = dict(vars(builtins))
    with pytest.raises(PluginError, match=r"own.py: a plugin must not do this: it replaces \w+ of Python"):
        load_plugin(source_of("own.py", tmp_path))
    assert vars(builtins) == kept
