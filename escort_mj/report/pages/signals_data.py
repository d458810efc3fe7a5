"""Signals over time as the plot inside a page reads them: thinned so that the worst of each bin stays."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.metrics.arrival import goal_distance
from escort_mj.metrics.radius_error import radius_error
from escort_mj.metrics.reading import escorts, lost
from escort_mj.report.pages.replay_data import packed

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

MOST_NUMBERS = 250_000  # of all curves together: four bytes each
FEWEST, MOST = 150, 1500  # points of a curve
BANDS = ("least", "median", "most")
BAND_COLORS = ("#0072B2", "#1A1A1A", "#C8001E")


class Curve(NamedTuple):
    """One signal of every robot.

    Attributes:
        name: What it is called on the page.
        unit: SI unit.
        values: Of a trace, shape (T, n).
        lowest: Whether its low values are the ones to watch, not its high ones.
    """

    name: str
    unit: str
    values: Callable[[xarray.Dataset], Array]
    lowest: bool = False


def _radius_error(trace: xarray.Dataset) -> Array:
    if not escorts(trace):
        return np.full(trace["lost"].values.shape, np.nan)
    return np.abs(radius_error(trace))


def _length(name: str) -> Callable[[xarray.Dataset], Array]:
    return lambda trace: np.asarray(np.linalg.norm(trace[name].values, axis=2))


def _clearance(trace: xarray.Dataset) -> Array:
    return np.asarray(trace["clearance"].values.min(axis=2, initial=np.inf))


CURVES = (
    Curve("error of the distance to the target", "m", _radius_error),
    Curve("distance to the goal", "m", goal_distance),
    Curve("tracking error |e|", "m", _length("e")),
    Curve("speed |v|", "m/s", _length("v")),
    Curve("reference speed |v_d|", "m/s", _length("v_d")),
    Curve("force |f|", "N", _length("force")),
    Curve("clearance to whatever is nearest", "m", _clearance, lowest=True),
)


def signals_data(trace: xarray.Dataset) -> dict[str, Any]:
    """What `signals.js` draws: a curve per robot, of a crowd the least, the median and the most.

    Robots that the team has lost have no curve from then on.

    Args:
        trace: With at least one sample.
    """
    count, time = trace.sizes["robot"], trace["time"].values
    crowd = count > palette.MOST_LINES
    names = BANDS if crowd else [f"robot {k + 1}" for k in range(count)]
    colors = BAND_COLORS if crowd else [to_hex(color) for color in palette.robot_colors(count)]
    points = int(np.clip(MOST_NUMBERS // (len(CURVES) * len(names)), FEWEST, MOST))
    starts = np.unique(np.linspace(0, len(time), min(points, len(time)), endpoint=False).astype(int))
    signals = []
    for curve in CURVES:
        values = np.where(lost(trace), np.nan, curve.values(trace))
        values[~np.isfinite(values)] = np.nan
        if np.isnan(values).all():
            continue
        if crowd:
            values = np.stack([np.nanmin(values, 1), np.nanmedian(values, 1), np.nanmax(values, 1)], axis=1)
        worst = (np.fmin if curve.lowest else np.fmax).reduceat(values, starts, axis=0)
        curves = [packed(column, "<f4") for column in worst.T]
        signals.append({"name": curve.name, "unit": curve.unit, "curves": curves})
    return {
        "time": packed(time[starts], "<f4"),
        "names": list(names),
        "colors": list(colors),
        "signals": signals,
    }
