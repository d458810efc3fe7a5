"""Results of a study in one SQLite file: a row a run, safe to kill at any moment, shared by processes."""

from __future__ import annotations

import json
import os
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Json

from escort_mj.errors import Fault, UsageError, WriteError
from escort_mj.files import MACHINE, alive, checked, identify, make_folder, remove_left
from escort_mj.metrics import METRIC_NAMES
from escort_mj.recognize import RESULTS as FILE
from escort_mj.record.folder import FIGURES, refuse_run
from escort_mj.record.outcome import Number, Verdict

FORMAT = 1
CUSTOM = "custom_metrics"  # those of plugins, by name
CUSTOM_METRICS = Json[dict[str, Number | None]] | None
FAULTS = "faults"  # of a scenario that is none
DAMAGE = (sqlite3.Error, UnicodeDecodeError)  # the latter where SQLite quotes bytes that are no text
PATIENCE = 60.0  # s, for another process's transaction
SILENCE = 300.0  # s without a sign of life, after which a claim from another machine has lapsed

RUNS = """
CREATE TABLE IF NOT EXISTS runs (
    key TEXT PRIMARY KEY, seed INTEGER NOT NULL, settings TEXT NOT NULL, outcome TEXT NOT NULL,
    message TEXT NOT NULL, passed INTEGER NOT NULL, simulated_time REAL, wall_time REAL NOT NULL,
    verdicts TEXT NOT NULL, scenario TEXT NOT NULL, versions TEXT NOT NULL, folder TEXT, ended REAL NOT NULL
) WITHOUT ROWID
"""
CLAIMS = """
CREATE TABLE IF NOT EXISTS claims (
    key TEXT PRIMARY KEY, owner TEXT NOT NULL, since REAL NOT NULL
) WITHOUT ROWID
"""


def quoted(name: str) -> str:
    """Return the name of a column as SQL takes it: some, such as `order`, are words of its own."""
    return f'"{name}"'


class Row(NamedTuple):
    """What came of one run.

    Attributes:
        key: Digest of everything that the run depends on.
        seed: Of all its randomness.
        settings: What its cell sets, by scenario key.
        outcome: How it ended.
        message: The same in words.
        passed: Whether every verdict holds, the outcome among them.
        simulated_time: How far it came [s].
        wall_time: Time that it took, everything included [s].
        verdicts: As in verdicts.json.
        scenario: The complete scenario as YAML.
        versions: Of the programs that took part.
        metrics: Value of each metric; None where there is none, infinite for "never".
        folder: Its run folder, where one was kept.
        faults: What is wrong with its scenario.
    """

    key: str
    seed: int
    settings: Json[dict[str, Any]]
    outcome: str
    message: str
    passed: bool
    simulated_time: Number
    wall_time: Number
    verdicts: Json[list[Verdict]]
    scenario: str
    versions: Json[dict[str, str]]
    metrics: dict[str, Number | None]
    folder: str | None = None
    faults: Json[list[Fault]] = []  # noqa: RUF012  rows are not changed

    @property
    def failed(self) -> list[str]:
        """Expectations that failed, the outcome among them."""
        return [one.title for one in self.verdicts if not one.passed]


