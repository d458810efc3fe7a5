"""Fields as components declare them: in the order of the bases, each name once."""

from typing import Annotated, NamedTuple, TypeVar

import numpy as np
import pytest

from escort_mj.native.fields import Array, Declared, Fields, Recorded, Value, declared

PLACE, LENGTH = Recorded("m", "where it is"), Value("m", "how long it is")


class One(Fields):
    place: Annotated[Array, "n", "p", PLACE]
    count: Annotated[int, Value("1", "how many")]


class Other(Fields):
    length: Annotated[Array, "2*n", 3, LENGTH]


class Both(Other, One):
    pass


def test_a_composed_class_has_the_fields_of_its_bases_in_their_order() -> None:
    assert declared(Both) == {
        "length": Declared(np.ndarray, ((2, "n"), (3,)), LENGTH),
        "place": Declared(np.ndarray, (("n",), ("p",)), PLACE),
        "count": Declared(int, (), Value("1", "how many")),
    }


def test_an_instance_has_the_values() -> None:
    assert Both(length=1, place=2, count=3).count == 3


def test_a_tuple_declares_fields_without_units() -> None:
    class Part(NamedTuple):
        length: Annotated[Array, "2*n", 3]
        flag: bool

    assert declared(Part) == {
        "length": Declared(np.ndarray, ((2, "n"), (3,)), None),
        "flag": Declared(bool, (), None),
    }


def test_a_name_is_declared_once() -> None:
    class Again(Fields):
        length: Annotated[float, LENGTH]

    class Twice(Both, Again):  # type: ignore[misc]
        pass

    with pytest.raises(TypeError, match=r"Again\.length: Twice has a field of that name already"):
        declared(Twice)


def test_an_array_is_one_whatever_numpy_calls_its_type() -> None:
    """From NumPy 2.5 on `NDArray` is an alias that is no generic type of `ndarray`."""
    alias = TypeVar("alias")
    kind = type(
        "Own", (Fields,), {"__annotations__": {"place": Annotated[alias, "n", Value("m", "a place")]}}
    )
    assert declared(kind)["place"].kind is np.ndarray
