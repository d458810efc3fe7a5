"""What a run recorded, as plain arrays: all that metrics and verdicts read, at no cost.

The trace, an `xarray.Dataset`, is made of it when it is asked for. The two are read alike as far
as metrics and verdicts go, so that these serve a run that ends and a trace from a file.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import axis_names
from escort_mj.errors import NotLoggedError
from escort_mj.monitor.signals import CAUSES, FIRST, SECOND, START
from escort_mj.record.outcome import LARGEST
from escort_mj.signals import (
    EPISODE,
    LIDAR,
    MEMORIES,
    MOVERS,
    POLICIES,
    READINGS,
    SIGNALS,
    TEAMS,
    TRUTH,
    WATCHES,
    record_size,
)

if TYPE_CHECKING:
    import xarray

Recorded: TypeAlias = "xarray.Dataset | Recording"
"""What metrics, verdicts and figures read."""
Part = TypeVar("Part", bound=Recorded)
Array = NDArray[np.float64]

LOG, NOT_LOGGED, GAPS = "log", "not_logged", "log_gaps"
"""Attributes of a log of real robots: its file, the names of the signals that it does not contain, and start
and end of each of its gaps [s], one after another: it lacks positions there, so there are no samples."""
NOT_SEEN, LOG_END, LOG_OF = "bodies_not_logged", "log_end", "log_of"
"""Further ones: names of the moving bodies that it does not contain, how far it goes, and how long the
scenario lasts [s]."""
NONE: Array = np.zeros((0, len(EPISODE)))
"""No episode at all."""
CONVENTIONS = "CF-1.11"  # for names of attributes and units; names of signals are the project's own


class Variable:
    """An array with the names of its dimensions; it cannot be written to.

    Attributes:
        dims: Name of each dimension.
    """

    def __init__(self, dims: str | tuple[str, ...], values: Any, attrs: Mapping[str, str]) -> None:
        self.dims = (dims,) if isinstance(dims, str) else dims
        self._array: NDArray[Any] = np.asarray(values)
        self._values = self._array.view()
        self._values.flags.writeable = False
        self._attrs = attrs

    @property
    def values(self) -> NDArray[Any]:
        """The array, read-only."""
        return self._values

    @property
    def attrs(self) -> dict[str, str]:
        """Its `units` and `long_name`."""
        return dict(self._attrs)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of the array."""
        return self._values.dtype

    def __getitem__(self, place: Any) -> Any:
        return self._values[place]

    def copy(self) -> Variable:
        """The same with memory of its own."""
        return Variable(self.dims, self._array.copy(), dict(self._attrs))

    def isel(self, dim: str, places: Any) -> Variable:
        """What is at some places of one of its dimensions."""
        before = (slice(None),) * self.dims.index(dim)
        return Variable(self.dims, self._array[(*before, places)], self._attrs)


