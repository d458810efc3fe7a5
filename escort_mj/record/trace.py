"""The trace of a run: every recorded signal as a labelled array with its unit, in NetCDF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RunFolderError
from escort_mj.record.episodes import NONE, episode_variables
from escort_mj.record.files import replaced
from escort_mj.signals import CAUSES, SIGNALS, TRUTH, axis_names, record_size

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

WHOLE = {
    "avoidance_active": "int8",
    "lost": "int8",
    "phase": "int8",
    "ruling": "int8",
    "outer_updates": "int64",
    "clearance_body": "int32",
    "target_clearance_body": "int32",
    "contacts_untold": "int64",
}


def build_trace(
    samples: Array, sizes: Mapping[str, int], labels: Mapping[str, Any], episodes: Array = NONE
) -> xarray.Dataset:
    """Names the parts of recorded samples.

    Args:
        samples: Shape (k, record_size); no NaN.
        sizes: Size of each dimension and channel, see `signals.record_size`.
        labels: `obstacles` and `behaviors` (names), `robot_mass`, `robot_radius` and `force_limit` (n,),
            `obstacle_radius` (m,), `obstacle_outline` (m, points, p), `neighbors` (edges, 2) as robots,
            `spacing` (edges,), `bodies` and `body_groups` (names), `body_thickness` (bodies,), `groups`
            (watched groups of bodies), and `attributes` of the dataset (texts and numbers; None is left out).
        episodes: Contact episodes, shape (k, len(episodes.COLUMNS)), in any order.

    Returns:
        Dataset with dimensions time, robot (from 1), axis (x, y, z), obstacle and behavior (names),
        coordinate, edge (pairs of neighbors), body and group (names) and episode, and with the truth channel
        axis_2 and cause; every variable carries `units` and `long_name`. Distances to other robots are left
        out where there are none, and so are channels that were not recorded.

    Raises:
        ValueError: If the samples do not fit the sizes.
    """
    import xarray

    if samples.shape[1:] != (record_size(sizes),):
        raise ValueError(
            f"samples of shape {samples.shape} do not fit a record of {record_size(sizes)} values"
        )
    absent = _absent(sizes)
    variables: dict[str, Any] = {}
    time, place = np.zeros(0), 0
    for signal in SIGNALS:
        if not signal.recorded(sizes):
            continue
        size = signal.size(sizes)
        values = samples[:, place : place + size].reshape(len(samples), *(sizes[dim] for dim in signal.dims))
        place += size
        if signal.name == "time":
            time = values.copy()
            continue
        if signal.name in absent:
            continue
        kind = WHOLE.get(signal.name, "float64")
        attributes = {"units": signal.unit, "long_name": signal.meaning}
        variables[signal.name] = (("time", *signal.dims), values.astype(kind), attributes)
    variables |= episode_variables(episodes)
    variables |= {
        "robot_mass": ("robot", np.asarray(labels["robot_mass"], float), _said("kg", "mass of each robot")),
        "robot_radius": (
            "robot",
            np.asarray(labels["robot_radius"], float),
            _said("m", "radius of each robot"),
        ),
        "obstacle_radius": (
            "obstacle",
            np.asarray(labels["obstacle_radius"], float).reshape(-1),
            _said("m", "radius of each obstacle, 0 for those that are no spheres"),
        ),
        "body_thickness": (
            "body",
            np.asarray([np.inf if x is None else x for x in labels["body_thickness"]], float),
            _said("m", "least extent of each body, inf for the floor"),
        ),
        "force_limit": (
            "robot",
            np.minimum(np.asarray([np.inf if x is None else x for x in labels["force_limit"]], float), 1e300),
            _said("N", "largest force of each motor, 1e300 for no limit"),
        ),
        "neighbors": (
            ("edge", "end"),
            np.asarray(labels["neighbors"], "int32").reshape(-1, 2),
            _said("1", "robots at the two ends of each edge of the formation"),
        ),
        "spacing": (
            "edge",
            np.asarray(labels["spacing"], float).reshape(-1),
            _said("m", "distance that the robots at the ends of each edge are to keep"),
        ),
    }
    if labels.get("obstacle_outline"):
        variables["obstacle_outline"] = (
            ("obstacle", "point", "axis"),
            np.asarray(labels["obstacle_outline"], float),
            _said("m", "points around each obstacle, relative to its center"),
        )
    return xarray.Dataset(
        variables,
        coords={
            "time": ("time", time, _said("s", SIGNALS[0].meaning)),
            "robot": ("robot", np.arange(1, sizes["robot"] + 1), _said("1", "number of the robot, from 1")),
            "axis": ("axis", axis_names(sizes["axis"]), {"long_name": "axis of the world frame"}),
            "obstacle": (
                "obstacle",
                np.array(list(labels["obstacles"]), dtype=str),
                {"long_name": "name of the obstacle"},
            ),
            "body": (
                "body",
                np.array(list(labels["bodies"]), dtype=str),
                {"long_name": "name of the body"},
            ),
            "group": (
                "group",
                np.array(list(labels["groups"]), dtype=str),
                {"long_name": "group of bodies, or a single body"},
            ),
            "body_group": (
                "body",
                np.array(list(labels["body_groups"]), dtype=str),
                {"long_name": "group of the body"},
            ),
            "behavior": (
                "behavior",
                np.array(list(labels["behaviors"]), dtype=str),
                {"long_name": "name of the behavior"},
            ),
        }
        | (_truth_coordinates(sizes) if sizes.get(TRUTH) else {}),
        attrs={key: value for key, value in labels["attributes"].items() if value is not None},
    )


def _truth_coordinates(sizes: Mapping[str, int]) -> dict[str, Any]:
    """Labels of the dimensions that only the truth channel has."""
    return {
        "axis_2": ("axis_2", list("xyz")[: sizes["axis_2"]], {"long_name": "second axis of a matrix"}),
        "cause": ("cause", list(CAUSES), {"long_name": "why the Lyapunov function V1 changes"}),
    }


def _absent(sizes: Mapping[str, int]) -> set[str]:
    """Signals that say nothing in a world of these sizes; the record holds infinity there."""
    return {"robot_distance_min"} if sizes["robot"] == 1 else set()


def _said(unit: str, meaning: str) -> dict[str, str]:
    """Attributes of a variable."""
    return {"units": unit, "long_name": meaning}


def save_trace(trace: xarray.Dataset, path: Path) -> None:
    """Writes a trace as NetCDF-4, whole or not at all."""
    compressed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    encoding: dict[str, dict[str, Any]] = {
        str(name): {"_FillValue": None} | (compressed if variable.ndim and variable.size else {})
        for name, variable in trace.variables.items()
        if variable.dtype.kind in "fi"
    }
    with replaced(path) as temporary:
        trace.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)


def load_trace(path: Path) -> xarray.Dataset:
    """Reads a trace into memory.

    Raises:
        RunFolderError: If there is none, or it cannot be read.
    """
    import xarray

    try:
        return xarray.load_dataset(path, engine="h5netcdf", decode_times=False)
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no trace here; is this a run folder?") from None
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{path}: the trace cannot be read: {error}") from None
