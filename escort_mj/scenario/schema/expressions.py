"""Functions of the time t, given as a number or as text such as `"3 + 0.1*t"`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from escort_mj.numerics.program import STACK_DEPTH
from escort_mj.scenario.schema.grammar import ExpressionError, parse
from escort_mj.scenario.schema.nodes import (
    Array,
    Dual,
    Instruction,
    Node,
    constant,
    instructions,
    simplified,
    stack_depth,
    value_and_rate,
)

__all__ = ["Expression", "ExpressionError"]


@dataclass(frozen=True)
class Expression:
    """A function of time.

    Attributes:
        source: A number, or an expression in `t` (see `grammar`).

    Raises:
        ExpressionError: If the text is no expression.
    """

    source: float | str

    def __post_init__(self) -> None:
        depth = stack_depth(self._simplified)
        if depth > STACK_DEPTH:
            raise ExpressionError(f"needs {depth} values at once; at most {STACK_DEPTH} are possible", 1)

    @cached_property
    def _tree(self) -> Node:
        return _parsed(self.source)[0] if isinstance(self.source, str) else constant(float(self.source))

    @cached_property
    def _simplified(self) -> Node:
        return _parsed(self.source)[1] if isinstance(self.source, str) else simplified(self._tree)

    def evaluate(self, t: float | Array) -> Dual:
        """Value and exact time derivative at t [s], each of t's shape; not finite where undefined."""
        with np.errstate(all="ignore"):
            return value_and_rate(self._tree, np.asarray(t, dtype=np.float64))

    def instructions(self) -> list[Instruction]:
        """The program that `control.program` evaluates natively: opcode, a, b of each instruction."""
        return list(instructions(self._simplified))


@lru_cache(maxsize=256)
def _parsed(source: str) -> tuple[Node, Node]:
    """The tree of a text, and the same simplified: a batch of missions has the same few again and again."""
    tree = parse(source)
    return tree, simplified(tree)
