"""Logs as tables: CSV and Parquet, one row per time or one row per time and body, and our own exports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import LogError, UsageError
from escort_mj.judging.log import FORCE, POSITION, VELOCITY, Log, Track, Wanted, unsound
from escort_mj.record.tables import without_units
from escort_mj.scenario.findings import did_you_mean, listed, shortened
from escort_mj.signals import SIGNALS, Signal

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]

CSV, PARQUET = ".csv", ".parquet"
TIME, NAME = "time", "name"
UNITS = {POSITION: "m", VELOCITY: "m/s", FORCE: "N"}
LETTERS = {POSITION: "", VELOCITY: "v", FORCE: "f"}  # x, vx, fx
OWN = {"q": POSITION, "v": VELOCITY, "force": FORCE}  # columns of our own export, such as q.robot_1.x
OWN_TARGET = {"target_position": POSITION, "target_velocity": VELOCITY}
OWN_OBSTACLES = "obstacle_position"
LOGGABLE = (
    *("disturbance", "q_measured", "v_measured", "lost", "v_d", "avoidance_active", "outer_updates", "q_d"),
    *("e", "e_dot", "s", "tau", "rho_hat", "saturated_time", "effort", "work", "force_variation"),
)
"""Signals that a log can hold beside positions, velocities and forces, by the names of our own exports."""
_SIGNALS = {signal.name: signal for signal in SIGNALS}


def read_table(path: Path, wanted: Wanted) -> Log:
    """Read a log from a CSV or Parquet file.

    Args:
        path: The file.
        wanted: What to look for.

    Raises:
        UsageError: If the file cannot be read, or what reads Parquet is not installed.
        LogError: If it has no time stamps.
    """
    table = without_units(_read(path))
    columns = [*table.columns]
    if twice := sorted({column for column in columns if column and columns.count(column) > 1}):
        raise LogError(path, [f"found two columns {shortened(column)}; expected one" for column in twice])
    if TIME not in columns:
        hint = did_you_mean(TIME, columns) or f"; found {shortened(', '.join(columns))}"
        raise LogError(path, [f"there is no column time [s]{hint}"])
    if words := [*_other_units(table, [TIME], "s")]:
        raise LogError(path, words)
    return _long(path, table, wanted) if NAME in columns else _wide(path, table, wanted)


def _read(path: Path) -> pandas.DataFrame:
    import pandas

    try:
        if path.suffix == PARQUET:
            table = pandas.read_parquet(path)
            texts = [name for name, kind in table.dtypes.items() if pandas.api.types.is_string_dtype(kind)]
            return table.astype(dict.fromkeys(texts, object))  # now: their bytes may be no text
        table, head = pandas.read_csv(path), pandas.read_csv(path, header=None, nrows=1, dtype=str)
        if head.shape[1] == table.shape[1]:  # pandas gives the second of two equal columns another name
            table.columns = head.iloc[0].fillna("")
        return table
    except ImportError:
        raise UsageError(f'{path}: reading Parquet needs a package: pip install "escort-mj[logs]"') from None
    except Exception as error:  # whatever the libraries stumble over, it is the file's fault
        words = str(error).partition("\n")[0] or type(error).__name__
        raise UsageError(f"{path}: cannot be read as a table: {words}") from None


def _wide(path: Path, table: pandas.DataFrame, wanted: Wanted) -> Log:
    """One row per time: columns such as `robot_1.x`, or those of our own export."""
    called = {wanted.names.get(name, name): name for name in wanted.bodies}
    time = _numbers(table[TIME])
    places: dict[str, dict[str, dict[str, str]]] = {name: {} for name in wanted.bodies}
    signals: dict[str, dict[tuple[str, ...], str]] = {}
    ignored: list[str] = []
    unknown: dict[str, str] = {}
    twice: list[str] = []

    def put(name: str, quantity: str, axis: str) -> None:
        """Say that the column is a body's."""
        before = places[name].setdefault(quantity, {}).setdefault(axis, column)
        if before != column:
            twice.append(f"columns {before} and {column} are both of {name}; expected one")

    for column in [str(each) for each in table.columns if each != TIME]:
        first, *rest = column.split(".")
        body, _, letter = column.rpartition(".")
        quantity, axis = _quantity(letter, wanted.axes)
        if first in OWN and len(rest) == 2 and rest[0] in called:
            put(called[rest[0]], OWN[first], rest[1])
        elif first in OWN_TARGET and len(rest) == 1:
            put("target", OWN_TARGET[first], rest[0])
        elif first == OWN_OBSTACLES and len(rest) == 2:
            if rest[0] in wanted.moving:  # others are where the scenario has them
                put(rest[0], POSITION, rest[1])
        elif body in called and quantity:
            put(called[body], quantity, axis)
        elif first in LOGGABLE and len(rest) == len(_SIGNALS[first].dims):
            signals.setdefault(first, {})[tuple(rest)] = column
        elif body and quantity and "." not in body and first not in _SIGNALS:
            unknown.setdefault(body, column)
        else:
            ignored.append(column)
    faults = [f"column {column}: {_stranger(body, called, wanted)}" for body, column in unknown.items()]
    faults += twice
    tracks: dict[str, Track] = {}
    for name, quantities in places.items():
        found = {
            quantity: np.column_stack([_numbers(table[columns[axis]]) for axis in wanted.axes])
            for quantity, columns in quantities.items()
            if set(wanted.axes) <= columns.keys()
            and (quantity == POSITION or table[[*columns.values()]].notna().any(axis=None))
        }
        label = next(key for key, value in called.items() if value == name)
        faults += _unsound_columns(table, label, quantities, wanted.axes)
        if POSITION in found:
            tracks[name] = _track(name, label, time, found)
        elif name in wanted.robots and POSITION not in quantities:
            columns = ", ".join(f"{label}.{axis}" for axis in wanted.axes)
            faults.append(f"{name}: no columns {columns}" + _similar(label, table.columns, called))
    more: dict[str, tuple[Array, Array]] = {}
    stamped = np.isin(time, np.hstack([[], *(tracks[name].time for name in wanted.robots if name in tracks)]))
    for name, its in signals.items():
        faults += _other_units(table, its.values(), _SIGNALS[name].unit)
        values = _signal(_SIGNALS[name], its, table, wanted)
        if values is None or np.isnan(values).all():
            continue
        more[name] = time[stamped], values[stamped]
        if words := unsound(*more[name]):
            faults.append(f"{name} {words}")
    return Log(path, tracks, more, tuple(ignored), tuple(faults))


