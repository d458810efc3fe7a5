"""A run for other programs: the suffix of the file says which."""

from __future__ import annotations

from pathlib import Path

from escort_mj.errors import UsageError
from escort_mj.files import write_model
from escort_mj.record.export import CSV, PARQUET, write_table
from escort_mj.record.folder import MODEL, StoredRun
from escort_mj.record.stored import ASSETS

MJCF, STATES = ".xml", ".npz"
SUFFIXES = (MJCF, CSV, PARQUET, STATES)


def check_export(path: Path) -> None:
    """Refuse a file that cannot be an export.

    Raises:
        UsageError: If its suffix is none of those allowed, or there is no such folder.
    """
    if path.suffix not in SUFFIXES:
        raise UsageError(f"{path}: the suffix says what to write; allowed are {', '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: there is no folder {path.parent}")


def export_run(run: StoredRun, path: Path) -> None:
    """Write a run as a table, as MuJoCo's states, or its world as MJCF.

    Args:
        run: What a run folder holds.
        path: The file.

    Raises:
        UsageError: If the suffix is none of those allowed, or what it needs is not installed.
        WriteError: If the file cannot be written.
    """
    check_export(path)
    if path.suffix == STATES:
        from escort_mj.report.exports.states import write_states

        write_states(run, path)
    elif path.suffix == MJCF:
        files = [file for file in (run.path / ASSETS).glob("*") if file.is_file()]
        assets = {f"{ASSETS}/{file.name}": file.read_bytes() for file in files}
        write_model(path, (run.path / MODEL).read_text(encoding="utf-8"), assets)
    else:
        write_table(run.trace, path)
