"""`python -m benchmarks.outer_lyapunov`: V2 of the paper (eqs. 13, 18-22, 26) in runs, for theory.md."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.document import measure_page, table
from escort_mj.api import load_scenario
from escort_mj.mission import fly
from escort_mj.numerics.formation import arrange

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

PAGE = "theory.md"
RADIUS, SAFE, GAIN, SLOPE, MARGIN = (
    5.0,
    2.0,
    0.8,
    20.0,
    0.1,
)  # R, d, Lambda2 = Lambda3, gamma, rho_i of section 5
COMMON = ["expect=[]", "recording.rate=500"]  # every physics step
QUIET = ["sensing={}", "uncertainty={}", "robots.force_limit=null"]
SHORT, PAST = "duration=40", "duration=110"  # robot 1 passes the first obstacle in the plane at 89 to 103 s
RUNS = {
    "case 1, plane, quiet": ("paper/case1_2d", [*QUIET, SHORT]),
    "case 1, plane": ("paper/case1_2d", [SHORT]),
    "case 1, space, quiet": ("paper/case1_3d", [*QUIET, SHORT]),
    "case 1, space": ("paper/case1_3d", [SHORT]),
    "case 2, plane, quiet": ("paper/case2_2d", [*QUIET, SHORT]),
    "case 2, plane": ("paper/case2_2d", [SHORT]),
    "case 2, plane, obstacles, quiet": ("paper/case2_2d_obstacles", [*QUIET, PAST]),
    "case 2, plane, obstacles": ("paper/case2_2d_obstacles", [PAST]),
    "case 2, space": ("paper/case2_3d", [SHORT]),
    "case 3, plane": ("paper/case3_2d", [SHORT]),
    "case 3, space, obstacle": ("paper/case3_3d_obstacle", ["duration=200"]),
}
CAUSES = ("own", "conflict", "neighbor", "target", "tracking", "noise")


class Tasks(NamedTuple):
    """The errors of the three tasks at true states, and the rows of their Jacobians.

    Attributes:
        errors: sigma~ of task 1 [m], of each cycle of task 2 and of task 3 [m^2], shape (tasks, time, n).
        rows: Robot by robot, shape (tasks, time, n, p); zero where task 1 is not active.
        others: Velocity of what each row leads away from: intruder, predecessor, target; same shape [m/s].
        wanted: Lambda sigma~ by the paper's gains, shape (tasks, time, n).
    """

    errors: Array
    rows: Array
    others: Array
    wanted: Array


def tasks_of(trace: xarray.Dataset) -> Tasks:
    """Return the tasks of eqs. 3 to 5 in a run, computed from positions and velocities only."""
    q, v = trace["q"].values, trace["v"].values
    c, c_dot = trace["target_position"].values[:, None], trace["target_velocity"].values[:, None]
    speed, e = np.linalg.norm(v, axis=2), np.linalg.norm(trace["q_d"].values - q, axis=2)
    errors, rows, others, wanted = [], [], [], []

    def add(error: Array, row: Array, other: Array, rate: Array) -> None:
        errors.append(error)
        rows.append(row)
        others.append(other + 0.0 * row)
        wanted.append(rate)

    depth, away, velocity = _intruder(trace)
    active = depth > 0.0
    escape = speed + (math.sqrt(2.0) - 1.0) * SLOPE * e + MARGIN * depth
    add(depth * active, away * active[:, :, None], velocity, escape * active)
    arrangement = arrange(q[0], c[0, 0], RADIUS)
    for row in arrangement.predecessors:
        x = q - q[:, row]
        error = 0.5 * (arrangement.length**2 - (x**2).sum(axis=2))
        add(error, x, v[:, row], GAIN * error)
    x = q - c
    error = 0.5 * (RADIUS**2 - (x**2).sum(axis=2))
    add(error, x, c_dot, GAIN * error)
    return Tasks(*map(np.array, (errors, rows, others, wanted)))


def _intruder(trace: xarray.Dataset) -> tuple[Array, Array, Array]:
    """Return how deep the worst intruder is in each safe sphere, the way away from it, and its velocity."""
    q, v, time = trace["q"].values, trace["v"].values, trace["time"].values
    n = q.shape[1]
    still = trace["obstacle_position"].values
    places = np.concatenate([still, q], axis=1)
    velocities = np.concatenate([0.0 * still, v], axis=1)
    ways = q[:, :, None] - places[:, None]
    apart = np.linalg.norm(ways, axis=3)
    apart[:, np.arange(n), still.shape[1] + np.arange(n)] = np.inf
    nearest = np.argmin(apart, axis=2)
    moment = np.arange(len(time))[:, None]
    distance = np.take_along_axis(apart, nearest[:, :, None], axis=2)[:, :, 0]
    away = np.take_along_axis(ways, nearest[:, :, None, None], axis=2)[:, :, 0] / distance[:, :, None]
    return SAFE - distance, away, velocities[moment, nearest]


def composed(tasks: Tasks) -> Array:
    """Return v_d by eq. 2, and by eq. 26 where task 2 has two cycles, shape (time, n, p) [m/s]."""
    escape, *chords, surface = (
        row * _over(rate, (row**2).sum(axis=2))[:, :, None]
        for row, rate in zip(tasks.rows, tasks.wanted, strict=True)
    )
    total = sum(v2 + _beside(row, surface) for v2, row in zip(chords, tasks.rows[1:-1], strict=True))
    return np.asarray(escape + _beside(tasks.rows[0], total))


def _over(value: Array, square: Array) -> Array:
    return np.divide(value, square, out=np.zeros_like(value), where=square > 0.0)


def _beside(row: Array, velocity: Array) -> Array:
    """Return the part of a velocity in the null space of a task."""
    along = _over((row * velocity).sum(axis=2), (row**2).sum(axis=2))
    return np.asarray(velocity - along[:, :, None] * row)


def rates(tasks: Tasks, trace: xarray.Dataset) -> tuple[Array, Array]:
    """Return V2 with eta_1 = 1 m^2, eta_2 = eta_3 = 1, and its rates by `CAUSES`.

    Returns:
        V2, shape (time,) [m^4], and the rates, shape (time, causes) [m^4/s].
    """
    v, v_d, printed = trace["v"].values, trace["v_d"].values, composed(tasks)

    def along(velocity: Array) -> Array:
        """The rate of V2 by eq. 18 at a velocity."""
        return -np.einsum("ktn,ktnp,ktnp->t", tasks.errors, tasks.rows, velocity + 0.0 * tasks.rows)

    shares = np.ones(len(tasks.errors))
    shares[-1] = len(shares) - 2  # eq. 26 adds the velocity of task 3 once in each cycle
    own = -np.einsum("k,ktn,ktn->t", shares, tasks.errors, tasks.wanted)
    moved = tasks.others.copy()
    led = moved.copy()
    moved[-1], led[:-1] = 0.0, 0.0
    parts = (own, along(printed) - own, -along(moved), -along(led), along(v - v_d), along(v_d - printed))
    return 0.5 * (tasks.errors**2).sum(axis=(0, 2)), np.array(parts).T


def form(tasks: Tasks) -> Array:
    """Return P of eq. 21 of each robot in the plane, by the paper's formulas, shape (time, n, 3, 3)."""
    j1, j2, j3 = tasks.rows
    pinv1, pinv2, pinv3 = (
        row * _over(np.ones(row.shape[:2]), (row**2).sum(axis=2))[:, :, None] for row in tasks.rows
    )

    def dot(a: Array, b: Array) -> Array:
        return np.asarray((a * b).sum(axis=2))

    gain = _over(tasks.wanted[0], tasks.errors[0])
    found = np.zeros((*gain.shape, 3, 3))
    found[..., 0, 0] = gain
    found[..., 1, 0] = gain * dot(j2, pinv1)
    found[..., 1, 1] = GAIN * (1.0 - dot(j2, pinv1) * dot(j1, pinv2))
    found[..., 1, 2] = GAIN * dot(j2, pinv1) * (dot(j1, pinv2) * dot(j2, pinv3) - dot(j1, pinv3))
    found[..., 2, 0] = gain * dot(j3, pinv1)
    found[..., 2, 1] = GAIN * (dot(j3, pinv2) - dot(j3, pinv1) * dot(j1, pinv2))
    cross = dot(j3, pinv1) * dot(j1, pinv2) * dot(j2, pinv3)
    found[..., 2, 2] = GAIN * (
        1.0 - dot(j3, pinv2) * dot(j2, pinv3) - dot(j3, pinv1) * dot(j1, pinv3) + cross
    )
    return found