@dataclass(frozen=True)
class Recording:
    """Named arrays of a run or of a window of it.

    Attributes:
        attrs: What is said of the run as a whole.
        coords: Labels along each dimension, by its name.
        data_vars: Everything else.
    """

    attrs: dict[str, Any] = field(repr=False)
    coords: Mapping[Hashable, Variable] = field(repr=False)
    data_vars: Mapping[Hashable, Variable] = field(repr=False)

    def __getitem__(self, name: str) -> Variable:
        if lacks(self, name):
            raise KeyError(name)
        return self.data_vars[name] if name in self.data_vars else self.coords[name]

    def __contains__(self, name: object) -> bool:
        return name in self.data_vars or name in self.coords

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Size of each dimension."""
        every = (*self.coords.values(), *self.data_vars.values())
        return {name: size for one in every for name, size in zip(one.dims, one.values.shape, strict=True)}

    def isel(self, **where: Any) -> Recording:
        """The part at some places of dimensions, given as flags or as indices; stretches are not copied."""
        coords, variables = self.coords, self.data_vars
        for dim, given in where.items():
            places = _stretch(np.asarray(given))
            coords, variables = _part(coords, dim, places), _part(variables, dim, places)
        return replace(self, coords=coords, data_vars=variables)

    def assign(self, **variables: tuple[str | tuple[str, ...], Any]) -> Recording:
        """The same with other variables in place of some, each given as its dimensions and its values."""
        changed: dict[Hashable, Variable] = {
            name: Variable(*one, self[name].attrs) for name, one in variables.items()
        }
        return replace(self, data_vars={**self.data_vars, **changed})

    def to_dataset(self) -> xarray.Dataset:
        """The same, labelled: what users get, and what files hold."""
        import xarray

        def labelled(variables: Mapping[Hashable, Variable]) -> dict[Hashable, Any]:
            return {name: (one.dims, one._array, one.attrs) for name, one in variables.items()}

        return xarray.Dataset(labelled(self.data_vars), labelled(self.coords), dict(self.attrs))


def _part(variables: Mapping[Hashable, Variable], dim: str, places: Any) -> dict[Hashable, Variable]:
    """What is at some places of a dimension, and whatever has no such dimension as it is."""
    return {name: one.isel(dim, places) if dim in one.dims else one for name, one in variables.items()}


def _stretch(places: NDArray[Any]) -> Any:
    """Flags of an unbroken stretch as a slice, so that views will do; other places as they are."""
    if places.dtype != np.bool_:
        return places
    inside = np.flatnonzero(places)
    if not len(inside):
        return slice(0, 0)
    first, last = int(inside[0]), int(inside[-1])
    return slice(first, last + 1) if last - first + 1 == len(inside) else places


def is_log(trace: Recorded) -> bool:
    """Whether a trace is a log of real robots."""
    return LOG in trace.attrs


def versions_of(attributes: Mapping[str, Any]) -> dict[str, str]:
    """Return what took part in a run, by name, from the attributes of its trace."""
    prefix = "version_"
    named = {str(key): str(value) for key, value in attributes.items()}
    return {key.removeprefix(prefix): value for key, value in named.items() if key.startswith(prefix)}


def ends_early(trace: Recorded, needed: float) -> str:
    """Return how far a log of real robots goes, in words, if not as far as needed [s]; empty of a run."""
    end = float(trace.attrs.get(LOG_END, np.inf))
    return f"the log ends at {end:g} s" if needed > end + 0.5 * float(trace.attrs["timestep"]) else ""


def not_logged(trace: Recorded) -> frozenset[str]:
    """Names of the signals that a log of real robots does not contain; its trace has NaN or 0 there."""
    return frozenset(str(trace.attrs.get(NOT_LOGGED, "")).split())


def gaps_of(trace: Recorded) -> Array:
    """Stretches of time that a log of real robots hides, shape (gaps, 2) [s]; a simulated run has none."""
    return np.reshape(np.asarray(trace.attrs.get(GAPS, ()), dtype=float), (-1, 2))


def known_time(trace: Recorded) -> Array:
    """The time of each sample, less the gaps of a log before it, shape (time,) [s]."""
    time = trace["time"].values
    hidden = [np.clip(time - start, 0.0, end - start) for start, end in gaps_of(trace)]
    return np.asarray(time - np.sum(hidden, axis=0)) if hidden else time


def lacks(trace: Recorded, name: str) -> bool:
    """Return whether a mission has no such signal.

    Raises:
        NotLoggedError: If it has, but the log of real robots does not contain it.
    """
    if name not in trace and name in not_logged(trace):
        raise NotLoggedError(name)
    return name not in trace


def require_places(trace: Recorded, bodies: NDArray[np.bool_] | None = None) -> None:
    """Raise an error if it is not known where some bodies were.

    Args:
        trace: A trace.
        bodies: Whether each body is one of them, shape (body,); None for all bodies.

    Raises:
        NotLoggedError: If a log of real robots does not contain one of them, which moved by itself.
    """
    missing = str(trace.attrs.get(NOT_SEEN, "")).split()
    if not missing:
        return
    names = [str(name) for name in trace["body"].values[slice(None) if bodies is None else bodies]]
    if found := [name for name in missing if name in names]:
        raise NotLoggedError(f"the places of {', '.join(found)}")


def sealed(trace: Recorded) -> Recording:
    """Return the same trace as plain arrays, no part of which can be changed: what metrics are shown.

    Signals that a log of real robots does not contain are left out: reading them raises `NotLoggedError`.
    """
    if not isinstance(trace, Recording):
        attributes = {str(key): value for key, value in trace.attrs.items()}
        trace = Recording(attributes, _plain(trace.coords), _plain(trace.data_vars))
    if isinstance(trace.data_vars, MappingProxyType):
        return trace
    if missing := not_logged(trace):
        known = {name: one for name, one in trace.data_vars.items() if name not in missing}
        trace = replace(trace, data_vars=known)
    attrs: Any = MappingProxyType(trace.attrs)
    return replace(
        trace,
        attrs=attrs,
        coords=MappingProxyType(trace.coords),
        data_vars=MappingProxyType(trace.data_vars),
    )


class _Copies(Mapping[Hashable, Variable]):
    """Copies of variables, each made when somebody first asks for it."""

    def __init__(self, variables: Mapping[Hashable, Variable]) -> None:
        self._names = tuple(variables)
        self._copy = cache(lambda name: variables[name].copy())

    def __getitem__(self, name: Hashable) -> Variable:
        return self._copy(name)

    def __iter__(self) -> Iterator[Hashable]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def lent(trace: Recorded) -> Recording:
    """Return the same trace, sealed, as copies: whatever a plugin does to these, nobody else sees."""
    shown = sealed(trace)
    return replace(
        shown,
        coords=MappingProxyType(_Copies(shown.coords)),
        data_vars=MappingProxyType(_Copies(shown.data_vars)),
    )


def _plain(arrays: Mapping[Hashable, xarray.DataArray]) -> Mapping[Hashable, Variable]:
    """Return arrays with their labels taken off."""
    return {name: Variable(tuple(map(str, one.dims)), one.values, {}) for name, one in arrays.items()}


def record(
    samples: Array, sizes: Mapping[str, int], labels: Mapping[str, Any], episodes: Array = NONE
) -> Recording:
    """Names the parts of recorded samples.

    Args:
        samples: Shape (k, record_size); no NaN.
        sizes: Size of each dimension and channel, see `signals.record_size`.
        labels: `obstacles` and `behaviors` (names), `robot_mass`, `robot_radius` and `force_limit` (n,),
            `obstacle_radius` (m,), `obstacle_outline` (m, points, p), `neighbors` (edges, 2) as robots,
            `spacing` (edges,), `bodies`, `body_groups`, `body_motions` and `body_shapes` (names),
            `body_thickness` (bodies,), `groups` (watched groups of bodies), and `attributes` of the run
            (texts and numbers; None is left out).
        episodes: Contact episodes, shape (k, len(episodes.COLUMNS)), in any order.

    Returns:
        Variables with dimensions time, robot (from 1), axis (x, y, z), obstacle, behavior and team (names),
        coordinate, edge (pairs of neighbors), body and group (names) and episode, and with the truth channel
        axis_2 and cause; every one carries `units` and `long_name`. Distances to other robots are left out
        where there are none, and so are channels that were not recorded.

    Raises:
        ValueError: If the samples do not fit the sizes.
    """
    if samples.shape[1:] != (record_size(sizes),):
        raise ValueError(
            f"samples of shape {samples.shape} do not fit a record of {record_size(sizes)} values"
        )
    absent = {"robot_distance_min"} if sizes["robot"] == 1 else set()  # the record holds infinity there
    variables: dict[Hashable, Variable] = {}
    place = 0
    for signal in SIGNALS:
        if not signal.recorded(sizes):
            continue
        size = signal.size(sizes)
        values = samples[:, place : place + size].reshape(len(samples), *(sizes[dim] for dim in signal.dims))
        place += size
        if signal.name not in absent:
            about = _said(signal.unit, signal.meaning)
            variables[signal.name] = Variable(
                ("time", *signal.dims), values.astype(signal.dtype, copy=False), about
            )
    time = variables.pop("time")
    for name, (dims, values, about) in episode_variables(episodes).items():
        variables[name] = Variable(dims, values, about)
    variables |= _facts(NUMBERS, labels)
    limit = variables["force_limit"]
    variables["force_limit"] = Variable("robot", np.minimum(limit.values, LARGEST), limit.attrs)
    said = {key: value for key, value in labels["attributes"].items() if value is not None}
    return Recording(
        {"Conventions": CONVENTIONS} | said, {"time": time} | _coordinates(sizes, labels), variables
    )


class Fact(NamedTuple):
    """What a trace says once: a number of each robot, body or edge, or the names along a dimension.

    Attributes:
        name: Variable name in the trace.
        label: Key of the labels that `record` takes.
        dims: Dimensions.
        unit: SI unit, `1` for none; empty for names.
        meaning: A few words.
        dtype: Of its values.
        needs: The channel that it comes with, `EXTRA` where traces may lack it; empty where all have it.
    """

    name: str
    label: str
    dims: tuple[str, ...]
    unit: str
    meaning: str
    dtype: str = "float64"
    needs: str = ""


def _number(name: str, dims: str, unit: str, meaning: str, needs: str = "", dtype: str = "float64") -> Fact:
    return Fact(name, name, tuple(dims.split()), unit, meaning, dtype, needs)


def _names(name: str, dim: str, label: str, meaning: str, needs: str = "") -> Fact:
    return Fact(name, label, (dim,), "", meaning, "str", needs)


EXTRA = "extra"
NUMBERS = (
    _number("robot_mass", "robot", "kg", "mass of each robot"),
    _number("robot_radius", "robot", "m", "radius of each robot"),
    _number("obstacle_radius", "obstacle", "m", "radius of each obstacle, 0 for those that are no spheres"),
    _number("body_thickness", "body", "m", "least extent of each body, inf for the floor"),
    _number("force_limit", "robot", "N", "largest force of each motor, 1e300 for no limit"),
    _number(
        "neighbors", "edge end", "1", "robots at the two ends of each edge of the formation", "", "int32"
    ),
    _number("spacing", "edge", "m", "distance that the robots at the ends of each edge are to keep"),
    _number("edge_radius", "edge", "m", "distance from the target at which neighbors keep `spacing`", EXTRA),
    _number(
        "edge_team", "edge", "1", "team in whose formation the robots are neighbors, from 1", EXTRA, "int32"
    ),
    _number(
        "obstacle_outline",
        "obstacle point axis",
        "m",
        "points around each obstacle, relative to its center",
        EXTRA,
    ),
    _number(
        "border_point", "border axis", "m", "a point on each line or plane that robots do not cross", EXTRA
    ),
    _number("border_normal", "border axis", "1", "vector from it to the side on which robots stay", EXTRA),
    _number("lidar_ray", "ray axis", "1", "unit vector along each ray of the robots' lidars", LIDAR),
)
"""Numbers of robots, obstacles, bodies and the formation that do not change."""
NAMES = (
    _names("obstacle", "obstacle", "obstacles", "name of the obstacle"),
    _names("body", "body", "bodies", "name of the body"),
    _names("group", "group", "groups", "group of bodies, or a single body"),
    _names("body_group", "body", "body_groups", "group of the body"),
    _names(
        "body_motion", "body", "body_motions",
        "free by its forces, driven by one, led (put where it is to be), or still", EXTRA,
    ),
    _names("behavior", "behavior", "behaviors", "name of the behavior"),
    _names("border", "border", "borders", "behavior whose line or plane it is", EXTRA),
    _names("body_shape", "body", "body_shapes", "what of the body can touch: a shape, or its geoms", EXTRA),
    _names("team", "team", "teams", "name of the team", TEAMS),
    _names("watch", "watch", "watches", "what expectations ask about every physics step", WATCHES),
    _names("memory", "memory", "memories", "component, and what it integrates of its own", MEMORIES),
    _names("memory_unit", "memory", "memory_units", "its unit", MEMORIES),
    _names(
        "memory_truth", "memory", "memory_truths", "signal that it estimates; empty for none", MEMORIES
    ),
    _names("reading", "reading", "readings", "what sensors show and keep of their own", READINGS),
    _names("reading_unit", "reading", "reading_units", "its unit", READINGS),
    _names("policy_value", "policy_value", "policy_values", "body, policy and what it keeps", POLICIES),
    _names("policy_unit", "policy_value", "policy_units", "its unit", POLICIES),
    _names("mover", "mover", "movers", "name of the body that a force drives", MOVERS),
)  # fmt: skip
"""Labels along dimensions, beside those that are numbered."""


def _facts(facts: tuple[Fact, ...], labels: Mapping[str, Any]) -> dict[Hashable, Variable]:
    """Return what labels tell of some facts, None as infinity."""
    found: dict[Hashable, Variable] = {}
    for fact in facts:
        if fact.needs and not labels.get(fact.label):
            continue
        values = np.array(list(labels[fact.label]), fact.dtype)
        if fact.dtype == "float64":
            values[np.isnan(values)] = np.inf
        if not values.size:
            values = values.reshape([2 if dim == "end" else 0 for dim in fact.dims])
        said = _said(fact.unit, fact.meaning) if fact.unit else {"long_name": fact.meaning}
        found[fact.name] = Variable(fact.dims, values, said)
    return found


def _coordinates(sizes: Mapping[str, int], labels: Mapping[str, Any]) -> dict[Hashable, Variable]:
    """Labels along the dimensions, beside time."""
    robots = np.arange(1, sizes["robot"] + 1)
    found: dict[Hashable, Variable] = {
        "robot": Variable("robot", robots, _said("1", "number of the robot, from 1")),
        "axis": Variable("axis", axis_names(sizes["axis"]), {"long_name": "axis of the world frame"}),
    }
    found |= _facts(NAMES, labels)
    if sizes.get(TRUTH):
        second = axis_names(sizes["axis_2"])
        found["axis_2"] = Variable("axis_2", second, {"long_name": "second axis of a matrix"})
        found["cause"] = Variable(
            "cause", list(CAUSES), {"long_name": "why the Lyapunov function V1 changes"}
        )
    return found


def _said(unit: str, meaning: str) -> dict[str, str]:
    """Attributes of a variable."""
    return {"units": unit, "long_name": meaning}


def episode_variables(episodes: Array) -> dict[str, Any]:
    """Variables of a trace, dimension `episode`, by time of the first touch.

    Args:
        episodes: Shape (k, len(EPISODE)), in any order.
    """
    order = np.lexsort((episodes[:, SECOND], episodes[:, FIRST], episodes[:, START]))
    return {
        column.name: (
            "episode",
            episodes[order, place].astype(column.dtype),
            {"units": column.unit, "long_name": column.meaning},
        )
        for place, column in enumerate(EPISODE)
    }
