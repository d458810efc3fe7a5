"""The MuJoCo library that the bindings have loaded, and those of its functions that kernels call."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import mujoco

from escort_mj.native.kernels import external


@cache
def library() -> ctypes.CDLL:
    """The library; loading it again only counts one more user."""
    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    path = next(found for pattern in patterns for found in sorted(folder.glob(pattern)))
    return ctypes.CDLL(str(path))


@external(
    ctypes.cast(library().mj_geomDistance, ctypes.c_void_p).value or 0,
    ctypes.c_double,
    *[ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_double, ctypes.c_void_p],
)
def geom_distance(model: int, data: int, geom1: int, geom2: int, farthest: float, segment: int) -> float:
    """MuJoCo's `mj_geomDistance`: signed distance of two geoms, at most `farthest` [m].

    Addresses of model and data; the two geoms; the address of six numbers for the nearest points on both.
    """
    raise NotImplementedError  # in its place stands the function of C


@external(
    ctypes.cast(library().mj_factorM, ctypes.c_void_p).value or 0,
    None,
    *[ctypes.c_void_p, ctypes.c_void_p],
)
def factor_mass(model: int, data: int) -> None:
    """MuJoCo's `mj_factorM`: factors the mass matrix as it stands.

    Addresses of model and data.
    """
    raise NotImplementedError  # in its place stands the function of C
