"""The grammar of expressions in t: a small part of Python's, and Python's parser reads it. Nothing is run.

Numbers, t, pi, the signs + - * / ** (the exponent is a constant), parentheses, and the functions below. The
words are looked at first, one after another: whatever else Python knows is refused there, with its column.
"""

from __future__ import annotations

import ast
import math
import re
from dataclasses import dataclass

from escort_mj.errors import EscortError
from escort_mj.numerics.program import Op
from escort_mj.scenario.findings import did_you_mean, shown
from escort_mj.scenario.schema.nodes import Node, constant, value_of_constant

MAX_LENGTH = 200
MAX_NODES = 64
MAX_NESTING = 20
LARGEST_WHOLE = 2**53  # beyond it a float no longer holds every whole number

FUNCTIONS = {
    **{op.name.lower(): (op, 1) for op in Op if Op.SIN <= op <= Op.ABS},
    **{op.name.lower(): (op, 2) for op in (Op.MIN, Op.MAX)},
}
NAMES = ("t", "pi", *sorted(FUNCTIONS))

_OPERATORS = {ast.Add: Op.ADD, ast.Sub: Op.SUBTRACT, ast.Mult: Op.MULTIPLY, ast.Div: Op.DIVIDE}
_WORD = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>\*\*|[-+*/(),])|(?P<end>$)|(?P<foreign>\S))"
)
_CLOSED = re.compile(r"[ )]*")  # what may stand between an operand and the operator after it
_LEADING_ZEROS = re.compile(r"^0+(?=[0-9])")  # which Python does not allow


class ExpressionError(EscortError, ValueError):
    """Text that is not an expression in t.

    Attributes:
        column: Where the fault lies in the expression, from 1.
    """

    exit_code = 2

    def __init__(self, message: str, column: int) -> None:
        self.column = column
        super().__init__(f"{message} (column {column} of the expression)")


def parse(source: str) -> Node:
    """Reads an expression.

    Raises:
        ExpressionError: If it is none, or is longer, larger or deeper than an expression may be.
    """
    if len(source) > MAX_LENGTH:
        raise ExpressionError(
            f"found {len(source)} characters; an expression has at most {MAX_LENGTH}", MAX_LENGTH + 1
        )
    text = _checked(source)
    return _Tree(text).node(ast.parse(text, mode="eval").body)


@dataclass
class _Level:
    """What is open at a word: the whole expression, a parenthesis, or the arguments of a function.

    Attributes:
        function: Its name; empty for the other two.
        arguments: How many are still to be closed; 0 for the whole expression.
        signs: How many signs and powers the next operand is nested in.
    """

    function: str = ""
    arguments: int = 0
    signs: int = 0

    @property
    def wanted(self) -> str:
        """What may come after an operand here."""
        if not self.function:
            other = "or a closing parenthesis" if self.arguments else "(+ - * / **) or the end"
            return f"an operator {other}"
        arity = FUNCTIONS[self.function][1]
        sign = "comma" if self.arguments > 1 else "closing parenthesis"
        return f"a {sign}, for {self.function} takes {arity} argument{'s'[: arity - 1]}"


