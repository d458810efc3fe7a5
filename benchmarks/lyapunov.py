"""`python -m benchmarks.lyapunov`: what V1 does on the real mass matrix, as the tables of docs/theory.md."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.document import measure_page, several, table
from escort_mj.api import load_scenario
from escort_mj.mission import Flight, fly

PAGE = "theory.md"
TIMESTEPS = (0.002, 0.001, 0.0005, 0.00025)
ROUNDING = 1e-12  # [J]
COMMON = ["expect=[]", "recording.truth=true"]
QUIET = ["sensing={}", "uncertainty={}", "robots.force_limit=null"]
SHORT = ["duration=10"]
AVOIDING = ["duration=110"]  # robot 1 passes the first obstacle
CONVERGENCE = {
    "case 1, plane, APD-SMC": ("paper/case1_2d", SHORT),
    "case 1, plane, ASMC": ("paper/case1_2d", [*SHORT, "controller=asmc"]),
    "case 1, plane, PD-SMC": ("paper/case1_2d", [*SHORT, "controller=pd_smc"]),
    "case 1, space, APD-SMC": ("paper/case1_3d", SHORT),
    "case 2, plane, obstacles, APD-SMC": ("paper/case2_2d_obstacles", AVOIDING),
}
NO_NOISE, NO_LIMIT = "sensing={}", "robots.force_limit=null"
GROWTH = {
    "case 1: no disturbance": ("paper/case1_2d", QUIET),
    "case 1: disturbance": ("paper/case1_2d", [NO_NOISE, NO_LIMIT]),
    "case 1: disturbance, 10 N limit": ("paper/case1_2d", [NO_NOISE]),
    "case 1: disturbance, 10 N limit, noise": ("paper/case1_2d", []),
    "case 1: disturbance, rolling balls": (
        "paper/case1_2d",
        [NO_NOISE, NO_LIMIT, "robots.kind=rolling_sphere"],
    ),
    "case 2, obstacles: no disturbance": ("paper/case2_2d_obstacles", QUIET),
    "case 2, obstacles: disturbance, 10 N limit, noise": ("paper/case2_2d_obstacles", []),
}


def run(scenario: str, overrides: list[str]) -> Flight:
    """One run with the truth channel."""
    return fly(load_scenario(scenario, [*overrides, *COMMON]))


def convergence() -> Iterator[list[str]]:
    """Rows: what is unexplained at each timestep, the slope in log-log of each halving, rises of V1."""
    for words, (scenario, overrides) in CONVERGENCE.items():
        left, rises, start = [], [], 0.0
        for timestep in TIMESTEPS:
            done = run(scenario, [*QUIET, *overrides, f"physics.timestep={timestep}"])
            left.append(done.metrics["lyapunov_unexplained"]["value"])
            rises.append(done.metrics["lyapunov_rise"]["value"])
            start = float(done.trace["lyapunov"][0].sum())
        slopes = np.diff(np.log(left)) / np.diff(np.log(TIMESTEPS))
        yield [words, *map(number, [start, *left]), several(slopes), several(rises)]


def number(value: float) -> str:
    """Three digits; what is rounding beside hundreds of joules is 0."""
    return f"{value:.3g}" if abs(value) > ROUNDING else "0"


def growth() -> Iterator[list[str]]:
    """Rows: V1 of the team at the end and at most after its first second, its rise, and its causes."""
    for words, (scenario, overrides) in GROWTH.items():
        done = run(scenario, overrides)
        value = done.trace["lyapunov"].sum("robot")
        later = float(value.where(value["time"] >= 1.0).max())
        change = done.trace["lyapunov_change"].sum("robot").isel(time=-1)
        numbers = [float(value[0]), later, float(value[-10:].mean()), done.metrics["lyapunov_rise"]["value"]]
        yield [words, *map(number, [*numbers, *change.values])]


def tables() -> dict[str, str]:
    """Each generated part of the document, by its name."""
    from escort_mj.monitor.signals import CAUSES

    steps = [f"{1e3 * timestep:g} ms" for timestep in TIMESTEPS]
    first = table(["run", "V1 at 0 s", *steps, "slopes", "rises"], convergence())
    head = [
        "run",
        "V1 at 0 s",
        "most after 1 s",
        "end",
        "rise",
        *(cause.replace("_", "-") for cause in CAUSES),
    ]
    return {"convergence": first, "growth": table(head, growth())}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
