"""Views of flat memory as kernels have them: two addresses; reading a field loads its place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir

from escort_mj.native import kernels
from escort_mj.native.compiler.machine import instructions_of
from escort_mj.native.compiler.numba_parts import (
    AttributeTemplate,
    CallableTemplate,
    TypingError,
    infer_getattr,
    infer_global,
    lower_builtin,
    lower_getattr_generic,
    make_array,
    models,
    populate_array,
    register_model,
    types,
)
from escort_mj.native.fields import Extent
from escort_mj.native.kernels import DOUBLE
from escort_mj.native.memory import AXES, Field, Layout, layout_with
from escort_mj.native.values import unknown

_LAYOUTS: dict[str, tuple[Layout, type]] = {}
_KINDS = {float: types.float64, int: types.intp, bool: types.boolean}


class ViewType(types.Type):
    """Type of a view in kernels; it names its layout, and the number of axes where that is known."""

    def __init__(self, layout: str, axes: int | None) -> None:
        self.layout, self.axes = layout, axes
        super().__init__(name=f"View({layout}, {axes})")

    @property
    def fields(self) -> dict[str, Field]:
        """Its fields by name."""
        layout, kind = _LAYOUTS[self.layout]
        return layout.fields[kind]

    @property
    def dimensions(self) -> dict[str, int]:
        """Where the header has the size of each dimension."""
        return _LAYOUTS[self.layout][0].dimensions


@register_model(ViewType)
class _ViewModel(models.StructModel):
    def __init__(self, manager: Any, kind: ViewType) -> None:
        super().__init__(manager, kind, [("plan", types.intp), ("memory", types.intp)])


def view_type(name: str, axes: int | None) -> ViewType:
    """Type in kernels of the view that the class of a name declares."""
    return next(ViewType(view, axes) for view, (_, kind) in _LAYOUTS.items() if kind.__name__ == name)


def name_view(name: str, layout: Layout, kind: type, axes: int | None) -> ViewType:
    """Type in kernels of a view by a name of one's own, for functions that are handed one."""
    _LAYOUTS[name] = layout, kind
    return ViewType(name, axes)


def teach_viewer(layout: Layout, kind: type, function: Any) -> None:
    """Tells numba of a viewer, see `memory.viewer`."""
    name = f"{function.__module__}.{function.__name__}"
    _LAYOUTS[name] = layout, kind
    addresses = 1 if kind is layout.plan else 2

    @infer_global(function)
    class Viewer(CallableTemplate):
        key = function
        prefer_literal = True

        def generic(self) -> Any:
            def typer(*arguments: types.Type) -> ViewType:
                axes = arguments[-1]
                return ViewType(name, axes.literal_value if isinstance(axes, types.IntegerLiteral) else None)

            def first(plan: types.Type, axes: types.Type) -> ViewType:
                return typer(plan, axes)

            def second(plan: types.Type, state: types.Type, axes: types.Type) -> ViewType:
                return typer(plan, state, axes)

            return first if addresses == 1 else second

    @lower_builtin(function, *[types.Integer] * (addresses + 1))
    def view(context: Any, builder: Any, signature: Any, arguments: Sequence[Any]) -> Any:
        kinds, model = signature.args, context.make_helper(builder, signature.return_type)
        model.plan = context.cast(builder, arguments[0], kinds[0], types.intp)
        model.memory = context.cast(builder, arguments[addresses - 1], kinds[addresses - 1], types.intp)
        return model._getvalue()


def teach_narrower(kind: type, function: Any) -> None:
    """Tells numba of a function that views a part of the state, see `memory.narrower`."""
    name = f"{function.__module__}.{function.__name__}"
    _LAYOUTS[name] = layout_with(kind), kind

    @instructions_of(function)
    def narrow(context: Any, state: Any) -> Any:
        found = ViewType(name, state.axes)
        return found(state), lambda context, builder, signature, arguments: arguments[0]


@instructions_of(kernels.view_addresses)
def _view_addresses(context: Any, view: Any) -> Any:
    pair = types.UniTuple(types.intp, 2)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        model = context.make_helper(builder, signature.args[0], value=arguments[0])
        return context.make_tuple(builder, pair, [model.plan, model.memory])

    return pair(view), generate


@infer_getattr
class _Attributes(AttributeTemplate):
    key = ViewType

    def generic_resolve(self, view: ViewType, name: str) -> types.Type:
        if name not in view.fields:
            raise TypingError(unknown(name, view.fields))
        return type_of_field(view, name)


def type_of_field(view: ViewType, name: str) -> types.Type:
    """Type of a field in kernels."""
    field = view.fields[name]
    if field.kind is np.ndarray:
        return types.Array(types.float64, len(field.shape), "C")
    return _KINDS[field.kind]


def _number(context: Any, builder: Any, model: Any, place: int) -> Any:
    """A number of the header, which no kernel ever changes: the compiler may keep it."""
    address = builder.add(model.plan, context.get_value_type(types.intp)(DOUBLE * place))
    number = builder.load(builder.inttoptr(address, ir.DoubleType().as_pointer()))
    number.set_metadata("invariant.load", builder.module.add_metadata([]))
    return number


def number_of_axes(context: Any, builder: Any, view: ViewType, value: Any) -> Any:
    """Machine code that says how many axes there are."""
    word, model = context.get_value_type(types.intp), context.make_helper(builder, view, value=value)
    if view.axes is not None:
        return word(view.axes)
    return builder.fptosi(_number(context, builder, model, view.dimensions[AXES]), word)


@lower_getattr_generic(ViewType)
def read_field(context: Any, builder: Any, view: ViewType, value: Any, name: str) -> Any:
    """Machine code that reads a field."""
    model = context.make_helper(builder, view, value=value)
    field, word = view.fields[name], context.get_value_type(types.intp)

    def load(place: int) -> Any:
        return _number(context, builder, model, place)

    def extent(factors: Extent) -> Any:
        product = word(1)
        for factor in factors:
            if isinstance(factor, int):
                size = word(factor)
            elif factor == AXES and view.axes is not None:
                size = word(view.axes)
            else:
                size = builder.fptosi(load(view.dimensions[factor]), word)
            product = builder.mul(product, size)
        return product

    if field.kind is float:
        return load(field.place)
    if field.kind is int:
        return builder.fptosi(load(field.place), word)
    if field.kind is bool:
        return builder.fcmp_unordered("!=", load(field.place), ir.DoubleType()(0.0))
    shape = [extent(factors) for factors in field.shape]
    strides = [word(DOUBLE)]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    offset = builder.mul(builder.fptosi(load(field.place), word), word(DOUBLE))
    kind = types.Array(types.float64, len(shape), "C")
    array = make_array(kind)(context, builder)
    base = model.plan if field.in_plan else model.memory
    data = builder.inttoptr(builder.add(base, offset), context.get_data_type(types.float64).as_pointer())
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=word(DOUBLE), meminfo=None)
    return array._getvalue()
