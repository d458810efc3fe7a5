"""Named views of flat memory: a class declares fields with their shapes; Python and kernels read the same.

What a mission's kernels need lies in two flat vectors of numbers, so that it travels where MuJoCo keeps it.
The first, the plan, begins with a header: its own length, the size of every dimension, where each array lies
in either vector, and the scalars. In kernels a view is two addresses, whatever it holds: reading a field
loads its place from the header. Python gets NumPy views, all at once.

Every array has room for whole lanes, and arrays of robots for whole lanes of robots: kernels read and write
them lanes at a time, never less, and what lies between two arrays belongs to none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache
from math import prod
from typing import Any, NamedTuple

import numpy as np

from escort_mj.native.fields import Array, Declared, Extent, Fields, declared
from escort_mj.native.kernels import DOUBLE, matrix_at, vector_at
from escort_mj.native.lanes import WIDTH, room_for

AXES = "p"  # the dimension that kernels may know when they are compiled
MAGIC, LENGTH, FIRST = 0, 1, 2  # places in the header


class Field(NamedTuple):
    """One field of a view.

    Attributes:
        kind: `float`, `int` or `bool` for a scalar, ndarray for an array of floats.
        shape: Extent of each of an array's dimensions.
        place: Where the header has the scalar's value, or the array's offset in its vector.
        in_plan: Whether an array lies in the plan.
    """

    kind: Any
    shape: tuple[Extent, ...]
    place: int
    in_plan: bool


class Layout:
    """Where the fields of a plan and of a state lie.

    Args:
        magic: First number of every plan.
        plan: Class whose annotations declare its fields, see `fields`.
        state: The same, arrays only; None where the plan is all there is.
        whole: Dimensions of which arrays that begin with one have whole lanes, such as the number of robots.
    """

    def __init__(
        self, magic: float, plan: type, state: type | None = None, whole: tuple[str, ...] = ()
    ) -> None:
        self.magic, self.whole = magic, {(name,) for name in whole}
        known = {kind: declared(kind) for kind in (plan, state) if kind is not None}
        names = [AXES, *(name for fields in known.values() for name in _dimensions(fields.values()))]
        self.dimensions = {name: FIRST + k for k, name in enumerate(dict.fromkeys(names))}
        place = FIRST + len(self.dimensions)
        self.fields: dict[type, dict[str, Field]] = {}
        for kind, fields in known.items():
            self.fields[kind] = {
                name: Field(field.kind, field.shape, place + k, kind is plan)
                for k, (name, field) in enumerate(fields.items())
            }
            place += len(fields)
        self.header_size = room_for(place)
        self.plan, self.state = plan, state
        self._shapes = lru_cache(maxsize=64)(self._shapes_of)  # the parts of a mission share their sizes

    def part(self, kind: type) -> None:
        """Make a class readable that annotates some fields of the state, or else of the plan, by name."""
        assert self.state is not None
        known = self.fields[self.plan] | self.fields[self.state]
        self.fields[kind] = {name: known[name] for name in declared(kind)}
        _layouts[kind] = self

    def sizes(self, values: Mapping[str, Any]) -> dict[str, int]:
        """Return the sizes of those dimensions that stand alone in the shape of one of a plan's arrays.

        Args:
            values: Fields of the plan.
        """
        found: dict[str, int] = {}
        for name, value in values.items():
            for extent, size in zip(self.fields[self.plan][name].shape, np.shape(value), strict=False):
                if len(extent) == 1 and isinstance(extent[0], str):
                    found.setdefault(extent[0], size)
        return found

    def pack(self, sizes: Mapping[str, int], values: Mapping[str, Any]) -> Array:
        """Writes a plan.

        Args:
            sizes: Size of each dimension.
            values: Each field of the plan.

        Raises:
            ValueError: If something is missing, not known or of another shape than declared.
        """
        _same_names("dimensions", sizes, self.dimensions)
        _same_names("fields", values, self.fields[self.plan])
        plan = np.zeros(self.plan_size(sizes))
        header, end = plan[: self.header_size], self.header_size
        header[MAGIC] = self.magic
        for name, place in self.dimensions.items():
            header[place] = sizes[name]
        shapes = self._shapes(self.plan, tuple(sizes.items()))
        for name, field in self.fields[self.plan].items():
            if field.kind is not np.ndarray:
                header[field.place] = values[name]
                continue
            block, (shape, room) = np.asarray(values[name], dtype=float), shapes[name]
            if block.shape != shape:
                raise ValueError(f"{name} has the shape {block.shape}; expected {shape}")
            header[field.place] = end
            plan[end : end + block.size] = block.ravel()
            end += room
        header[LENGTH] = end
        for name, (start, _) in self.places(sizes).items():
            assert self.state is not None
            header[self.fields[self.state][name].place] = start
        return plan

    def plan_size(self, sizes: Mapping[str, int]) -> int:
        """Length of a plan with dimensions of these sizes."""
        return self.header_size + sum(
            room for _, room in self._shapes(self.plan, tuple(sizes.items())).values()
        )

    def places(self, sizes: Mapping[str, int]) -> dict[str, tuple[int, int]]:
        """Where each array of the state begins, and how many numbers it has.

        Args:
            sizes: Size of each dimension.
        """
        if self.state is None:
            return {}
        found, end = {}, 0
        for name, (shape, room) in self._shapes(self.state, tuple(sizes.items())).items():
            found[name] = end, prod(shape)
            end += room
        return found

    def state_size(self, plan: Array) -> int:
        """Length of the state vector that belongs to a plan."""
        assert self.state is not None
        name, last = list(self.fields[self.state].items())[-1]
        return int(plan[last.place]) + self._shapes(self.state, self._sizes(plan))[name][1]

    def read(self, kind: type, plan: int, memory: int) -> Any:
        """NumPy views of all fields, as an instance of the class that declared them.

        Args:
            kind: The plan's or the state's class, or a part of them.
            plan: Address of the plan.
            memory: Address of the vector that holds the arrays: the plan's own, or the state's.
        """
        header = vector_at(plan, self.header_size)
        shapes = self._shapes(kind, self._sizes(header))
        values: dict[str, Any] = {}
        for name, field in self.fields[kind].items():
            if field.kind is not np.ndarray:
                value = header[field.place]  # divided by zero it gives what the machine gives
                values[name] = value if field.kind is float else field.kind(value)
                continue
            shape, _ = shapes[name]
            base = plan if field.in_plan else memory
            flat = matrix_at(base + DOUBLE * int(header[field.place]), 1, prod(shape))
            values[name] = flat.reshape(shape)
        view = kind(**values)
        if isinstance(view, Fields):
            view.addresses = plan, memory
        return view

    def _room(self, field: Field, shape: tuple[int, ...]) -> int:
        """How many numbers an array of a shape has room for."""
        rows, *others = shape
        if field.shape[0] in self.whole:
            return room_for(rows) * prod(others)
        return room_for(rows * prod(others) + (WIDTH - 1) * bool(others))  # each row may be written in lanes

    def _shapes_of(
        self, kind: type, sizes: tuple[tuple[str, int], ...]
    ) -> dict[str, tuple[tuple[int, ...], int]]:
        """Shapes of the arrays of a plan, a state or a part of them, and how many numbers each has room for.

        Args:
            kind: The plan's or the state's class, or a part of them.
            sizes: Size of each dimension.
        """
        known, found = dict(sizes), {}
        for name, field in self.fields[kind].items():
            if field.kind is np.ndarray:
                shape = shape_of(field, known)
                found[name] = shape, self._room(field, shape)
        return found

    def _sizes(self, header: Array) -> tuple[tuple[str, int], ...]:
        found = header[FIRST : FIRST + len(self.dimensions)].tolist()
        return tuple(zip(self.dimensions, map(int, found), strict=True))


def _dimensions(fields: Iterable[Declared]) -> list[str]:
    """Names of the dimensions that fields use."""
    return [
        factor for field in fields for extent in field.shape for factor in extent if isinstance(factor, str)
    ]


def shape_of(field: Field | Declared, sizes: Mapping[str, int]) -> tuple[int, ...]:
    """Return the shape of a field for dimensions of these sizes."""
    return tuple(prod(sizes[f] if isinstance(f, str) else f for f in extent) for extent in field.shape)


def _same_names(what: str, given: Iterable[str], expected: Iterable[str]) -> None:
    if different := set(given) ^ set(expected):
        raise ValueError(f"{what} missing or not known: {', '.join(sorted(different))}")


_layouts: dict[type, Layout] = {}


def layout_with(part: type) -> Layout:
    """Return the layout that a class is a part of, see `Layout.part`."""
    return _layouts[part]


narrowers: list[tuple[type, Any]] = []
"""Views that show a part of the state, and functions that make them of a view of the whole state."""


@cache
def part_of(kind: type) -> Callable[[Any], Any]:
    """Return a function that views a part of the state, in kernels too, where it keeps the number of axes.

    Args:
        kind: Annotates fields of the state or of the plan, see `Layout.part`.
    """

    def view(state: Any) -> Any:
        return layout_with(kind).read(kind, *state.addresses)

    view.__name__ = view.__qualname__ = f"view_of_{kind.__name__}"
    narrowers.append((kind, view))
    return view


viewers: list[tuple[Callable[[], tuple[Layout, type]], Any]] = []


def viewer(viewed: Callable[[], tuple[Layout, type]], function: Any) -> None:
    """Makes a Python function that reads a view known to kernels, which get theirs in its place.

    Args:
        viewed: Returns where the fields lie, and the plan's class or the state's; called by the compiler.
        function: Called with addresses and the number of axes: (plan, axes), or (plan, state, axes). Kernels
            that pass a literal number of axes know it in all shapes, so that loops over axes unroll.
    """
    viewers.append((viewed, function))
