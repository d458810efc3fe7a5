import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from escort_mj.numerics.program import Op
from escort_mj.scenario import Expression, ExpressionError
from escort_mj.scenario.schema.grammar import MAX_LENGTH, MAX_NESTING, MAX_NODES
from tests.scenario.machine import evaluated

NO_TABLE = np.empty((0, 5))


def by_machine(expression: Expression, t: float) -> tuple[float, float]:
    """Value and rate from the compiled stack machine."""
    code = np.array(expression.instructions(), dtype=np.float64)
    return evaluated(code, NO_TABLE, t, 0, len(code))


def opcodes(source: str) -> list[Op]:
    return [Op(instruction[0]) for instruction in Expression(source).instructions()]


leaves = st.one_of(st.just("t"), st.just("pi"), st.sampled_from(["0.1", "2", "3.5", "1e-3", "7", ".5", "0"]))
functions = st.sampled_from(["sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "atan", "abs"])


def _grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda x: f"({x[0]} {x[1]} {x[2]})"),
        st.tuples(inner, st.sampled_from("+-*/"), leaves).map(lambda x: f"{x[0]}{x[1]}{x[2]}"),
        st.tuples(functions, inner).map(lambda x: f"{x[0]}({x[1]})"),
        st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(lambda x: f"{x[0]}({x[1]}, {x[2]})"),
        st.tuples(inner, st.sampled_from(["2", "3", "-1", "0.5", "0", "1"])).map(
            lambda x: f"({x[0]})**{x[1]}"
        ),
        inner.map(lambda x: f"-{x}"),
    )


sources = st.recursive(leaves, _grown, max_leaves=12)
times = st.just(0.0) | st.floats(1e-3, 50.0)  # nearer to 0 the rate of t / t is rounding over t squared


def parsed(source: str) -> Expression | None:
    """The expression, or None where a constant part of it is undefined or it is too large."""
    try:
        return Expression(source)
    except ExpressionError:
        return None


@given(sources, times)
def test_stack_machine_agrees_with_numpy(source: str, t: float):
    expression = parsed(source)
    if expression is None:
        return
    wanted = np.array([float(part) for part in expression.evaluate(t)])
    found = np.array(by_machine(expression, t))
    # Simplification reorders roundings, and chaotic parts (tan of exp of t) magnify them.
    nearby = np.array([[float(part) for part in expression.evaluate(t * (1 + e))] for e in (-1e-13, 1e-13)])
    if not (np.isfinite(wanted).all() and np.isfinite(nearby).all()):
        return
    slack = 1e-9 * (1.0 + np.abs(wanted)) + 10.0 * np.abs(nearby - wanted).max(axis=0)
    if np.abs(wanted).max() > 1e12 or not np.all(slack < 1e-3 * (1.0 + np.abs(wanted))):
        return
    np.testing.assert_array_less(np.abs(found - wanted), slack)


@given(sources, st.floats(0.5, 20.0))
def test_rate_is_the_derivative(source: str, t: float):
    expression = parsed(source)
    if expression is None:
        return
    h = 1e-5
    (before, here, after), rates = expression.evaluate(np.array([t - h, t, t + h]))
    if not np.isfinite([before, here, after, *rates]).all() or np.abs(rates).max() > 1e3 or abs(here) > 1e3:
        return
    difference = (after - before) / (2.0 * h)
    curvature = abs(rates[2] - rates[0])  # a kink, or a bend that a difference cannot follow
    assert abs(difference - rates[1]) <= 2.0 * curvature + 1e-4


