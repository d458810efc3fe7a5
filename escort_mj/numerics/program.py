"""Functions of time as small programs: evaluated natively at any t, with their exact time derivative.

A program is a sequence of instructions for a stack machine, in postfix order. Every value on the stack
is a dual number (value, d/dt), so that a trajectory's velocity is its exact derivative, not a difference.
Programs are data: they travel in the model, and the compiled callback needs no Python to follow them.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Annotated

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, kernel

INSTRUCTION_SIZE = 3  # opcode, a, b
SEGMENT_SIZE = 5  # start time, then the coefficients of (t - start)^0 .. (t - start)^3
STACK_DEPTH = 32


class ProgramParameters(Fields):
    """All programs of a mission, one behind the other."""

    code: Annotated[Array, "instructions", INSTRUCTION_SIZE, Value("1", "opcode and operands of each")]
    segments: Annotated[
        Array, "segments", SEGMENT_SIZE, Value("1", "of piecewise cubics: start time, then coefficients")
    ]


class ProgramState(Fields):
    """What a program works on."""

    operands: Annotated[Array, 2 * STACK_DEPTH, Value("1", "scratch: a stack of dual numbers")]


class Op(IntEnum):
    """Instructions; `a`, `b` are their operands, x is the top of the stack, w the value below it."""

    CONSTANT = 0  # push a (b is 0)
    AFFINE = 1  # push a + b t
    PIECEWISE = 2  # push the cubic of rows a .. a + b - 1 of the table that holds at t
    ADD = 3  # w + x
    SUBTRACT = 4  # w - x
    MULTIPLY = 5  # w * x
    DIVIDE = 6  # w / x
    SHIFT = 7  # x + a
    SCALE = 8  # x * a
    POWER = 9  # x ** a
    SIN = 10
    COS = 11
    TAN = 12
    EXP = 13
    LOG = 14
    SQRT = 15
    TANH = 16
    ATAN = 17
    ABS = 18
    MIN = 19  # min(w, x)
    MAX = 20  # max(w, x)


@inlined
def _unary(op: int, a: float, x: float, moves: bool) -> tuple[float, float]:
    """Value and derivative of a one-argument instruction at x; no derivative where x does not move."""
    if op == Op.SHIFT:
        return x + a, 1.0
    if op == Op.SCALE:
        return x * a, a
    if op == Op.SIN:
        return math.sin(x), math.cos(x) if moves else 0.0
    if op == Op.COS:
        return math.cos(x), -math.sin(x) if moves else 0.0
    if op == Op.POWER:
        return x**a, a * x ** (a - 1.0) if moves and a != 0.0 else 0.0
    if op == Op.TAN:
        y = math.tan(x)
        return y, 1.0 + y * y
    if op == Op.EXP:
        y = math.exp(x)
        return y, y
    if op == Op.LOG:
        return math.log(x), 1.0 / x
    if op == Op.SQRT:
        y = math.sqrt(x)
        return y, 0.5 / y
    if op == Op.TANH:
        y = math.tanh(x)
        return y, 1.0 - y * y
    if op == Op.ATAN:
        return math.atan(x), 1.0 / (1.0 + x * x)
    return abs(x), 1.0 if x >= 0.0 else -1.0


@inlined
def _binary(op: int, w: float, dw: float, x: float, dx: float) -> tuple[float, float]:
    """Dual result of a two-argument instruction."""
    if op == Op.ADD:
        return w + x, dw + dx
    if op == Op.SUBTRACT:
        return w - x, dw - dx
    if op == Op.MULTIPLY:
        return w * x, dw * x + w * dx
    if op == Op.DIVIDE:
        return w / x, (dw - w / x * dx) / x
    if op == Op.MIN:
        return (w, dw) if w <= x else (x, dx)
    return (w, dw) if w >= x else (x, dx)


@inlined
def _piecewise(table: Array, first: int, count: int, t: float) -> tuple[float, float]:
    """Value and derivative of the piece that holds at t; before the first, the first piece's start."""
    low, high = first, first + count
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] <= t:
            low = middle
        else:
            high = middle
    if t < table[low, 0]:
        return table[low, 1], 0.0
    h = t - table[low, 0]
    c1, c2, c3 = table[low, 2], table[low, 3], table[low, 4]
    return table[low, 1] + h * (c1 + h * (c2 + h * c3)), c1 + h * (2.0 * c2 + h * 3.0 * c3)


@inlined
def evaluate_program(
    code: Array, first: int, count: int, table: Array, t: float, stack: Array
) -> tuple[float, float]:
    """Runs one program; constants and straight lines, the most frequent ones, without its machine.

    Args:
        code: Instructions of all programs, shape (instructions, 3).
        first: Row of the program's first instruction.
        count: Number of its instructions; 0 gives (0, 0).
        table: Segments of all piecewise cubics, shape (segments, 5).
        t: Time [s].
        stack: Scratch, shape (2 * STACK_DEPTH,).

    Returns:
        The value and its derivative by time.
    """
    if count == 0:
        return 0.0, 0.0
    if count == 1 and int(code[first, 0]) <= Op.AFFINE:
        return code[first, 1] + code[first, 2] * t, code[first, 2]
    return run_code(code, first, count, table, t, 1.0, stack)


@inlined
def value_of(code: Array, first: int, count: int, table: Array, t: float, stack: Array) -> float:
    """The value that `evaluate` gives, without the derivative, which costs as much."""
    if count == 0:
        return 0.0
    if count == 1 and int(code[first, 0]) <= Op.AFFINE:
        return code[first, 1] + code[first, 2] * t
    value, _ = run_code(code, first, count, table, t, 0.0, stack)
    return value


@kernel
def run_code(
    code: Array, first: int, count: int, table: Array, t: float, rate: float, stack: Array
) -> tuple[float, float]:
    """Runs one program on the stack machine; as `evaluate`, with the derivative of t itself, 1 or 0."""
    top = -2
    for row in range(first, first + count):
        op, a, b = int(code[row, 0]), code[row, 1], code[row, 2]
        if op == Op.CONSTANT:
            top += 2
            stack[top], stack[top + 1] = a, 0.0
        elif op == Op.AFFINE:
            top += 2
            stack[top], stack[top + 1] = a + b * t, rate * b
        elif op == Op.PIECEWISE:
            top += 2
            stack[top], slope = _piecewise(table, int(a), int(b), t)
            stack[top + 1] = rate * slope
        elif op <= Op.DIVIDE or op >= Op.MIN:
            x, dx = stack[top], stack[top + 1]
            top -= 2
            stack[top], stack[top + 1] = _binary(op, stack[top], stack[top + 1], x, dx)
        else:
            x, dx = stack[top], stack[top + 1]
            y, slope = _unary(op, a, x, dx != 0.0)
            stack[top], stack[top + 1] = y, slope * dx
    return stack[0], stack[1]
