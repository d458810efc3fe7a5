"""NetCDF-4 as `xarray` writes it, straight to HDF5: a tenth of the time, and without importing xarray."""

from __future__ import annotations

import io
import zlib
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from escort_mj.record.recording import Recorded, Recording, Variable

COMPRESSED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
SAMPLE, WORTH = 512, 0.5  # values that are tried; share of their bytes that is worth compressing
NUMBERS, TEXTS = "fi", "UO"  # kinds of types
TEXT = h5py.string_dtype()
VARYING, ONE = h5py.h5t.py_create(TEXT, logical=True), h5py.h5s.create(h5py.h5s.SCALAR)  # of a single text
WITHOUT_LABELS = "This is a netCDF dimension but not a netCDF variable."  # the standard's own words
NUMBER, DIMENSIONS = "_Netcdf4Dimid", "_Netcdf4Coordinates"  # of a dimension, and those of a variable
LABELS = "coordinates"  # names variables that label dimensions without being called like them
RESERVED = {
    "_FillValue",
    "_NCProperties",
    "CLASS",
    "DIMENSION_LABELS",
    "DIMENSION_LIST",
    "NAME",
    "REFERENCE_LIST",
    DIMENSIONS,
    LABELS,
    NUMBER,
}
"""Attributes that belong to the format."""


def to_netcdf(trace: Recorded) -> memoryview:
    """Return a trace as the content of a NetCDF-4 file.

    Raises:
        TypeError: If the type of an attribute or of a variable has no place in the format.
        ValueError: If a text has a NUL in it.
    """
    content = io.BytesIO()
    sizes = {str(dim): size for dim, size in trace.sizes.items()}
    variables = {str(name): one for group in (trace.coords, trace.data_vars) for name, one in group.items()}
    with h5py.File(content, "w", track_order=True) as file:
        _write_attributes(file, trace.attrs)
        growing = {dim for dim, size in sizes.items() if not size and dim not in variables}
        written = {name: _write_variable(file, name, one, growing) for name, one in variables.items()}
        numbers = {dim: number for number, dim in enumerate(sizes)}
        for dim, size in sizes.items():
            if dim in written:
                written[dim].make_scale(dim)
            else:
                written[dim] = file.create_dataset(
                    dim, (size,), ">f4", maxshape=_limits([dim], [size], growing)
                )
                written[dim].make_scale(f"{WITHOUT_LABELS}{size:10}")
            _write_attribute(written[dim], NUMBER, np.array(numbers[dim], "int32"))
        labels = {str(name): one.dims for name, one in trace.coords.items() if name not in sizes}
        for name, one in variables.items():
            _write_attribute(written[name], DIMENSIONS, np.array([numbers[str(d)] for d in one.dims], "i4"))
            if name in sizes:
                continue
            for place, dim in enumerate(one.dims):
                h5py.h5ds.attach_scale(written[name].id, written[str(dim)].id, place)
            labeled = [each for each, dims in labels.items() if {*dims} <= {*one.dims}]
            if name not in labels and labeled:
                _write_attribute(written[name], LABELS, " ".join(labeled))
    return content.getbuffer()


def from_netcdf(path: Path) -> Recording:
    """Return the trace in a NetCDF-4 file, whole in memory.

    Raises:
        Exception: Whatever HDF5 stumbles over in a file that is not one, or is damaged.
    """
    with h5py.File(path, "r") as file:
        datasets = dict(file.items())
        if strange := [name for name, each in datasets.items() if not isinstance(each, h5py.Dataset)]:
            raise ValueError(f"{strange[0]} is not a variable")
        dims = {int(each.attrs[NUMBER]): name for name, each in datasets.items() if each.is_scale}
        variables: dict[Hashable, Variable] = {}
        labels = _labels(file).union(dims.values())
        for name, each in datasets.items():
            if WITHOUT_LABELS.encode() in bytes(each.attrs.get("NAME", b"")):
                continue
            its = [name] if each.is_scale else [dims[number] for number in each.attrs.get(DIMENSIONS, ())]
            variables[name] = Variable(tuple(its), _values(each), _attributes(each))
            labels |= _labels(each)
        coords, others = (
            {name: one for name, one in variables.items() if (name in labels) is label}
            for label in (True, False)
        )
        return Recording(_attributes(file), coords, others)


