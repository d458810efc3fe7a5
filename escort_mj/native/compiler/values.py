"""Values of memory in kernels: addresses, and a load for each name that is read."""

from __future__ import annotations

import hashlib
from functools import reduce
from typing import Any

from llvmlite import ir

from escort_mj.native.compiler.lanes import lanes, load_at, pick_at
from escort_mj.native.compiler.machine import instructions_of
from escort_mj.native.compiler.numba_parts import (
    AttributeTemplate,
    TypingError,
    infer_getattr,
    lower_getattr_generic,
    make_array,
    models,
    register_model,
    types,
)
from escort_mj.native.compiler.views import ViewType, read_field, type_of_field
from escort_mj.native.values import Names, unknown


class AxesType(types.Type):
    """Type of values of axes in kernels."""

    def __init__(self, view: ViewType, at: types.Type, names: Names) -> None:
        self.view, self.at = view, at
        self.fields = dict(names.fields) | {name: field for name, field, _ in names.rows}
        self.rows = {name: row for name, _, row in names.rows}
        mark = hashlib.sha256(repr(names).encode()).hexdigest()[:8]
        super().__init__(name=f"Values({view.name}, {at.name}, {mark})")


@register_model(AxesType)
class _AxesModel(models.StructModel):
    def __init__(self, manager: Any, kind: AxesType) -> None:
        super().__init__(manager, kind, [("view", kind.view), ("at", kind.at)])


def teach_axes(function: Any, names: Names) -> None:
    """Tells numba of a function that gives values of axes, see `values.reader_of`."""

    @instructions_of(function)
    def axes_at(context: Any, view: Any, at: Any) -> Any:
        place = at if at == lanes else types.intp
        kind = AxesType(view, place, names)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            model = context.make_helper(builder, kind)
            model.view = arguments[0]
            model.at = arguments[1]
            return model._getvalue()

        return kind(view, place), generate


@infer_getattr
class _Attributes(AttributeTemplate):
    key = AxesType

    def generic_resolve(self, axes: AxesType, name: str) -> types.Type:
        if name not in axes.fields:
            raise TypingError(unknown(name, axes.fields))
        kind = type_of_field(axes.view, axes.fields[name])
        if not isinstance(kind, types.Array):
            return kind
        return types.float64 if _is_number(axes, name) else lanes


def _is_number(axes: AxesType, name: str) -> bool:
    """Whether a value is one number: of a vector of one, or a row of a vector."""
    shape = axes.view.fields[axes.fields[name]].shape
    return shape == ((1,),) or (len(shape) == 1 and name in axes.rows)


@lower_getattr_generic(AxesType)
def _get(context: Any, builder: Any, axes: AxesType, value: Any, name: str) -> Any:
    """Machine code that reads a value."""
    model, field = context.make_helper(builder, axes, value=value), axes.fields[name]
    kind = type_of_field(axes.view, field)
    found = read_field(context, builder, axes.view, model.view, field)
    if not isinstance(kind, types.Array):
        return found
    array = make_array(kind)(context, builder, found)
    data = array.data
    if _is_number(axes, name):
        return builder.load(builder.gep(data, [ir.IntType(64)(axes.rows.get(name, 0))]))
    if name in axes.rows:
        _, *others = (builder.extract_value(array.shape, k) for k in range(kind.ndim))
        data = builder.gep(data, [reduce(builder.mul, others, others[0].type(axes.rows[name]))])
    return pick_at(builder, data, model.at) if axes.at == lanes else load_at(builder, data, model.at)
