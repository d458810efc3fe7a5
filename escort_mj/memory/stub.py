"""Writes `plan.pyi`: the fields of `Plan` and `State`, for type checkers and editors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import escort_mj.plan
from escort_mj.memory.layout import Plan, State
from escort_mj.native.fields import Declared, Extent, declared

STUB = Path(escort_mj.plan.__file__).with_suffix(".pyi")
HEADER = '''"""Fields of all components; written by `python -m escort_mj.memory.stub`."""

from escort_mj.native.fields import Array, Fields
'''


def stub() -> str:
    """Return the text of `plan.pyi`."""
    return HEADER + "".join(_lines(Plan)) + "".join(_lines(State))


def _lines(kind: type) -> Iterator[str]:
    """Yield the lines of a class."""
    yield f"\nclass {kind.__name__}(Fields):\n"
    for name, field in declared(kind).items():
        yield f"    {name}: {_type(field)}\n"


def _type(field: Declared) -> str:
    """Return how a field is typed, with an array's extents and the unit."""
    unit = f"[{field.value.unit}]" if field.value is not None else ""
    if not field.shape:
        return f"{field.kind.__name__}  # {unit}"
    return f"Array  # ({', '.join(map(_extent, field.shape))}) {unit}"


def _extent(extent: Extent) -> str:
    """Return an extent as an annotation has it."""
    return "*".join(map(str, extent))


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
