"""How wide a target could get out of the team, and how deep it is inside, over time."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from escort_mj import palette
from escort_mj.measuring import measure
from escort_mj.metrics.hull_margin import margins, over_time
from escort_mj.metrics.largest_gap import gaps
from escort_mj.monitor.signals import TARGET
from escort_mj.record.episodes import moving_as
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.curves import BOUND, draw_curves, limit_line, timeline
from escort_mj.report.figures.drawing.style import Key, legend

HEIGHT = 4.4  # inches
MOST_SAMPLES = 600
MOMENTS = {"caught": palette.CONTACT, "escaped": palette.RADIO}  # metrics that are moments, and their colors


def may_escape(trace: Recorded) -> bool:
    """Whether the target moves by forces: it is not led along its path whatever it meets."""
    return bool((moving_as(trace, "driven") & (trace["body_group"].values == TARGET)).any())


def gap(figure: Figure, trace: Recorded) -> None:
    """The largest gap between robots as the target sees them, and its depth in their convex hull."""
    every = max(1, -(-trace.sizes["time"] // MOST_SAMPLES))
    part = trace.isel(time=np.arange(0, trace.sizes["time"], every))
    time, (above, below) = part["time"].values, figure.subplots(2, 1, sharex=True)
    draw_curves(above, time, over_time(part, gaps)[:, None], [palette.TARGET])
    above.set(title="(a) Largest gap between robots, seen from the target", ylabel="angle [rad]")
    above.set_ylim(0.0, 2.0 * math.pi)
    limit_line(above, math.pi, "π: at the edge")
    below.set(title="(b) Depth of the target in the convex hull of the robots", ylabel="margin [m]")
    draw_curves(below, time, over_time(part, margins)[:, None], [palette.TARGET])
    limit_line(below, 0.0, "the edge")
    keys: list[Key] = []
    for name, color in MOMENTS.items():
        found = measure(name, trace)
        if found.value is not None and math.isfinite(found.value):
            for axes in (above, below):
                axes.axvline(found.value, color=color, linestyle=BOUND, linewidth=1.0)
            who = f" ({found.who})" if found.bodies else ""
            keys.append((f"{name}{who}", Line2D([], [], color=color, linestyle=BOUND)))
    timeline((above, below), time)
    legend(figure, keys)
