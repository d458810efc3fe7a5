"""Flat memory: what Python packs, Python and kernels read back under the same names."""

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from escort_mj.native.compiler.declarations import jitted
from escort_mj.native.fields import Array
from escort_mj.native.lanes import WIDTH
from escort_mj.native.memory import Layout, viewer


class Known(NamedTuple):
    gain: float
    count: int
    flag: bool
    weights: Annotated[Array, "n", "p"]
    table: Annotated[Array, "rows", 2]
    empty: Annotated[Array, "none", "p"]


class Moving(NamedTuple):
    sums: Annotated[Array, "n"]
    squares: Annotated[Array, "n", "p*p"]
    counter: Annotated[Array, 1]


LAYOUT = Layout(7.5, Known, Moving, whole=("n",))
SIZES = {"n": 3, "p": 2, "rows": 4, "none": 0}


def known(plan: int, axes: int) -> Known:
    return LAYOUT.read(Known, plan, plan)


def moving(plan: int, state: int, axes: int) -> Moving:
    return LAYOUT.read(Moving, plan, state)


viewer(lambda: (LAYOUT, Known), known)
viewer(lambda: (LAYOUT, Moving), moving)


@jitted
def work(plan, memory, axes, literal):
    if literal:
        return fill(known(plan, 2), moving(plan, memory, 2))
    return fill(known(plan, axes), moving(plan, memory, axes))


@jitted
def fill(given, state):
    n, p = given.weights.shape
    for i in range(n):
        for a in range(p):
            state.sums[i] += given.gain * given.weights[i, a]
            for b in range(p):
                state.squares[i, a * p + b] = given.weights[i, a] * given.weights[i, b]
    state.counter[0] += given.count + given.table[3, 1] + given.empty.shape[0]
    return given.flag


def values(rng: np.random.Generator) -> dict:
    return {
        "gain": 0.1,
        "count": 2**40,
        "flag": True,
        "weights": rng.normal(size=(3, 2)),
        "table": rng.normal(size=(4, 2)),
        "empty": np.zeros((0, 2)),
    }


def test_python_reads_what_was_packed() -> None:
    given = values(np.random.default_rng(0))
    plan = LAYOUT.pack(SIZES, given)
    read = known(plan.ctypes.data, 2)
    assert plan[0] == 7.5
    assert plan[1] == len(plan)
    assert (read.gain, read.count, read.flag) == (0.1, 2**40, True)
    for name in ("weights", "table", "empty"):
        np.testing.assert_array_equal(getattr(read, name), given[name])


@pytest.mark.parametrize("literal", [True, False])
def test_kernels_read_and_write_the_same(literal: bool) -> None:
    given = values(np.random.default_rng(1))
    plan = LAYOUT.pack(SIZES, given)
    memory = np.zeros(LAYOUT.state_size(plan))
    assert len(memory) == WIDTH + WIDTH * 4 + WIDTH, "room for whole lanes of rows"
    assert work(plan.ctypes.data, memory.ctypes.data, 2, literal)
    state, weights = moving(plan.ctypes.data, memory.ctypes.data, 2), given["weights"]
    np.testing.assert_allclose(state.sums, 0.1 * weights.sum(axis=1), rtol=1e-14, atol=1e-16)
    products = weights[:, :, None] * weights[:, None]
    np.testing.assert_array_equal(state.squares, products.reshape(3, 4))
    assert state.counter[0] == 2**40 + given["table"][3, 1]


def test_a_wrong_plan_is_refused() -> None:
    given = values(np.random.default_rng(2))
    with pytest.raises(ValueError, match=r"weights has the shape \(2, 2\); expected \(3, 2\)"):
        LAYOUT.pack(SIZES, given | {"weights": np.zeros((2, 2))})
    with pytest.raises(ValueError, match="fields missing or not known: gain, gian"):
        LAYOUT.pack(SIZES, {("gian" if k == "gain" else k): v for k, v in given.items()})
    with pytest.raises(ValueError, match="dimensions missing or not known: n"):
        LAYOUT.pack({k: v for k, v in SIZES.items() if k != "n"}, given)


def test_rows_of_several_arrays_may_be_written_in_whole_lanes() -> None:
    """A kernel that writes the last row in lanes writes nothing of what follows."""

    class Several(NamedTuple):
        memory: Annotated[Array, "memories", "n", "p"]
        after: Annotated[Array, 1]

    layout = Layout(8.5, Known, Several, whole=("n",))
    for memories in range(1, 5):
        for n in range(1, 12):
            sizes = SIZES | {"n": n, "memories": memories}
            places = layout.places(sizes)
            last = places["memory"][0] + (memories - 1) * 2 * n
            assert last + -(-2 * n // WIDTH) * WIDTH <= places["after"][0]