class Store:
    """The results of one or more studies of a folder. Every call is a transaction of its own.

    Attributes:
        path: The file.
    """

    def __init__(self, folder: Path) -> None:
        """Open the results in a folder, or create them, and remove what killed processes left half written.

        Raises:
            UsageError: If the folder is a run's, or the file is no store of this format or cannot be written.
            WriteError: If the folder cannot be made, or the disk is full or read-only.
        """
        refuse_run(folder)
        self.path = folder / FILE
        self._owner = json.dumps(identify() | {"host": MACHINE}, sort_keys=True)
        try:
            make_folder(folder)
            for place in (folder, folder / FIGURES):
                remove_left(place)
            # Transactions are begun by hand: Python's own would begin them too late to read in them.
            self._connection = sqlite3.connect(self.path, timeout=PATIENCE, isolation_level=None)
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA synchronous = FULL")
            with self._transaction() as run:
                known = run("PRAGMA user_version").fetchone()[0]
                if known not in (0, FORMAT):
                    raise UsageError(
                        f"{self.path}: holds results of format {known}; this program reads {FORMAT}"
                    )
                run(RUNS)
                run(CLAIMS)
                have = {row[1] for row in run("PRAGMA table_info(runs)")}
                for name, kind in (
                    dict.fromkeys(METRIC_NAMES, "REAL") | {CUSTOM: "TEXT", FAULTS: "TEXT"}
                ).items():
                    if name not in have:
                        run(f"ALTER TABLE runs ADD COLUMN {quoted(name)} {kind}")
                run(f"PRAGMA user_version = {FORMAT}")
        except WriteError:
            raise
        except DAMAGE as error:
            if self._full(error):
                raise WriteError(self.path, str(error)) from None
            raise UsageError(f"{self.path}: cannot be used as a store of results: {error}") from None

    def close(self) -> None:
        """Give back what this process has claimed, and close the file."""
        try:
            with self._transaction() as run:
                run("DELETE FROM claims WHERE owner = ?", (self._owner,))
        except WriteError:
            pass  # claims lapse when their process ends
        finally:
            self._connection.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def known(self) -> set[str]:
        """Keys of all runs that have ended."""
        with self._transaction() as run:
            return {key for (key,) in run("SELECT key FROM runs")}

    def claim(self, keys: Sequence[str]) -> list[str]:
        """Claims runs for this process, and returns those that no process has made or is making.

        Claims of processes that have died lapse.
        """
        now = time.time()
        with self._transaction() as run:
            for key, owner, since in run("SELECT key, owner, since FROM claims").fetchall():
                if _lapsed(owner, since, now):
                    run("DELETE FROM claims WHERE key = ?", (key,))
            taken = []
            for key in keys:
                if run("SELECT 1 FROM runs WHERE key = ?", (key,)).fetchone():
                    continue
                if run("INSERT OR IGNORE INTO claims VALUES (?, ?, ?)", (key, self._owner, now)).rowcount:
                    taken.append(key)
            return taken

    def beat(self) -> None:
        """Shows that this process is still at its claims."""
        with self._transaction() as run:
            run("UPDATE claims SET since = ? WHERE owner = ?", (time.time(), self._owner))

    def claimed_by_others(self) -> int:
        """How many runs other live processes are making."""
        now = time.time()
        with self._transaction() as run:
            claims = run("SELECT owner, since FROM claims WHERE owner != ?", (self._owner,)).fetchall()
        return sum(not _lapsed(owner, since, now) for owner, since in claims)

    def put(self, row: Row) -> None:
        """Write a run, once and for all: a run that is there stays as it is."""
        values: dict[str, Any] = {
            **row._asdict(),
            "settings": json.dumps(row.settings),
            "verdicts": _json(row.verdicts),
            "versions": json.dumps(row.versions),
            FAULTS: _json(row.faults),
            "passed": int(row.passed),
            "ended": time.time(),
        }
        metrics = dict(values.pop("metrics"))
        values |= {name: metrics.pop(name, None) for name in METRIC_NAMES}
        values[CUSTOM] = json.dumps(metrics) if metrics else None
        names = ", ".join(map(quoted, values))
        with self._transaction() as run:
            marks = ", ".join("?" for _ in values)
            run(f"INSERT OR IGNORE INTO runs ({names}) VALUES ({marks})", tuple(values.values()))
            run("DELETE FROM claims WHERE key = ?", (row.key,))

    def forget(self, keys: Iterable[str]) -> None:
        """Drop runs, to be made again."""
        with self._transaction() as run:
            for key in keys:
                run("DELETE FROM runs WHERE key = ?", (key,))

    def get(self, keys: Iterable[str]) -> dict[str, Row]:
        """Runs by key; those that have not ended are left out."""
        columns = [name for name in Row._fields if name != "metrics"]
        query = f"SELECT {', '.join(map(quoted, [*columns, *METRIC_NAMES, CUSTOM]))} FROM runs WHERE key = ?"
        found: dict[str, Row] = {}
        with self._transaction() as run:
            for key in keys:
                record = run(query, (key,)).fetchone()
                if record is None:
                    continue
                place = f"run {str(key)[:12]}: "
                custom = checked(CUSTOM_METRICS, record[-1], self.path, place) or {}
                values = dict(zip([*columns, *METRIC_NAMES], record, strict=False))
                metrics = {name: values.pop(name) for name in METRIC_NAMES} | custom
                values |= {"metrics": metrics, FAULTS: values[FAULTS] or "[]"}
                found[key] = checked(Row, values, self.path, place)
        return found

    @contextmanager
    def _transaction(self) -> Iterator[Any]:
        """Begin, and end with all or nothing.

        Raises:
            WriteError: If the disk is full, read-only or broken; what was stored before stays.
        """
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            yield self._connection.execute
            self._connection.execute("COMMIT")
        except BaseException as error:
            if self._connection.in_transaction:  # SQLite may have rolled back by itself
                with suppress(sqlite3.Error):
                    self._connection.execute("ROLLBACK")
            if self._full(error):
                raise WriteError(self.path, f"{error}; what it held before is kept") from None
            if isinstance(error, DAMAGE):
                raise UsageError(f"{self.path}: cannot be used as a store of results: {error}") from None
            raise

    def _full(self, error: BaseException) -> bool:
        """Whether SQLite could not write to the disk, which is full, broken or read-only."""
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF
        if code in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN):
            return bool(os.statvfs(self.path.parent).f_flag & os.ST_RDONLY)
        return code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)


def _json(items: Sequence[Any]) -> str:
    """Return data classes as JSON."""
    return json.dumps([asdict(one) for one in items])


def _lapsed(written: Any, since: Any, now: float) -> bool:
    """Whether the process that made a claim is gone; a claim that cannot be read holds for none."""
    try:
        owner = json.loads(written)
    except (TypeError, ValueError):
        return True
    if not isinstance(owner, dict) or not isinstance(since, int | float):
        return True
    if owner.get("host") == MACHINE:
        return not alive(owner)
    return now - since > SILENCE


def open_store(folder: Path) -> Store:
    """Opens results that are there.

    Raises:
        UsageError: If the folder has none.
    """
    if not os.path.isfile(folder / FILE):
        raise UsageError(f"{folder}: holds no results of a study ({FILE})")
    return Store(folder)
