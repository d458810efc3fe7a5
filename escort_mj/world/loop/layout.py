"""Where MuJoCo's C structures keep their fields, computed from the introspection data that ships with it.

Nothing is assumed about a MuJoCo release: offsets are worked out from the declared field types, and checked
against the addresses that the Python bindings report for a live model.
"""

from __future__ import annotations

import ctypes
import json
from collections.abc import Callable
from functools import cache
from typing import Any

import mujoco

from escort_mj.native.kernels import number
from escort_mj.native.shipped import remembered

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


STRUCTURES = ("mjModel", "mjData", "mjContact")

# Arrays that the callbacks read or write.
DATA_ARRAYS = (
    "qpos",
    "qvel",
    "ctrl",
    "act",
    "userdata",
    "qfrc_applied",
    "actuator_force",
    "mocap_pos",
    "geom_xpos",
    "geom_xmat",
    "xpos",
    "xmat",
    "xipos",
    "cvel",
    "subtree_com",
    "xfrc_applied",
    "M",
    "qfrc_bias",
    "qfrc_passive",
    "qfrc_actuator",
    "qacc",
)
MODEL_ARRAYS = (
    "numeric_data",
    "M_rownnz",
    "M_rowadr",
    "M_colind",
    "geom_aabb",
    "geom_rbound",
    "geom_size",
    "geom_type",
)


@cache
def structure(name: str) -> type[ctypes.Structure]:
    """The ctypes twin of one of MuJoCo's structures, such as `mjData`."""
    from mujoco.introspect import structs

    fields = [(field.name, _ctype(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _ctype(node: Any) -> Any:
    """The ctypes type of a declared field type."""
    from mujoco.introspect import ast_nodes

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


def offset(struct: str, field: str) -> Callable[[], int]:
    """Return a function that returns the byte offset of a (possibly nested, dotted) field in a structure.

    Machine code has names for offsets, not numbers: it suits every release of MuJoCo.
    """
    return number(f"mujoco.{struct}.{field}", _offset(struct, field))


def size(struct: str) -> Callable[[], int]:
    """Return a function that returns the bytes of a structure."""
    return number(f"mujoco.{struct}", _offset(struct, ""))


def _offset(struct: str, field: str) -> int:
    return _layout()[struct][field]


@cache
def _layout() -> dict[str, dict[str, int]]:
    """Offsets of all fields of the structures that kernels use, and sizes under no name.

    They ship: reading MuJoCo's description of itself takes 0.1 s. Another release has its own.
    """
    found: dict[str, dict[str, int]] = json.loads(remembered(_name(), _work_out))
    return found


def texts() -> dict[str, str]:
    """Return the offsets in this release of MuJoCo, by the name of their file."""
    return {_name(): _work_out()}


def _name() -> str:
    return f"layout.{mujoco.__version__}.json"


def _work_out() -> str:
    return json.dumps({name: _offsets(structure(name)) for name in STRUCTURES})


def _offsets(kind: Any) -> dict[str, int]:
    found = {"": ctypes.sizeof(kind)}
    for name, inner in kind._fields_:
        found[name] = getattr(kind, name).offset
        if issubclass(inner, ctypes.Structure):
            found |= {f"{name}.{of}": found[name] + at for of, at in _offsets(inner).items() if of}
    return found


def check(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Compares the computed offsets with what the bindings say of a live model.

    Raises:
        RuntimeError: If this MuJoCo's memory is not laid out as its introspection data says.
    """
    for field in DATA_ARRAYS:
        if not getattr(data, field).size:  # NumPy's view of nothing is anywhere
            continue
        _compare("mjData", field, data._address, ctypes.c_void_p, getattr(data, field).ctypes.data)
    for field in MODEL_ARRAYS:
        _compare("mjModel", field, model._address, ctypes.c_void_p, getattr(model, field).ctypes.data)
    _compare("mjModel", "nnumericdata", model._address, ctypes.c_int, model.nnumericdata)
    for count in ("nv", "nC"):
        _compare("mjModel", count, model._address, ctypes.c_int, getattr(model, count))
    _compare("mjData", "time", data._address, ctypes.c_double, data.time)
    _check_contacts()


TOUCHING = """
<mujoco>
  <option cone="elliptic"/>
  <worldbody>
    <geom size="1" condim="4"/>
    <body pos="1.9 0 0"><freejoint/><geom size="1"/></body>
    <body pos="-1.9 0 0"><freejoint/><geom size="1"/></body>
  </worldbody>
</mujoco>
"""


@cache
def _check_contacts() -> None:
    """Compares what the contact watch reads, in a small model with two contacts; once for a process."""
    model = mujoco.MjModel.from_xml_string(TOUCHING)
    data = mujoco.MjData(model)
    data.time = 1.0
    mujoco.mj_forward(model, data)
    _compare("mjData", "time", data._address, ctypes.c_double, data.time)
    _compare("mjData", "ncon", data._address, ctypes.c_int, data.ncon)
    _compare("mjModel", "opt.cone", model._address, ctypes.c_int, model.opt.cone)
    _compare("mjData", "efc_force", data._address, ctypes.c_void_p, data.efc_force.ctypes.data)
    _compare("mjData", "efc_vel", data._address, ctypes.c_void_p, data.efc_vel.ctypes.data)
    _compare("mjData", "contact", data._address, ctypes.c_void_p, data.contact.dist.ctypes.data)
    first = ctypes.c_void_p.from_address(data._address + _offset("mjData", "contact")).value or 0
    for index in range(data.ncon):
        address, contact = first + index * _offset("mjContact", ""), data.contact[index]
        _compare("mjContact", "dim", address, ctypes.c_int, contact.dim)
        _compare("mjContact", "efc_address", address, ctypes.c_int, contact.efc_address)
        _compare("mjContact", "dist", address, ctypes.c_double, contact.dist)
        for k in range(3):
            _compare("mjContact", "frame", address, ctypes.c_double, contact.frame[k], k)
        for side, geom in enumerate(contact.geom):
            _compare("mjContact", "geom", address, ctypes.c_int, geom, side)


def _compare(struct: str, field: str, address: int, kind: Any, expected: Any, index: int = 0) -> None:
    """Raises unless a field of the structure at an address holds what is expected."""
    place = address + _offset(struct, field) + index * ctypes.sizeof(kind)
    if kind.from_address(place).value != expected:
        raise RuntimeError(f"mujoco {mujoco.__version__}: {struct}.{field} is not where it is declared to be")