@pytest.mark.parametrize(
    ("source", "value", "rate"),
    [
        ("3 + 0.1*t", 3.2, 0.1),
        ("-t**2", -4.0, -4.0),
        ("2**-1 * t", 1.0, 0.5),
        ("t**2**0.5", 2.0 ** math.sqrt(2.0), math.sqrt(2.0) * 2.0 ** (math.sqrt(2.0) - 1.0)),
        ("10 - 2 - 3*t", 2.0, -3.0),
        ("8 / 2 / t", 2.0, -1.0),
        ("min(t, 1) + max(t, 1)", 3.0, 1.0),
        ("1 - sin(pi*t)", 1.0, -math.pi),
        ("abs(-t)", 2.0, 1.0),
        ("+t--t", 4.0, 2.0),
        ("  .5e1  ", 5.0, 0.0),
        ("007*t - 00.5e-01", 13.95, 7.0),
        ("\n(t\n+ 1)\u2003* 2\n", 6.0, 2.0),
        (7, 7.0, 0.0),
        (0.25, 0.25, 0.0),
    ],
)
def test_value_and_rate_at_two_seconds(source: float | str, value: float, rate: float):
    expression = Expression(source)
    assert [float(part) for part in expression.evaluate(2.0)] == pytest.approx([value, rate], abs=1e-12)
    assert by_machine(expression, 2.0) == pytest.approx((value, rate), abs=1e-12)


def test_evaluates_many_times_at_once():
    value, rate = Expression("3 + 0.1*t").evaluate(np.arange(4.0))
    np.testing.assert_allclose(value, [3.0, 3.1, 3.2, 3.3])
    np.testing.assert_array_equal(rate, np.full(4, 0.1))


def test_undefined_values_are_not_finite_and_not_an_error():
    value, rate = Expression("log(t) + 1/t + sqrt(t)").evaluate(np.array([0.0, 1.0]))
    assert np.isfinite(value).tolist() == [False, True]
    assert np.isfinite(rate).tolist() == [False, True]


def test_simplifies():
    assert opcodes("3 + 0.1*t") == [Op.AFFINE]
    assert opcodes("2*(t - 5)/4 + 3*t") == [Op.AFFINE]
    assert opcodes("2*pi*3") == [Op.CONSTANT]
    assert opcodes("0.5*sin(0.7*t)") == [Op.AFFINE, Op.SIN, Op.SCALE]
    assert opcodes("1 - cos(t)") == [Op.AFFINE, Op.COS, Op.SCALE, Op.SHIFT]
    assert opcodes("sin(t)/t") == [Op.AFFINE, Op.SIN, Op.AFFINE, Op.DIVIDE]


def test_equal_sources_are_equal_expressions():
    assert Expression("t") == Expression("t")
    assert len({Expression("t"), Expression("t"), Expression(1.0)}) == 2


@pytest.mark.parametrize(
    ("source", "words", "column"),
    [
        *YAML(typ="safe").load(Path(__file__).with_name("refused.yaml")),
        ("9" * 40, "40 digits", 1),
        ("(" * 90 + "t" + ")" * 90, "nesting", MAX_NESTING + 1),
        ("(" * 200, "nesting", MAX_NESTING + 1),
        ("-" * 199 + "t", "nesting", MAX_NESTING + 1),
        ("sin(" * 50, "nesting", 4 * MAX_NESTING + 1),
        ("t**" * 60 + "2", "nesting", 3 * MAX_NESTING + 2),
        ("t" + "+t" * MAX_NODES, "more than", MAX_NODES),
        ("t" * (MAX_LENGTH + 1), "characters", MAX_LENGTH + 1),
    ],
)
def test_refuses(source: str, words: str, column: int):
    with pytest.raises(ExpressionError) as caught:
        Expression(source)
    assert words in str(caught.value)
    assert caught.value.column == column


LIKE_ONE = st.text(alphabet="t0123456789.e+-*/() ,minaxsqrpo_", max_size=80)


@given(LIKE_ONE | st.text(st.characters(exclude_categories=("Cs",)), max_size=250))
def test_any_text_is_an_expression_or_an_error(source: str):
    expression = parsed(source)
    if expression is not None:
        value, rate = expression.evaluate(1.0)
        assert value.shape == rate.shape == ()


def test_fits_the_stack():
    deepest = (
        "".join(f"sin({k}*t)*(" for k in range(2, 2 + MAX_NESTING - 1)) + "sin(t)" + ")" * (MAX_NESTING - 1)
    )
    assert len(deepest) > MAX_LENGTH or Expression(deepest)
    nested = "max(t," * 19 + "sin(t)" + ")" * 19
    assert by_machine(Expression(nested), 2.0) == pytest.approx((2.0, 1.0))
