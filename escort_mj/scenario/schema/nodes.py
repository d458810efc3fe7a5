"""Trees of operations on time: evaluated in NumPy with their exact derivative, or flattened to a program.

The operations are those of `control.program`. The two ways to evaluate share nothing but their names:
NumPy walks the tree as it was written, the compiled stack machine follows the simplified instructions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.numerics.program import Op

Array = NDArray[np.float64]
Dual = tuple[Array, Array]
Instruction = tuple[int, float, float]


class Node(NamedTuple):
    """One operation.

    Attributes:
        op: What it does to its arguments.
        args: Operands, of which a constant or an affine function of time has none.
        a: First parameter: the constant, the offset, the factor, or the exponent.
        b: Second parameter: the slope of an affine function of time.
        column: Where it stands in the expression, from 1.
    """

    op: Op
    args: tuple[Node, ...] = ()
    a: float = 0.0
    b: float = 0.0
    column: int = 1


def constant(value: float, column: int = 1) -> Node:
    """The number itself."""
    return Node(Op.CONSTANT, a=value, column=column)


# Value and derivative at x. abs and the two-sided functions take the branch that the stack machine takes.
_UNARY: dict[Op, Callable[[Array], Dual]] = {
    Op.SIN: lambda x: (np.sin(x), np.cos(x)),
    Op.COS: lambda x: (np.cos(x), -np.sin(x)),
    Op.TAN: lambda x: (np.tan(x), 1.0 + np.tan(x) ** 2),
    Op.EXP: lambda x: (np.exp(x), np.exp(x)),
    Op.LOG: lambda x: (np.log(x), 1.0 / x),
    Op.SQRT: lambda x: (np.sqrt(x), 0.5 / np.sqrt(x)),
    Op.TANH: lambda x: (np.tanh(x), 1.0 - np.tanh(x) ** 2),
    Op.ATAN: lambda x: (np.arctan(x), 1.0 / (1.0 + x * x)),
    Op.ABS: lambda x: (np.abs(x), np.where(x >= 0.0, 1.0, -1.0)),
}

_BINARY: dict[Op, Callable[[Array, Array, Array, Array], Dual]] = {
    Op.ADD: lambda w, dw, x, dx: (w + x, dw + dx),
    Op.SUBTRACT: lambda w, dw, x, dx: (w - x, dw - dx),
    Op.MULTIPLY: lambda w, dw, x, dx: (w * x, dw * x + w * dx),
    Op.DIVIDE: lambda w, dw, x, dx: (w / x, (dw - w / x * dx) / x),
    Op.MIN: lambda w, dw, x, dx: (np.where(w <= x, w, x), np.where(w <= x, dw, dx)),
    Op.MAX: lambda w, dw, x, dx: (np.where(w >= x, w, x), np.where(w >= x, dw, dx)),
}


def value_and_rate(node: Node, t: Array) -> Dual:
    """Value and exact time derivative at times t, each of t's shape; not finite where undefined."""
    if node.op is Op.CONSTANT:
        return np.full_like(t, node.a), np.zeros_like(t)
    if node.op is Op.AFFINE:
        return node.a + node.b * t, np.full_like(t, node.b)
    args = [value_and_rate(arg, t) for arg in node.args]
    if node.op in _BINARY:
        return _BINARY[node.op](*args[0], *args[1])
    ((x, dx),) = args
    if node.op is Op.SCALE:
        return x * node.a, dx * node.a
    if node.op is Op.POWER:
        slope = node.a * x ** (node.a - 1.0) if node.a != 0.0 else np.zeros_like(x)
        return x**node.a, slope * dx
    y, slope = _UNARY[node.op](x)
    return y, slope * dx


def value_of_constant(node: Node) -> float | None:
    """The number that a tree without time stands for; None if it depends on time."""
    if not _is_constant(node):
        return None
    with np.errstate(all="ignore"):
        return float(value_and_rate(node, np.zeros(()))[0])


def _is_constant(node: Node) -> bool:
    return node.op is not Op.AFFINE and all(map(_is_constant, node.args))


def simplified(node: Node) -> Node:
    """The same function in fewer instructions: sums and multiples of time and of constants merged."""
    args = tuple(map(simplified, node.args))
    if node.op is Op.SCALE:
        return _scaled(args[0], node.a)
    if node.op in (Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.DIVIDE):
        return _simplified_arithmetic(node.op, *args)
    return node._replace(args=args)


def _simplified_arithmetic(op: Op, w: Node, x: Node) -> Node:
    if op is Op.SUBTRACT and (w.op is Op.CONSTANT or x.op in (Op.CONSTANT, Op.AFFINE)):
        op, x = Op.ADD, _scaled(x, -1.0)
    if op is Op.DIVIDE and x.op is Op.CONSTANT and x.a != 0.0 and math.isfinite(1.0 / x.a):
        op, x = Op.MULTIPLY, constant(1.0 / x.a)
    if op in (Op.ADD, Op.MULTIPLY) and w.op is Op.CONSTANT:
        w, x = x, w
    if op is Op.MULTIPLY and x.op is Op.CONSTANT:
        return _scaled(w, x.a)
    if op is Op.ADD and w.op is Op.AFFINE and x.op in (Op.CONSTANT, Op.AFFINE):
        return w._replace(a=w.a + x.a, b=w.b + x.b)
    if op is Op.ADD and x.op is Op.CONSTANT:
        return Node(Op.SHIFT, (w,), x.a)
    return Node(op, (w, x))


def _scaled(node: Node, factor: float) -> Node:
    if node.op in (Op.CONSTANT, Op.AFFINE):
        return node._replace(a=node.a * factor, b=node.b * factor)
    return Node(Op.SCALE, (node,), factor)


def instructions(node: Node) -> Iterator[Instruction]:
    """The tree in postfix order, as `control.program` reads it."""
    for arg in node.args:
        yield from instructions(arg)
    yield int(node.op), node.a, node.b


def stack_depth(node: Node) -> int:
    """How many values the tree's program holds at once."""
    return max((place + stack_depth(arg) for place, arg in enumerate(node.args)), default=1)
