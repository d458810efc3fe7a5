"""Where MuJoCo's C structures keep their fields, computed from the introspection data that ships with it.

Nothing is assumed about a MuJoCo release: offsets are worked out from the declared field types at run
time, and checked against the addresses that the Python bindings report for a live model.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import mujoco
from mujoco.introspect import ast_nodes, structs

_SCALARS: dict[str, type] = {
    "mjtNum": ctypes.c_double,
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "char": ctypes.c_char,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "mjtSize": ctypes.c_int64,
    "mjtByte": ctypes.c_uint8,
    "mjtBool": ctypes.c_bool,
}


@cache
def structure(name: str) -> type[ctypes.Structure]:
    """The ctypes twin of one of MuJoCo's structures, such as `mjData`."""
    fields = [(field.name, _ctype(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _ctype(node: Any) -> Any:
    """The ctypes type of a declared field type."""
    if isinstance(node, ast_nodes.ValueType):
        return _SCALARS.get(node.name) or structure(node.name)
    if isinstance(node, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(node, ast_nodes.ArrayType):
        kind = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            kind = kind * extent
        return kind
    fields = [(field.name, _ctype(field.type)) for field in node.fields]
    return type("anonymous", (ctypes.Structure,), {"_fields_": fields})


def offset(struct: str, field: str) -> int:
    """Byte offset of a (possibly nested, dotted) field in a structure."""
    kind: Any = structure(struct)
    total = 0
    for part in field.split("."):
        total += getattr(kind, part).offset
        kind = dict(kind._fields_)[part]
    return total


def check(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Compares the computed offsets with what the bindings say of a live model.

    Raises:
        RuntimeError: If this MuJoCo's memory is not laid out as its introspection data says.
    """
    addresses = {
        ("mjData", field): getattr(data, field).ctypes.data
        for field in ("qpos", "qvel", "ctrl", "userdata", "qfrc_applied", "actuator_force", "mocap_pos")
    } | {("mjModel", "numeric_data"): model.numeric_data.ctypes.data}
    for (struct, field), expected in addresses.items():
        base = data._address if struct == "mjData" else model._address
        found = ctypes.c_void_p.from_address(base + offset(struct, field)).value
        if found != expected:
            raise RuntimeError(
                f"mujoco {mujoco.__version__}: {struct}.{field} is not where it is declared to be"
            )
    time = ctypes.c_double.from_address(data._address + offset("mjData", "time")).value
    if time != data.time:
        raise RuntimeError(f"mujoco {mujoco.__version__}: mjData.time is not where it is declared to be")