class Conflict(NamedTuple):
    """What eqs. 19 to 22 come to in a run in the plane; shares are of all robots and samples.

    Attributes:
        cosines: Mean |cos| of the angles between tasks 2 and 3, and of 1 with 2 and with 3 while 1 is active.
        definite: Share where the symmetric part of P is positive definite: task 1 inactive, active.
        printed: Share where X'PX is below the bound that eq. 22 prints.
        halved: The same of the bound that 2 |a b| <= a^2 + b^2 does give.
        rising: Share of the samples with avoidance where X'PX is negative, so V2 rises along v_d.
        alone: Share of the samples with avoidance where the error of task 1 falls.
    """

    cosines: tuple[float, float, float]
    definite: tuple[float, float]
    printed: float
    halved: float
    rising: float
    alone: float


def conflict(trace: xarray.Dataset) -> Conflict:
    """Return what eqs. 19 to 22 come to in a run in the plane."""
    tasks = tasks_of(trace)
    p, x, active = form(tasks), np.moveaxis(tasks.errors, 0, -1), tasks.errors[0] > 0.0
    units = np.array(
        [row * _over(np.ones(row.shape[:2]), np.linalg.norm(row, axis=2))[:, :, None] for row in tasks.rows]
    )
    angles = np.abs(np.einsum("ktnp,ltnp->kltn", units, units))
    cosines = _mean(angles[1, 2]), _mean(angles[0, 1][active]), _mean(angles[0, 2][active])
    value = np.einsum("tna,tnab,tnb->tn", x, p, x)
    size, own = np.abs(p), np.einsum("tnaa->tna", p)
    crossing = size - np.einsum("tna,ab->tnab", np.abs(own), np.eye(3))
    printed = ((own - crossing.sum(axis=3)) * x**2).sum(axis=2)
    halved = ((own - 0.5 * (crossing.sum(axis=3) + crossing.sum(axis=2))) * x**2).sum(axis=2)
    below = 1e-9 * (np.abs(value) + (size.sum(axis=(2, 3)) * (x**2).sum(axis=2))) + 1e-300
    whole, lower = p + p.swapaxes(2, 3), (p + p.swapaxes(2, 3))[..., 1:, 1:]
    inner = np.linalg.eigvalsh(lower[~active])[:, 0] > 0.0
    every = np.linalg.eigvalsh(whole[active])[:, 0] > 0.0
    definite = _mean(inner), _mean(every)
    bounds = _mean(value < printed - below), _mean(value < halved - below)
    closing = (tasks.rows[0] * (trace["v"].values - tasks.others[0])).sum(axis=2) > 0.0
    return Conflict(cosines, definite, *bounds, _mean(value[active] < 0.0), _mean(closing[active]))