def _write_variable(file: h5py.File, name: str, variable: Any, growing: set[str]) -> h5py.Dataset:
    """Write the values and attributes of a variable; some dimensions may grow."""
    values: NDArray[Any] = variable.values
    if values.dtype.kind in NUMBERS:
        limits = _limits(variable.dims, values.shape, growing)
        packed = COMPRESSED if _shrinks(values) else {}
        dataset = file.create_dataset(name, data=values, maxshape=limits, **packed)
    elif values.dtype.kind in TEXTS:
        dataset = file.create_dataset(name, data=values.astype(object), dtype=h5py.string_dtype())
    else:
        raise TypeError(f"{name} is of the type {values.dtype}")
    _write_attributes(dataset, variable.attrs)
    return dataset


def _shrinks(values: NDArray[Any]) -> bool:
    """Whether compressing values is worth its time, as a sample of them tells: noise does not shrink."""
    sample = values.reshape(-1)[values.size // 2 :][:SAMPLE]
    shuffled = np.ascontiguousarray(sample).view(np.uint8).reshape(-1, values.itemsize).T.tobytes()
    return values.ndim > 0 and len(zlib.compress(shuffled, 1)) < WORTH * len(shuffled)


def _limits(dims: Sequence[Any], shape: Sequence[int], growing: set[str]) -> tuple[int | None, ...] | None:
    """Largest sizes in the words of HDF5: None for a dimension that may grow, and None if none may.

    To NetCDF every dimension of size 0 without labels is one that may.
    """
    if not growing.intersection(dims):
        return None
    return tuple(None if dim in growing else size for dim, size in zip(dims, shape, strict=True))


def _write_attributes(to: h5py.HLObject, attributes: Mapping[Any, Any]) -> None:
    for key, value in attributes.items():
        _write_attribute(to, str(key), value if isinstance(value, str) else np.atleast_1d(value))


def _write_attribute(to: h5py.HLObject, key: str, value: Any) -> None:
    """Write a new attribute, straight to HDF5 where that has its type: `attrs` takes three times as long."""
    if isinstance(value, str):
        h5py.h5a.create(to.id, key.encode(), VARYING, ONE).write(np.array(value, TEXT))
    elif value.dtype.kind in NUMBERS:
        space = h5py.h5s.create_simple(value.shape) if value.ndim else ONE
        kind = h5py.h5t.py_create(value.dtype, logical=True)
        h5py.h5a.create(to.id, key.encode(), kind, space).write(value)
    else:
        to.attrs[key] = value


def _attributes(of: h5py.HLObject) -> dict[str, Any]:
    """Attributes that are not the format's; a single number as such."""
    return {key: _attribute(of.attrs[key]) for key in of.attrs if key not in RESERVED}


def _attribute(value: Any) -> Any:
    """A text, which some writers keep as bytes, numbers, or a single number."""
    if isinstance(value, bytes):
        return value.decode()
    return value[0] if isinstance(value, np.ndarray) and value.shape == (1,) else value


def _labels(of: h5py.HLObject) -> set[str]:
    """Names of the variables that an object names as labels."""
    return {*str(_attribute(of.attrs.get(LABELS, ""))).split()}


def _values(dataset: h5py.Dataset) -> NDArray[Any]:
    """The values of a variable: numbers, or text of any length."""
    if h5py.check_string_dtype(dataset.dtype) is None:
        return dataset[()]
    return np.asarray(dataset.asstr()[()], dtype=str)
