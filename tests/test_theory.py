"""The document of the theory says what the runs say."""

import re

import numpy as np
import pytest

from benchmarks import lyapunov
from benchmarks.document import DOCS


def rows(text: str) -> dict[str, list[str]]:
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()]
    return {name: cells for name, *cells in lines if name not in ("run", "---")}


def part(name: str) -> dict[str, list[str]]:
    text = (DOCS / lyapunov.PAGE).read_text(encoding="utf-8")
    found = re.search(rf"<!-- {name} -->\n(.*?)\n<!-- end -->", text, re.DOTALL)
    assert found, name
    return rows(found[1])


def test_the_document_has_every_run() -> None:
    assert list(part("convergence")) == list(lyapunov.CONVERGENCE)
    assert list(part("growth")) == list(lyapunov.GROWTH)


@pytest.mark.slow
def test_the_unexplained_shrinks_at_the_integrators_order_as_the_document_says(compiled: None) -> None:
    documented = part("convergence")
    for name, start, *others in lyapunov.convergence():
        left = np.array([float(number) for number in others[: len(lyapunov.TIMESTEPS)]])
        slopes = np.diff(np.log(left)) / np.diff(np.log(lyapunov.TIMESTEPS))
        assert (np.diff(np.abs(slopes - 1.0)) < 0.01).all(), name
        assert abs(slopes[-1] - 1.0) < 0.05, name
        said = [float(number) for number in documented[name][: 1 + len(left)]]
        np.testing.assert_allclose([float(start), *left], said, rtol=0.02, err_msg=name)
