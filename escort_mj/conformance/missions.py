"""What is asked of a plugin in missions: that they complete, with the same bits whatever runs beside."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from escort_mj.behaviors.behavior import Behavior
from escort_mj.conformance.stand import CheckResult, trying
from escort_mj.conformance.trials import table_of, table_with
from escort_mj.mission import Flight
from escort_mj.mission.batch import fly_many
from escort_mj.robots import RobotKind
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensors import Sensor

AXES = (2, 3)
DURATION = 2.0  # s
TIMES = 4


def check_missions(member: type[Any], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Flies short missions, alone and in two threads.

    Args:
        member: What takes part.
        kind: The type of scenarios that knows it.
    """
    most = member.most_axes if issubclass(member, RobotKind) else max(AXES)
    scenarios = [mission_with(member, kind, axes) for axes in AXES if axes <= most]
    runs: list[Flight] = []
    for scenario in scenarios:
        trying(member, f"in a mission in {scenario.axes} axes")
        runs += fly_many([scenario], 1, traces=True)
    broken = next((run for run in runs if not run.outcome.good), None)
    words = f"{DURATION:g} s in {' and '.join(str(each.axes) for each in scenarios)} axes"
    yield CheckResult(
        "mission", broken is None, words if broken is None else f"{broken.outcome.value}: {broken.message}"
    )
    if broken is not None:
        return
    again = list(fly_many([*scenarios] * TIMES, 2, traces=True))
    same = all(_bits(run) == _bits(runs[k % len(runs)]) for k, run in enumerate(again))
    said = (
        f"{len(again)} times in two threads"
        if same
        else "a run in a thread has other bits than the same run alone"
    )
    yield CheckResult("same bits", same, said)


def mission_with(member: type[Any], kind: type[Scenario], axes: int) -> Scenario:
    """A short mission in which a member takes part: a moving target, noise, an obstacle."""
    table: dict[str, Any] = {
        "name": "check",
        "axes": axes,
        "duration": DURATION,
        "target": {"position": ("0.5*t", *["0"] * (axes - 1))},
        "obstacles": ({"position": (4.0,) + (0.5,) * (axes - 1), "radius": 0.4},),
        "sensing": {"position": {"noise": 0.01}},
    }
    own = table_of(member, axes)
    table |= table_with(member, own, axes)
    if issubclass(member, Behavior):
        table["mission"] = {"behaviors": ("avoid_obstacles", own, "surface")}
    elif issubclass(member, Sensor):
        table["robots"] = {"kind": "diff_drive" if axes == min(AXES) else "quadrotor"}
    return kind.model_validate(table)


def _bits(run: Flight) -> tuple[bytes, ...]:
    return tuple(run.trace[name].values.tobytes() for name in ("q", "v_d", "tau", "rho_hat"))
