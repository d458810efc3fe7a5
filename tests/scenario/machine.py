"""The stack machine of expressions, compiled once for all tests."""

import numpy as np

from escort_mj.native.compiler.declarations import jitted
from escort_mj.numerics.program import STACK_DEPTH, evaluate_program


@jitted
def compiled_evaluate(code, first, count, table, t, stack):
    return evaluate_program(code, first, count, table, t, stack)


def evaluated(code: np.ndarray, table: np.ndarray, t: float, first: int, count: int) -> tuple[float, float]:
    """Value and rate of a part of a program."""
    return compiled_evaluate(code, first, count, table, t, np.empty(2 * STACK_DEPTH))
