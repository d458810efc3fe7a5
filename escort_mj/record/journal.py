"""A run's samples and contacts on disk while it runs, block by block, readable after a kill at any moment."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RunFolderError, WriteError
from escort_mj.files import read_json, write_bytes, write_json
from escort_mj.monitor.signals import START
from escort_mj.record.recording import NONE
from escort_mj.signals import EPISODE as COLUMNS

Array = NDArray[np.float64]

SAMPLES, EPISODES, HEADER = "samples.f64", "episodes.f64", "header.json"
UNDER_WAY = "under_way.f64"  # episodes that have not ended, written again each time
RESERVE, RESERVED = "reserve", 32_768  # space kept free for the outcome of a run that fills the disk [bytes]


class Journal:
    """Appends samples and contact episodes as raw doubles beside a header that says what they are.

    Attributes:
        folder: Folder of the journal.
    """

    def __init__(self, folder: Path, header: dict[str, Any]) -> None:
        """Start a journal.

        Args:
            folder: Made again.
            header: `sizes` of the record's dimensions, `labels` for the trace, and whatever else helps.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        write_bytes(folder / RESERVE, bytes(RESERVED))
        write_json(folder / HEADER, header)
        # Unbuffered: what `append` was given is with the operating system when it returns, kill or no kill.
        self._file = (folder / SAMPLES).open("wb", buffering=0)
        self._episodes = (folder / EPISODES).open("wb", buffering=0)

    def append(self, block: Array, episodes: Array = NONE, under_way: Array = NONE) -> None:
        """Writes through to the operating system.

        Args:
            block: Samples, shape (k, record_size).
            episodes: Contact episodes that ended since the last call, shape (k, len(COLUMNS)).
            under_way: Those that go on, as far as they have come; they replace those of the last call.

        Raises:
            WriteError: If it cannot be written; whole samples before that stay readable.
        """
        for file, rows in ((self._file, block), (self._episodes, episodes)):
            rest = memoryview(np.ascontiguousarray(rows, dtype="<f8").tobytes())
            try:
                while rest:  # a raw write may take less than it is given
                    rest = rest[file.write(rest) :]
            except OSError as error:
                raise WriteError(file.name, error) from None
        write_bytes(self.folder / UNDER_WAY, np.ascontiguousarray(under_way, dtype="<f8").tobytes())

    def free_reserve(self) -> None:
        """Give back the space that was kept for the outcome."""
        with contextlib.suppress(OSError):
            (self.folder / RESERVE).unlink(missing_ok=True)

    def close(self) -> None:
        """Ends writing; the files stay."""
        self._file.close()
        self._episodes.close()


def read_journal(folder: Path) -> tuple[Array, Array, dict[str, Any]]:
    """Read what a journal holds, without a last row that was torn.

    Returns:
        Samples, shape (k, record_size); episodes, shape (k, len(COLUMNS)); and the header.

    Raises:
        RunFolderError: If it cannot be read.
    """
    header = read_json(folder / HEADER)
    try:
        width = int(header["record_size"])
        samples = _whole_rows(folder / SAMPLES, width)
        episodes = _whole_rows(folder / EPISODES, len(COLUMNS))
        if (folder / UNDER_WAY).is_file():
            episodes = _with_unended(episodes, _whole_rows(folder / UNDER_WAY, len(COLUMNS)))
    except (OSError, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        words = getattr(error, "strerror", None) or f"{HEADER} is damaged"
        raise RunFolderError(f"{folder}: the journal cannot be read: {words}") from None
    return samples, episodes, header


def _with_unended(ended: Array, under_way: Array) -> Array:
    """Episodes with those that had not ended, but for any that did while the process died."""
    known = {tuple(row) for row in ended[:, : START + 1]}
    return np.vstack([ended, *(row for row in under_way if tuple(row[: START + 1]) not in known)])


def _whole_rows(path: Path, width: int) -> Array:
    """The rows of a file of doubles, without a torn end."""
    values = np.fromfile(path, dtype="<f8")
    rows = len(values) // width
    return values[: rows * width].reshape(rows, width)


def journal_of(folder: Path) -> Path | None:
    """The journal that a run folder still holds, if any."""
    journal = folder / "journal"
    return journal if (journal / HEADER).is_file() and (journal / SAMPLES).is_file() else None


__all__ = ["Journal", "journal_of", "read_journal"]
