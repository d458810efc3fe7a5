"""Parts of searches: parameters, robustness, asking, shrinking."""

import math

import pytest

from escort_mj.record.outcome import Verdict
from escort_mj.study.engine.store import Row
from escort_mj.study.search.evaluate import broken_by, robustness
from escort_mj.study.search.falsify import shrink
from escort_mj.study.search.optimizer import Optimizer, PointResult
from escort_mj.study.sweeps.values import Range, filled, names_in_braces
from tests.synthetic import make_verdict


class TestParameters:
    def test_names_in_braces_become_numbers(self):
        numbers = {"a": 2.5, "b": -1.0}
        value = {"x": ["{a}*sin(t)", "3-{b}", "{b}"], "y": ("{c}", 4, True)}
        assert filled(value, numbers) == {"x": ["2.5*sin(t)", "3-(-1.0)", -1.0], "y": ("{c}", 4, True)}
        assert list(names_in_braces(value)) == ["a", "b", "b", "c"]


def verdict(metric: str, value: float | None, margin: float | None, passed: bool) -> Verdict:
    return make_verdict(metric=metric, demanded="it", value=value, margin=margin, passed=passed)


def row(*verdicts: Verdict, time: float = 10.0) -> Row:
    passed = all(v.passed for v in verdicts)
    ended = "completed" if time == 10.0 else "diverged"
    return Row("k", 0, {}, ended, "", passed and time == 10.0, time, 0.1, list(verdicts), "", {}, {})


class TestRobustness:
    def test_margins_of_any_unit_are_weighed_by_their_own_size(self):
        # at most 10: 5 found; at most 0.01: 0.009 found
        near = row(verdict("force", 5.0, 5.0, True), verdict("error", 0.009, 0.001, True))
        assert robustness(near, 10.0) == (pytest.approx(0.1), "error it")

    def test_the_sign_tells_whether_the_run_failed(self):
        assert robustness(row(verdict("force", 11.0, -1.0, False)), 10.0).value == pytest.approx(-1 / 12)
        assert robustness(row(verdict("settling", math.inf, -math.inf, False)), 10.0).value == -1.0
        assert robustness(row(verdict("error", None, None, False)), 10.0).value == -1.0
        assert robustness(row(), 10.0).value == 1.0

    def test_what_holds_with_none_to_spare_says_nothing(self):
        held = row(verdict("contacts", 0.0, 0.0, True), verdict("force", 5.0, 5.0, True))
        assert robustness(held, 10.0) == (pytest.approx(0.5), "force it")

    def test_what_was_known_to_fail_says_nothing(self):
        assert robustness(row(verdict("error", 3.0, -1.0, True)), 10.0).value == 1.0

    def test_the_sooner_a_run_breaks_off_the_worse(self):
        late, soon = (robustness(row(time=time), 10.0) for time in (9.0, 1.0))
        assert soon.value == pytest.approx(-1.9) and late.value == pytest.approx(-1.1)
        assert soon.verdict == "outcome completed: diverged"

    def test_everything_that_broke_is_named(self):
        both = [row(verdict("a", 2.0, -1.0, False)), row(verdict("b", 1.0, 1.0, True), time=5.0)]
        assert broken_by(both, 10.0) == {"a it", "outcome completed: diverged"}


BOX = {
    "x": Range(low=-5, high=5),
    "y": Range(low=0.1, high=100, scale="log"),
    "n": Range(low=1, high=9, whole=True),
}


def hunt(method: str, seed: int = 1, batches: int = 12) -> list[dict]:
    """Points asked for on the way to the least of a bowl around x = 2, y = 1, n = 3."""
    optimizer, seen = Optimizer(BOX, method, seed, 8), []
    for _ in range(batches):
        points = optimizer.ask(8)
        seen += points
        optimizer.tell([PointResult([height(point)] if point["x"] > -4 else None) for point in points])
    return seen


def height(point: dict) -> float:
    return (point["x"] - 2) ** 2 + math.log(point["y"]) ** 2 + (point["n"] - 3) ** 2 / 9


class TestAsking:
    @pytest.mark.parametrize("method", ["cmaes", "tpe", "nsga2", "random"])
    def test_the_same_seed_asks_the_same(self, method):
        first = hunt(method, batches=5)
        assert first == hunt(method, batches=5) != hunt(method, seed=2, batches=5)
        for point in first:
            assert -5 <= point["x"] <= 5 and 0.1 <= point["y"] <= 100
            assert isinstance(point["n"], int) and 1 <= point["n"] <= 9

    @pytest.mark.parametrize("method", ["cmaes", "tpe"])
    def test_it_learns(self, method):
        points = [height(point) for point in hunt(method)]
        assert min(points[-24:]) < 0.5 and min(points[-24:]) < min(points[:16])

    def test_a_point_of_ones_own_comes_first(self):
        optimizer = Optimizer(BOX, "tpe", 0, 4)
        optimizer.suggest({"x": 1.5, "y": 2.0, "n": 4})
        assert optimizer.ask(2)[0] == {"x": 1.5, "y": 2.0, "n": 4}

    def test_constraints_are_heeded(self):
        optimizer, seen = Optimizer(BOX, "tpe", 0, 8), []
        for _ in range(12):
            points = optimizer.ask(8)
            seen += points
            optimizer.tell([PointResult([height(p)], {"left": p["x"]}) for p in points])
        assert sum(point["x"] <= 0 for point in seen[-32:]) > 20


class TestShrinking:
    def test_only_what_is_needed_stays_and_as_near_as_it_goes(self):
        asked = []

        def fails(point):
            asked.append(dict(point))
            return point.get("a", 0.0) > 1.234 and point.get("n", 1) >= 4

        small = shrink({"a": 7.0, "b": 3.0, "n": 9, "c": 2.0}, {"a": 0.0, "b": 1.0, "n": 1, "c": None}, fails)
        assert set(small) == {"a", "n"} and small["n"] == 4
        assert fails(small) and 1.234 < small["a"] < 1.234 + 7.0 / 2**6
        assert float(f"{small['a']:.3g}") == small["a"] or not fails(
            small | {"a": float(f"{small['a']:.3g}")}
        )
        assert len(asked) < 30

    def test_what_has_no_base_number_is_kept_or_dropped_whole(self):
        assert shrink({"a": 7.5}, {"a": None}, lambda point: "a" in point) == {"a": 7.5}

    def test_what_fails_at_the_base_needs_nothing(self):
        assert shrink({"a": 7.0, "b": 1.0}, {"a": 0.0, "b": 0.0}, lambda point: True) == {}
