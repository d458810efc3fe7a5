"""The figure of what the simulator knows and the law does not: mass, reference torque, Lyapunov function."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from escort_mj import palette
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.curves import (
    DASHED,
    beside_curves,
    curve_keys,
    log_scale,
    robot_curves,
    running_mean,
    running_rms,
    thin,
    timeline,
)
from escort_mj.report.figures.drawing.look import NARROW
from escort_mj.report.figures.drawing.style import Key, name_robots, narrow

PLAYS_A_PART = 1e-9  # share of the largest cause; a smaller one is rounding
REFERENCE: Any = {"linewidth": 0.6, "alpha": 0.8, "zorder": 1.9}  # behind the others: noise makes it jump
LEGEND_ROOM, NARROW_ROOM = 0.35, 0.6  # above the curves of the panel of causes, as a share of their height


def truth_height(trace: Recorded, width: float) -> float:
    """Height of the figure [inches]."""
    return (3.4 if width > NARROW else 5.6) + 4.2 * ("lyapunov" in trace)


def truth(figure: Figure, trace: Recorded) -> None:
    """Bounds of the mass matrix, reference torque beside its estimate, V1, and why V1 changes."""
    columns = 1 if narrow(figure) else 2
    rows = [["mass"], ["torque"]] if columns == 1 else [["mass", "torque"]]
    heights = [1.0] * len(rows)
    if "lyapunov" in trace:
        rows += [["value"] * columns, ["causes"] * columns]
        heights += [1.0, 1.25]
    panels = figure.subplot_mosaic(cast(Any, rows), sharex=True, height_ratios=heights)
    _masses(panels["mass"], trace)
    _torques(panels["torque"], trace)
    if "lyapunov" in trace:
        title = "(c) Each robot's share of the Lyapunov function V1"
        value = trace["lyapunov"].values
        robot_curves(panels["value"], trace, value, running_mean, gray_lost=False, title=title, ylabel="J")
        log_scale(panels["value"])
        _causes(panels["causes"], trace)
    timeline(panels.values(), trace["time"].values)
    for name in {*rows[0], *rows[-1]}:  # those above others are narrower
        panels[name].tick_params(labelbottom=True)
        panels[name].set_xlabel("time [s]")
    grey: dict[str, Any] = {"color": "#777777", "linewidth": 1.3}
    count = trace.sizes["robot"]
    keys: list[Key] = [
        ("largest eigenvalue, estimate", Line2D([], [], linestyle=DASHED["linestyle"], **grey)),
        ("least eigenvalue, true torque", Line2D([], [], **grey)),
    ]
    keys += curve_keys(count, "running rms (b), mean (c)")
    name_robots(figure, panels.values(), count, keys)


def _masses(axes: Axes, trace: Recorded) -> None:
    """Least and largest eigenvalue of each robot's mass matrix, and what its differences say."""
    eigenvalues = np.linalg.eigvalsh(trace["mass_matrix"].values)
    robot_curves(axes, trace, eigenvalues[..., 0], gray_lost=False)
    beside_curves(axes, trace, eigenvalues[..., -1], **DASHED)
    axes.set(title="(a) Mass matrix: eigenvalues", ylabel="kg", ylim=(0.0, 1.6 * float(eigenvalues.max())))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    skew, coriolis = (float(trace[name].values.max()) for name in ("skew_residual", "coriolis_residual"))
    words = f"Ṁ - 2C: symmetric part ≤ {skew:.1g} kg/s\nCv + g: off MuJoCo's bias by ≤ {coriolis:.1g} N"
    axes.text(0.03, 0.96, words, transform=axes.transAxes, va="top", fontsize="small")


def _torques(axes: Axes, trace: Recorded) -> None:
    """The true reference torque's size beside its estimate's."""
    true, estimate = (np.linalg.norm(trace[name].values, axis=2) for name in ("reference_torque", "rho_hat"))
    robot_curves(axes, trace, true, running_rms, gray_lost=False)
    beside_curves(axes, trace, estimate, **DASHED)
    axes.set(title="(b) Reference torque |ρ|", ylabel="N")
    log_scale(axes)


def _causes(axes: Axes, trace: Recorded) -> None:
    """How fast each cause changes the whole team's V1; those that play no part are left out."""
    time, total = trace["time"].values, trace["lyapunov_change"].values.sum(axis=1)
    axes.set(title="(d) Rate of the team's V1 by cause (absolute; in brackets: total)", ylabel="W")
    if len(time) < 2:
        return
    size = float(np.abs(total).max(initial=0.0))
    for index, (cause, color) in enumerate(zip(trace["cause"].values, palette.CAUSES, strict=True)):
        if np.abs(total[:, index]).max() <= PLAYS_A_PART * size:
            continue
        rate = np.abs(running_mean(time[1:], np.diff(total[:, index]) / np.diff(time)))
        words = f"{str(cause).replace('_', '-')} ({total[-1, index]:+.3g} J)"
        axes.plot(
            *thin(time[1:], rate), color=color, label=words, **(REFERENCE if cause == "reference" else {})
        )
    log_scale(axes)
    low, high = axes.get_ylim()
    thin_figure = narrow(cast(Figure, axes.figure))
    axes.set_ylim(low, high * (high / low) ** (NARROW_ROOM if thin_figure else LEGEND_ROOM))
    axes.legend(loc="upper right", ncols=1 if thin_figure else 3)