def _stranger(label: str, called: Mapping[str, str], wanted: Wanted) -> str:
    """What is wrong with a name that no body has in a log."""
    if label in wanted.names:
        return f"{label} is called {wanted.names[label]} in the log, as told"
    hint = did_you_mean(label, called) or f"; allowed are {listed(list(called))}"
    return f"{label} is not a robot of the scenario, its target or a moving obstacle{hint}"


def _long(path: Path, table: pandas.DataFrame, wanted: Wanted) -> Log:
    """One row per time and body: columns time, name, x, y, as robots log by themselves."""
    called = {wanted.names.get(name, name): name for name in wanted.bodies}
    faults = [
        f"column name: {_stranger(shortened(label), called, wanted)}"
        for label in dict.fromkeys(table[NAME].dropna())
        if label not in called
    ]
    places: dict[str, dict[str, str]] = {}
    ignored = []
    for column in [str(each) for each in table.columns if each not in (TIME, NAME)]:
        quantity, axis = _quantity(column, wanted.axes)
        if quantity:
            places.setdefault(quantity, {})[axis] = column
        else:
            ignored.append(column)
    if missing := [axis for axis in wanted.axes if axis not in places.get(POSITION, {})]:
        raise LogError(path, [*faults, f"there is no column {listed(missing)}"])
    faults += _unsound_columns(table, "", places, wanted.axes)
    tracks = {}
    for label, name in called.items():
        rows = table[table[NAME] == label]
        if len(rows):
            found = {
                quantity: np.column_stack([_numbers(rows[columns[axis]]) for axis in wanted.axes])
                for quantity, columns in places.items()
                if set(wanted.axes) <= columns.keys()
            }
            if quantity_missing := [key for key in (VELOCITY, FORCE) if key in found]:
                for key in quantity_missing:  # one body need not log what another does
                    if np.isnan(found[key]).all():
                        del found[key]
            tracks[name] = _track(name, label, _numbers(rows[TIME]), found)
        elif name in wanted.robots:
            faults.append(f"{name}: no row has the name {label}")
    return Log(path, tracks, {}, tuple(ignored), tuple(faults))


