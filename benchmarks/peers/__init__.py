"""Other simulators on the same mission (`stage.py`), each in its own environment, in turns with our loop.

Rates are per second of wall time, of one mission unless worlds are counted, without drawing. A step is a
simulator's own, its control included; what differs stands in `modes.py`. Ours runs on one thread, peers on
what they use by default; `per_core` compares processor time instead.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.document import table
from benchmarks.peers.compare import compare
from benchmarks.peers.environments import NotInstalled, python_of
from benchmarks.peers.modes import MODES, Mode
from benchmarks.peers.remote import Failed

PYTHONS: dict[str, Path] = {}
"""Interpreters that have a peer already, by its name; else an environment is made."""


def measure() -> list[dict[str, Any]]:
    """Measures every mode of every peer that installs; what does not says why."""
    return [_row(mode, n) for mode in MODES for n in mode.sizes]


def _row(mode: Mode, n: int) -> dict[str, Any]:
    """What was found of one mode with so many robots."""
    row: dict[str, Any] = {"mode": mode.title, "n": n, "rigid": mode.rigid}
    try:
        row |= compare(mode, n, PYTHONS.get(mode.peer) or python_of(mode.peer))
        said = f"{_short(row['theirs']['robot_steps'])} robot-steps/s, ours {row['ratio']:.3g} times that"
    except (NotInstalled, Failed) as error:
        row["why"] = said = str(error)
    print(f"{mode.title}, n = {n}: {said}", flush=True)
    return row


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Rates side by side, and what differs in what is computed."""
    head = ["simulator", "n", "robot-steps/s", "escort_mj", "ratio", "per core", "simulated s/s", "escort_mj"]
    cells = [[row["mode"], str(row["n"]), *_rates(row)] for row in rows]
    return {"peers": table(head, cells), "differences": table(*_differences(rows))}


def _rates(row: dict[str, Any]) -> list[str]:
    """The numbers of a row, or why there are none."""
    if "why" in row:
        return [row["why"], *[""] * 5]
    theirs, own = row["theirs"], row["own"]
    ratio = f"{row['ratio']:.3g}"
    return [
        _short(theirs["robot_steps"]),
        _short(own["robot_steps"]),
        f"**{ratio}**" if row["rigid"] else ratio,
        f"{row['per_core']:.3g}",
        *(f"{float(format(side['pace'], '.2g')):g}" for side in (theirs, own)),
    ]


def _differences(rows: list[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Head and lines of the table that says what each peer computes."""
    cells = []
    for mode in MODES:
        found = next((row for row in rows if row["mode"] == mode.title and "why" not in row), None)
        measured = [found["version"], f"{1e3 * found['theirs']['timestep']:.3g} ms"] if found else ["", ""]
        said = [mode.dynamics, mode.contacts, mode.control, mode.precision, _ours(mode)]
        cells.append([mode.title, *measured, *said])
    head = [
        "simulator",
        "version",
        "step",
        "robots",
        "contacts",
        "control",
        "precision",
        "robots in escort_mj",
    ]
    return head, cells


def _ours(mode: Mode) -> str:
    """What of ours takes turns with it."""
    return mode.kind.replace("_", " ") + (", one mission per core" if mode.many else "")


def _short(rate: float) -> str:
    """A rate to three digits, in k or M."""
    for unit, size in (("M", 1e6), ("k", 1e3)):
        if rate >= size:
            return f"{rate / size:.3g} {unit}"
    return f"{rate:.3g}"
