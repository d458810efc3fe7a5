"""What is asked of an outer loop."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.conformance.missions import AXES, mission_with
from escort_mj.conformance.stand import CheckResult, trying
from escort_mj.control.outer_loops import OuterLoop
from escort_mj.mission.batch import fly_many
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]

STEPS = 20  # that both forms take
EQUAL = 1e-11  # relative difference after one step: rounding times the stiffness of quadratic programs, 1e4
ROUNDING = 1e-12  # by which a speed may be above the limit
MOST_SPEED = 0.8  # m/s: less than robots want at the start
EDGE = 3.0  # m along the first axis, less than the mission's radius


def check_outer_loop(member: type[OuterLoop], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check an outer loop: in missions in plane and space.

    Args:
        member: The outer loop.
        kind: The type of scenarios that knows it.
    """
    yield _forms_agree(member, kind)
    yield _keeps_the_limit(member, kind)
    yield _keeps_inequalities(member, kind)


def _forms_agree(member: type[OuterLoop], kind: type[Scenario]) -> CheckResult:
    """Machine code and Python step from the same states to the same velocities."""
    apart = 0.0
    for axes in AXES:
        trying(member, f"as Python in {axes} axes")
        plant = Plant(build(mission_with(member, kind, axes)))
        for _ in range(STEPS):
            before, found = plant.mark(), []
            for interpret in (True, False):
                plant.back_to(before)
                with native_loop(plant.world, interpret=interpret):
                    plant.step(1)
                found.append(plant.state.v_d.copy())
            apart = max(apart, float(np.abs(found[0] - found[1]).max() / max(1.0, np.abs(found[1]).max())))
    return CheckResult("forms agree", apart <= EQUAL, f"compiled and Python: relative difference {apart:.1g}")


def _keeps_the_limit(member: type[OuterLoop], kind: type[Scenario]) -> CheckResult:
    """No reference velocity is above the speed limit, which binds."""
    fastest = 0.0
    for axes in AXES:
        scenario = mission_with(member, kind, axes).replace({"mission.max_speed": MOST_SPEED})
        fastest = max(fastest, float(np.linalg.norm(_flown(scenario, "v_d"), axis=-1).max()))
    held = 0.99 * MOST_SPEED < fastest <= (1.0 + ROUNDING) * MOST_SPEED
    return CheckResult("speed limit", held, f"at most {fastest:.6g} m/s of {MOST_SPEED:g} m/s")


def _keeps_inequalities(member: type[OuterLoop], kind: type[Scenario]) -> CheckResult:
    """Robots that want to cross a line or plane stay on their side of it."""
    farthest = 0.0
    for axes in AXES:
        first = (1.0, *[0.0] * (axes - 1))
        edge = {
            "behavior": "boundary",
            "point": tuple(EDGE * x for x in first),
            "normal": tuple(-x for x in first),
        }
        starts = tuple((x, y, *[0.0] * (axes - 2)) for x in (-1.5, 1.5) for y in (-1.5, 1.5))
        change: dict[str, Any] = {"mission.behaviors": (edge, "avoid_obstacles", "surface"), "sensing": {}}
        scenario = mission_with(member, kind, axes).replace(change | {"robots": {"positions": starts}})
        farthest = max(farthest, float(_flown(scenario, "q")[..., 0].max()))
    held = 0.5 * EDGE < farthest < EDGE
    return CheckResult("inequalities", held, f"robots come {EDGE - farthest:.3g} m near a bound")


def _flown(scenario: Scenario, signal: str) -> Array:
    """Return a signal of a short mission."""
    (run,) = fly_many([scenario], 1, traces=True)
    values: Array = run.trace[signal].values
    return values
