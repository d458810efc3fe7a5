"""Values in kernels: of memory, a load for each name that is read; or parts, and what is computed of them."""

from __future__ import annotations

import hashlib
from functools import reduce
from typing import Any

from llvmlite import ir

from escort_mj.native.compiler.lanes import lanes, load_at, pick_at
from escort_mj.native.compiler.machine import instructions_of
from escort_mj.native.compiler.numba_parts import (
    AbstractTemplate,
    AttributeTemplate,
    TypingError,
    infer_getattr,
    infer_global,
    lower_builtin,
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
        self.first = names.first
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
        row = others[0].type(axes.rows[name])
        if axes.first:
            place = read_field(context, builder, axes.view, model.view, axes.first)
            first = make_array(type_of_field(axes.view, axes.first))(context, builder, place)
            row = builder.add(row, builder.fptosi(builder.load(first.data), row.type))
        data = builder.gep(data, [reduce(builder.mul, others, row)])
    return pick_at(builder, data, model.at) if axes.at == lanes else load_at(builder, data, model.at)


class ComputedType(types.Type):
    """Type of values in kernels that are parts, and what properties and methods compute of them."""

    def __init__(self, kind: type, names: tuple[str, ...], parts: tuple[types.Type, ...]) -> None:
        self.kind, self.parts = kind, dict(zip(names, parts, strict=True))
        super().__init__(name=f"{kind.__name__}({', '.join(part.name for part in parts)})")


@register_model(ComputedType)
class _ComputedModel(models.StructModel):
    def __init__(self, manager: Any, kind: ComputedType) -> None:
        super().__init__(manager, kind, [*kind.parts.items()])


def teach_computed(make: Any, kind: type, names: tuple[str, ...], in_kernels: Any) -> None:
    """Tells numba of a function that makes values of a class, see `values.maker_of`.

    Args:
        make: The function.
        kind: The class.
        names: Its parts.
        in_kernels: Makes a function callable in kernels.
    """
    for name, member in vars(kind).items():
        function = member.fget if isinstance(member, property) else member
        if callable(function) and not name.startswith("__"):
            _computed[kind, name] = types.Dispatcher(in_kernels(function))

    class Make(AbstractTemplate):
        key = make

        def generic(self, arguments: Any, keywords: Any) -> Any:
            parts = [types.intp if isinstance(part, types.Integer) else part for part in arguments]
            return ComputedType(kind, names, tuple(parts))(*parts)

    infer_global(make, types.Function(Make))

    @lower_builtin(make, types.VarArg(types.Any))
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = context.make_helper(builder, signature.return_type)
        for name, part in zip(names, arguments, strict=True):
            setattr(value, name, part)
        return value._getvalue()


_computed: dict[tuple[type, str], Any] = {}


@infer_getattr
class _ComputedAttributes(AttributeTemplate):
    key = ComputedType

    def generic_resolve(self, value: ComputedType, name: str) -> types.Type:
        if name in value.parts:
            return value.parts[name]
        function: Any = _computed.get((value.kind, name))
        if function is None:
            known = [each for kind, each in _computed if kind is value.kind]
            raise TypingError(unknown(name, (each for each in known if not each.startswith("_"))))
        if isinstance(vars(value.kind)[name], property):
            return function.get_call_type(self.context, (value,), {}).return_type

        class Method(AbstractTemplate):
            key = _Call(value, name)

            def generic(self, arguments: Any, keywords: Any) -> Any:
                return function.get_call_type(self.context, (value, *arguments), keywords).as_method()

        return types.BoundFunction(Method, value)


class _Call:
    """Stands for the calls of a method, and generates them."""

    known: dict[tuple[ComputedType, str], _Call] = {}
    function: Any

    def __new__(cls, value: ComputedType, name: str) -> _Call:
        if (value, name) not in cls.known:
            call = cls.known[value, name] = object.__new__(cls)
            call.function = _computed[value.kind, name]
            lower_builtin(call, value, types.VarArg(types.Any))(call._generate)
        return cls.known[value, name]

    def _generate(self, context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        typed = self.function.get_call_type(context.typing_context, signature.args, {})
        return context.get_function(self.function, typed)(builder, arguments)


@lower_getattr_generic(ComputedType)
def _get_computed(context: Any, builder: Any, kind: ComputedType, value: Any, name: str) -> Any:
    """Machine code that reads a part, or computes a property."""
    if name in kind.parts:
        return getattr(context.make_helper(builder, kind, value=value), name)
    function = _computed[kind.kind, name]
    typed = function.get_call_type(context.typing_context, (kind,), {})
    return context.get_function(function, typed)(builder, (value,))
