"""The MuJoCo library that the bindings have loaded, and those of its functions that kernels call."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@cache
def library() -> ctypes.CDLL:
    """The library; loading it again only counts one more user."""
    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    path = next(found for pattern in patterns for found in sorted(folder.glob(pattern)))
    return ctypes.CDLL(str(path))


# Compiled code names the function; its address is found anew by every process that loads it.
llvmlite.binding.add_symbol("mj_geomDistance", ctypes.cast(library().mj_geomDistance, ctypes.c_void_p).value)


@intrinsic
def geom_distance(
    context: Any, model: Any, data: Any, geom1: Any, geom2: Any, farthest: Any, segment: Any
) -> Any:
    """MuJoCo's `mj_geomDistance`, for kernels: signed distance of two geoms, at most `farthest` [m].

    Addresses of model and data; the two geoms; the address of six numbers for the nearest points on both.
    """
    signature = types.float64(types.intp, types.intp, types.int32, types.int32, types.float64, types.intp)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds = [context.get_value_type(kind) for kind in signature.args]
        kind = ir.FunctionType(ir.DoubleType(), kinds)
        function = cgutils.get_or_insert_function(builder.module, kind, "mj_geomDistance")
        return builder.call(function, arguments)

    return signature, generate