def _quantity(letter: str, axes: Sequence[str]) -> tuple[str, str]:
    """What a column's last part stands for, such as velocity along x of `vx`; empty for nothing."""
    for quantity, before in LETTERS.items():
        if letter.startswith(before) and letter.removeprefix(before) in axes:
            return quantity, letter.removeprefix(before)
    return "", ""


def _unsound_columns(
    table: pandas.DataFrame, label: str, quantities: dict[str, dict[str, str]], axes: Sequence[str]
) -> Iterable[str]:
    """Quantities that have columns for some axes only, or in another unit."""
    for quantity, columns in quantities.items():
        yield from _other_units(table, columns.values(), UNITS[quantity])
        if missing := [axis for axis in axes if axis not in columns]:
            names = [f"{label}{'.' if label else ''}{LETTERS[quantity]}{axis}" for axis in missing]
            there = next(iter(columns.values()))
            yield f"{label or quantity}: no column {listed(names)}, though there is {there}"


def _other_units(table: pandas.DataFrame, columns: Iterable[str], unit: str) -> Iterable[str]:
    """Columns whose heads name another unit; heads may name none."""
    for column in columns:
        if (found := table.attrs["units"].get(column, unit)) != unit:
            yield f"column {column} [{found}]: expected [{unit}]"


def _similar(label: str, columns: Iterable[object], called: Iterable[str]) -> str:
    """The body in the log that is most like one that is missing."""
    others = {str(column).rpartition(".")[0] for column in columns} - set(called)
    nearest = [other for other in others if other and f'"{label}"' in did_you_mean(other, called)]
    return did_you_mean(label, sorted(nearest))


def _track(name: str, source: str, time: Array, found: dict[str, Array]) -> Track:
    """A body's rows; those without any number for its position are no stamps of it."""
    kept = ~np.isnan(found[POSITION]).all(axis=1)
    return Track(name, source, time[kept], {quantity: values[kept] for quantity, values in found.items()})


def _signal(
    signal: Signal, columns: dict[tuple[str, ...], str], table: pandas.DataFrame, wanted: Wanted
) -> Array | None:
    """A recorded signal, shape (k, ...); None where some of its columns are missing."""
    labels = {"robot": [wanted.names.get(name, name) for name in wanted.robots], "axis": list(wanted.axes)}
    every: list[tuple[str, ...]] = [()]
    for dim in signal.dims:
        every = [(*before, label) for before in every for label in labels[dim]]
    if not set(every) <= columns.keys():
        return None
    values = np.column_stack([_numbers(table[columns[place]], flags=True) for place in every])
    return values.reshape(len(table), *(len(labels[dim]) for dim in signal.dims))


def _numbers(column: pandas.Series, flags: bool = False) -> Array:
    """A column as numbers; what is none is NaN, and flags are, unless they are 1 and 0."""
    import pandas

    if not flags and column.dtype.kind in "bO":
        column = column.mask(column.map(lambda each: isinstance(each, bool | np.bool_)))
    return np.asarray(pandas.to_numeric(column, errors="coerce"), dtype=float)
