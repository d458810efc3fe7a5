"""The grammar of expressions in t. It is all there is: no Python is parsed, compiled or run.

sum     = product (("+" | "-") product)*
product = signed (("*" | "/") signed)*
signed  = ("+" | "-") signed | power
power   = atom ["**" signed]                  exponent: a constant
atom    = number | "t" | "pi" | function "(" sum ["," sum] ")" | "(" sum ")"
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from escort_mj.errors import EscortError
from escort_mj.numerics.program import Op
from escort_mj.scenario.findings import nearest, shown
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

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>\*\*|[-+*/(),])|(?P<end>$)|(?P<foreign>\S))"
)


class ExpressionError(EscortError, ValueError):
    """Text that is not an expression in t.

    Attributes:
        column: Where the fault lies in the expression, from 1.
    """

    exit_code = 2

    def __init__(self, message: str, column: int) -> None:
        self.column = column
        super().__init__(f"{message} (column {column} of the expression)")


class Token(NamedTuple):
    """One word of an expression: its kind (a group of `_TOKEN`), text and column from 1."""

    kind: str
    text: str
    column: int


def parse(source: str) -> Node:
    """Reads an expression.

    Raises:
        ExpressionError: If it is none, or is longer, larger or deeper than an expression may be.
    """
    if len(source) > MAX_LENGTH:
        raise ExpressionError(
            f"found {len(source)} characters; an expression has at most {MAX_LENGTH}", MAX_LENGTH + 1
        )
    return _Parser(_tokens(source)).whole()


def _tokens(source: str) -> list[Token]:
    tokens: list[Token] = []
    position = 0
    while not tokens or tokens[-1].kind != "end":
        match = _TOKEN.match(source, position)
        assert match is not None and match.lastgroup is not None, "every text matches one of the kinds"
        kind = match.lastgroup
        tokens.append(Token(kind, match[kind], match.start(kind) + 1))
        position = match.end()
    return tokens


class _Parser:
    """Recursive descent over the tokens; every rule of the grammar is one method."""

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.index = 0
        self.nodes = 0
        self.nesting = 0

    @property
    def token(self) -> Token:
        return self.tokens[self.index]

    def whole(self) -> Node:
        node = self.sum()
        if self.token.kind != "end":
            raise self.unexpected("an operator (+ - * / **) or the end")
        return node

    def sum(self) -> Node:
        node = self.product()
        while sign := self.take("+", "-"):
            node = self.node(Op.ADD if sign.text == "+" else Op.SUBTRACT, (node, self.product()), sign)
        return node

    def product(self) -> Node:
        node = self.signed()
        while sign := self.take("*", "/"):
            node = self.node(Op.MULTIPLY if sign.text == "*" else Op.DIVIDE, (node, self.signed()), sign)
        return node

    def signed(self) -> Node:
        sign = self.take("+", "-")
        if sign is None:
            return self.power()
        self.descend(sign)
        node = self.signed()
        self.nesting -= 1
        return node if sign.text == "+" else self.node(Op.SCALE, (node,), sign, a=-1.0)

    def power(self) -> Node:
        base = self.atom()
        sign = self.take("**")
        if sign is None:
            return base
        self.descend(sign)
        exponent = value_of_constant(self.signed())
        self.nesting -= 1
        if exponent is None:
            raise ExpressionError("found an exponent that depends on t; it must be a constant", sign.column)
        if not math.isfinite(exponent):
            raise ExpressionError("found an exponent that is not finite", sign.column)
        return self.node(Op.POWER, (base,), sign, a=exponent)

    def atom(self) -> Node:
        token = self.token
        if token.kind == "number":
            self.index += 1
            return self.number(token)
        if token.kind == "name":
            self.index += 1
            return self.named(token)
        if self.take("("):
            self.descend(token)
            node = self.sum()
            self.expect(")", "an operator or a closing parenthesis")
            self.nesting -= 1
            return node
        raise self.unexpected("a number, t, pi, a function or an opening parenthesis")

    def number(self, token: Token) -> Node:
        value = float(token.text)
        if not math.isfinite(value):
            raise ExpressionError(f"found {token.text}, beyond the largest number", token.column)
        if token.text.isdigit() and value > LARGEST_WHOLE:
            raise ExpressionError(
                f"found a whole number of {len(token.text)} digits; write it as {value:.3e}", token.column
            )
        return self.node(Op.CONSTANT, (), token, a=value)

    def named(self, token: Token) -> Node:
        if token.text == "t":
            return self.node(Op.AFFINE, (), token, b=1.0)
        if token.text == "pi":
            return self.node(Op.CONSTANT, (), token, a=math.pi)
        if token.text not in FUNCTIONS:
            raise ExpressionError(
                f"found the unknown name {shown(token.text)}; allowed are {', '.join(NAMES)}"
                + nearest(token.text, NAMES),
                token.column,
            )
        op, arity = FUNCTIONS[token.text]
        self.expect("(", f"an opening parenthesis after {token.text}")
        self.descend(token)
        args = [self.sum()]
        while len(args) < arity:
            self.expect(",", f"a comma, for {token.text} takes {arity} arguments")
            args.append(self.sum())
        self.expect(")", f"a closing parenthesis, for {token.text} takes {arity} argument{'s'[: arity - 1]}")
        self.nesting -= 1
        return self.node(op, tuple(args), token)

    def node(self, op: Op, args: tuple[Node, ...], token: Token, a: float = 0.0, b: float = 0.0) -> Node:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise ExpressionError(
                f"found more than {MAX_NODES} numbers, names and operations in one expression", token.column
            )
        node = Node(op, args, a, b, token.column)
        value = value_of_constant(node)
        if value is not None and not math.isfinite(value):
            raise ExpressionError(f"{shown(token.text)} gives no finite number here", token.column)
        return constant(value, token.column) if value is not None else node

    def descend(self, token: Token) -> None:
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise ExpressionError(f"found more than {MAX_NESTING} levels of nesting", token.column)

    def take(self, *signs: str) -> Token | None:
        token = self.token
        if token.kind != "sign" or token.text not in signs:
            return None
        self.index += 1
        return token

    def expect(self, sign: str, wanted: str) -> None:
        if not self.take(sign):
            raise self.unexpected(wanted)

    def unexpected(self, wanted: str) -> ExpressionError:
        kind, text, column = self.token
        found = "the end of the expression" if kind == "end" else shown(text)
        if text == "^":
            wanted += "; powers are written **"
        return ExpressionError(f"found {found}; expected {wanted}", column)