def _checked(source: str) -> str:
    """An expression as Python writes it, each word at the index that is its column: in parentheses.

    Raises:
        ExpressionError: At the first word that cannot stand where it does.
    """
    levels, python = [_Level()], "("
    operand, called = True, False  # what is next: an operand, the parenthesis after a function
    for word in _WORD.finditer(source):
        kind, level = str(word.lastgroup), levels[-1]
        text, column = word[kind], word.start(kind) + 1
        python = python.ljust(column) + _LEADING_ZEROS.sub("", text)
        if called:
            if text != "(":
                raise _unexpected(word, f"an opening parenthesis after {level.function}")
            called = False
        elif operand:
            if kind == "number":
                if not math.isfinite(value := float(text)):
                    raise ExpressionError(f"found {text}, beyond the largest number", column)
                if text.isdigit() and value > LARGEST_WHOLE:
                    words = f"found a whole number of {len(text)} digits; write it as {value:.3e}"
                    raise ExpressionError(words, column)
                operand = False
            elif text in FUNCTIONS:
                levels.append(_Level(text, FUNCTIONS[text][1]))
                called = True
            elif text in NAMES:
                operand = False
            elif kind == "name":
                allowed = f"allowed are {', '.join(NAMES)}{did_you_mean(text, NAMES)}"
                raise ExpressionError(f"found the unknown name {shown(text)}; {allowed}", column)
            elif text == "(":
                levels.append(_Level(arguments=1))
            elif text in ("+", "-"):
                level.signs += 1
            else:
                raise _unexpected(word, "a number, t, pi, a function or an opening parenthesis")
        elif text == ")" and level.arguments == 1:
            levels.pop()
        elif kind == "end" and not level.arguments:
            break
        elif text in ("+", "-", "*", "/", "**") or (text == "," and level.arguments > 1):
            level.signs = level.signs + 1 if text == "**" else 0
            level.arguments -= text == ","
            operand = True
        else:
            raise _unexpected(word, level.wanted)
        if len(levels) - 1 + sum(each.signs for each in levels) > MAX_NESTING:
            raise ExpressionError(f"found more than {MAX_NESTING} levels of nesting", column)
    return python + ")"


def _unexpected(word: re.Match[str], wanted: str) -> ExpressionError:
    kind = str(word.lastgroup)
    found = "the end of the expression" if kind == "end" else shown(word[kind])
    if word[kind] == "^":
        wanted += "; powers are written **"
    return ExpressionError(f"found {found}; expected {wanted}", word.start(kind) + 1)


class _Tree:
    """Makes nodes of what Python's parser has read."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._nodes = 0

    def node(self, tree: ast.expr) -> Node:
        column = tree.col_offset
        match tree:
            case ast.Constant(value=int() | float() as value):
                return self._made(Op.CONSTANT, (), column, a=float(value))
            case ast.Name(id="t"):
                return self._made(Op.AFFINE, (), column, b=1.0)
            case ast.Name(id="pi"):
                return self._made(Op.CONSTANT, (), column, a=math.pi)
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in FUNCTIONS:
                return self._made(FUNCTIONS[name][0], tuple(map(self.node, arguments)), column)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.node(operand)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._made(Op.SCALE, (self.node(operand),), column, a=-1.0)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                column = self._operator(left)
                return self._made(Op.POWER, (self.node(left),), column, a=self._exponent(right, column))
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
                arguments_ = (self.node(left), self.node(right))
                return self._made(_OPERATORS[type(operator)], arguments_, self._operator(left))
        raise ExpressionError(f"{type(tree).__name__} is not of this grammar", column)

    def _operator(self, left: ast.expr) -> int:
        """Column of the operator after an operand."""
        closed = _CLOSED.match(self._text, left.end_col_offset or 0)
        return closed.end() if closed is not None else left.col_offset

    def _exponent(self, tree: ast.expr, column: int) -> float:
        exponent = value_of_constant(self.node(tree))
        if exponent is None:
            raise ExpressionError("found an exponent that depends on t; it must be a constant", column)
        if not math.isfinite(exponent):
            raise ExpressionError("found an exponent that is not finite", column)
        return exponent

    def _made(self, op: Op, args: tuple[Node, ...], column: int, a: float = 0.0, b: float = 0.0) -> Node:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            words = f"found more than {MAX_NODES} numbers, names and operations in one expression"
            raise ExpressionError(words, column)
        node = Node(op, args, a, b, column)
        value = value_of_constant(node)
        if value is None:
            return node
        if not math.isfinite(value):
            word = _WORD.match(self._text, column)
            raise ExpressionError(f"{shown(word[0] if word else '')} gives no finite number here", column)
        return constant(value, column)
