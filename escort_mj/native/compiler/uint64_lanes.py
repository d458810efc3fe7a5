"""The machine instructions of `native.uint64_lanes`: SIMD arithmetic on whole numbers."""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir

from escort_mj.native import kernels
from escort_mj.native import uint64_lanes as names
from escort_mj.native.compiler.lanes import lanes, spread, teach_operator
from escort_mj.native.compiler.machine import instructions_of
from escort_mj.native.compiler.numba_parts import models, register_model, types
from escort_mj.native.lanes import WIDTH

_HALF = 32  # bits


class _WordsType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Words")


words = _WordsType()
_WORD, _INT = ir.IntType(64), ir.IntType(32)
_WORDS = ir.VectorType(_WORD, WIDTH)


@register_model(_WordsType)
class _WordsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _WORDS)


def _wide(builder: Any, value: Any) -> Any:
    return spread(builder, value, _WORDS)


def _binary(function: Any, name: str) -> None:
    teach_operator(function, words, words, types.uint64, _WORDS, lambda b, x, y: getattr(b, name)(x, y))


_binary(operator.add, "add")
_binary(operator.sub, "sub")
_binary(operator.mul, "mul")
_binary(operator.xor, "xor")
_binary(operator.and_, "and_")
_binary(operator.or_, "or_")
_binary(operator.lshift, "shl")
_binary(operator.rshift, "lshr")


@instructions_of(kernels.high_product)
def _high_product(context: Any, a: Any, b: Any) -> Any:
    """Of products of halves, for which processors have an instruction; single words have one of their own."""
    if words not in (a, b):
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        lower, half = ir.Constant(_WORDS, [2**_HALF - 1] * WIDTH), ir.Constant(_WORDS, [_HALF] * WIDTH)

        def halves(value: Any) -> tuple[Any, Any]:
            return builder.and_(value, lower), builder.lshr(value, half)

        (a0, a1), (b0, b1) = (halves(_wide(builder, value)) for value in arguments)
        _, carried = halves(builder.mul(a0, b0))
        lower_cross, upper_cross = halves(builder.mul(a0, b1))
        cross = builder.add(builder.mul(a1, b0), carried)
        _, carried = halves(builder.add(cross, lower_cross))  # no more than 64 bits, all in all
        return builder.add(builder.add(builder.mul(a1, b1), upper_cross), carried)

    return words(a if a == words else types.uint64, b if b == words else types.uint64), generate


@instructions_of(names.words_from)
def _words_from(context: Any, first: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.add(_wide(builder, arguments[0]), ir.Constant(_WORDS, list(range(WIDTH))))

    return words(types.uint64), generate


@instructions_of(names.double_of)
def _double_of(context: Any, word: Any) -> Any:
    result, argument = (lanes, words) if word == words else (types.float64, types.uint64)

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(sig.return_type))

    return result(argument), generate