def _mean(values: Array | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else math.nan


def flown(words: str) -> xarray.Dataset:
    """Return the trace of one of `RUNS`, recorded at every physics step."""
    scenario, overrides = RUNS[words]
    return fly(load_scenario(scenario, [*overrides, *COMMON])).trace


def account(words: str, trace: xarray.Dataset) -> list[str]:
    """Return a row: V2 at the start, at the end, its rise, how often it falls, and its changes by cause."""
    value, every = rates(tasks_of(trace), trace)
    changes = np.trapezoid(every, trace["time"].values, axis=0)
    rise = float((value - np.minimum.accumulate(value)).max())
    rest = value[-1] - value[0] - changes.sum()
    numbers = [value[0], value[-1], rise]
    falls = f"{100 * _mean(np.diff(value) < 0.0):.0f} %"
    return [words, *map(number, numbers), falls, *map(number, [*changes, rest])]


def opposed(words: str, trace: xarray.Dataset) -> list[str]:
    """Return a row: the angles of eq. 19, the share where P of eq. 21 is definite, and where bounds fail."""
    found = conflict(trace)
    shares = (*found.definite, found.rising, found.alone, found.printed, found.halved)
    cells = [*(f"{value:.3f}" for value in found.cosines), *(f"{100 * value:.1f} %" for value in shares)]
    return [words, *("-" if "nan" in cell else cell for cell in cells)]


def number(value: float) -> str:
    """Three digits; what is rounding beside thousands is 0."""
    return f"{value:.3g}" if abs(value) > 1e-9 else "0"


def tables() -> dict[str, str]:
    """Each generated part of the document, by its name."""
    accounts, conflicts = [], []
    for words in RUNS:
        trace = flown(words)
        accounts.append(account(words, trace))
        if "plane" in words:
            conflicts.append(opposed(words, trace))
    head = ["run", "V2 at 0 s", "end", "rise", "falls", *CAUSES, "unexplained"]
    angles = ["run", "cos 2, 3", "cos 1, 2", "cos 1, 3"]
    shares = [
        "P definite, no avoidance",
        "P definite, avoidance",
        "V2 rises, avoidance",
        "task 1 falls, avoidance",
        "below eq. 22",
        "below halves",
    ]
    return {"outer": table(head, accounts), "conflict": table([*angles, *shares], conflicts)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
