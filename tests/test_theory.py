"""The document of the theory says what the runs say."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from benchmarks import lyapunov, outer_lyapunov
from benchmarks.document import DOCS
from benchmarks.outer_lyapunov import QUIET, composed, conflict, form, rates, tasks_of
from escort_mj.api import load_scenario
from escort_mj.mission import fly

if TYPE_CHECKING:
    import xarray


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
    assert list(part("outer")) == list(outer_lyapunov.RUNS)


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


def quiet(case: str, timestep: float, duration: float) -> xarray.Dataset:
    """A case of the paper without noise, disturbance and force limit, recorded at every physics step."""
    steps = [f"physics.timestep={timestep}", f"recording.rate={round(1 / timestep)}", f"duration={duration}"]
    return fly(load_scenario(f"paper/{case}", [*QUIET, *steps, "expect=[]"])).trace


@pytest.mark.parametrize("case", ["case1_2d", "case1_3d"])
def test_eqs_2_and_26_from_positions_are_the_recorded_velocities(compiled: None, case: str) -> None:
    """And V2 of a target at rest falls in every step, as the sum of its causes says."""
    trace = quiet(case, 0.0005, 1.0)
    tasks = tasks_of(trace)
    np.testing.assert_allclose(composed(tasks), trace["v_d"].values, rtol=0, atol=1e-12)
    value, every = rates(tasks, trace)
    assert (np.diff(value) < 0.0).all()
    rest = np.diff(value) - 0.0005 * 0.5 * (every[1:] + every[:-1]).sum(axis=1)
    assert np.abs(rest).sum() < 0.002 * (value[0] - value[-1])


def test_the_form_of_eq_21_is_the_rate_of_eq_18(compiled: None) -> None:
    """Also where avoidance is active: robots of case 1 among obstacles that stand on their way."""
    obstacles = "obstacles=[{position: [3, 6.5], radius: 0.3}, {position: [-1.5, -3.5], radius: 0.3}]"
    trace = fly(
        load_scenario("paper/case1_2d", [*QUIET, obstacles, "duration=5", "recording.rate=500", "expect=[]"])
    ).trace
    tasks = tasks_of(trace)
    assert 0.01 < (tasks.errors[0] > 0.0).mean() < 0.9
    np.testing.assert_allclose(composed(tasks), trace["v_d"].values, rtol=0, atol=1e-11)
    x = np.moveaxis(tasks.errors, 0, -1)
    value = np.einsum("tna,tnab,tnb->tn", x, form(tasks), x)
    rate = np.einsum("ktn,ktnp,tnp->tn", tasks.errors, tasks.rows, composed(tasks))
    np.testing.assert_allclose(value, rate, rtol=0, atol=1e-11 * np.abs(rate).max())
    found = conflict(trace)
    assert found.halved == 0.0 < found.printed


@pytest.mark.slow
@pytest.mark.parametrize("case", ["case1_2d", "case1_3d"])
def test_what_is_unexplained_of_v2_halves_with_the_timestep(compiled: None, case: str) -> None:
    left = []
    for timestep in (0.002, 0.001, 0.0005):
        trace = quiet(case, timestep, 4.0)
        value, every = rates(tasks_of(trace), trace)
        left.append(value[-1] - value[0] - np.trapezoid(every.sum(axis=1), trace["time"].values))
    np.testing.assert_allclose(np.divide(left[:-1], left[1:]), 2.0, atol=0.01)


@pytest.mark.slow
def test_v2_does_what_the_document_says(compiled: None) -> None:
    accounts, conflicts = part("outer"), part("conflict")
    for words in outer_lyapunov.RUNS:
        trace = outer_lyapunov.flown(words)
        rows = [(outer_lyapunov.account(words, trace), accounts)]
        if words in conflicts:
            rows.append((outer_lyapunov.opposed(words, trace), conflicts))
        for (_, *cells), documented in rows:
            for cell, said in zip(cells, documented[words], strict=True):
                assert (cell == "-") == (said == "-"), words
                if cell != "-":
                    number, stated = (float(text.rstrip(" %")) for text in (cell, said))
                    assert number == pytest.approx(stated, rel=0.05, abs=2e-3), (words, cell, said)
