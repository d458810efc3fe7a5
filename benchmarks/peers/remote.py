"""A flight in another environment: its adapter as a child process that waits between rounds."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from threading import Timer
from types import TracebackType
from typing import Any

PATIENCE = 240.0  # for one answer [s]


class Failed(Exception):  # noqa: N818
    """An adapter that ended, or that took too long."""


class Remote:
    """An adapter under way; a context manager that ends it.

    Attributes:
        timestep: Simulated time of one of its steps [s].
        robots: Robots advanced by a step.
        version: Of the simulator.
        chunk: Steps in its smallest call.
        error: How far its robots were from where they should be after the last round, on average [m].
    """

    def __init__(self, python: Path, adapter: Path, mode: str, n: int) -> None:
        """Starts the mission of n robots, and waits until it is ready.

        Args:
            python: The interpreter of the peer's environment.
            adapter: The script that flies the mission there.
            mode: As the adapter calls it.
            n: Number of robots.
        """
        self._complaints = tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen(
            [str(python), str(adapter), mode, str(n)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            text=True,
            bufsize=1,
        )
        self.error = float("nan")
        try:
            facts = self._answer()
        except Failed:
            self._end()
            raise
        self.timestep, self.robots = float(facts["timestep"]), int(facts["robots"])
        self.version, self.chunk = str(facts["version"]), int(facts["chunk"])

    def timed(self, count: int) -> tuple[float, float]:
        """Wall time, and processor time of all its threads, of so many of its steps [s]."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{count}\n")
        self._process.stdin.flush()
        answer = self._answer()
        self.error = float(answer["error"])
        wall, core = answer["times"]
        return float(wall), float(core)

    def _answer(self) -> dict[str, Any]:
        """Its next line of JSON; whatever its libraries print before is skipped.

        Raises:
            Failed: If it ends first, with its last words, or if none comes in time.
        """
        assert self._process.stdout is not None
        watchdog = Timer(PATIENCE, self._process.terminate)
        watchdog.start()
        line = next((line for line in self._process.stdout if line.startswith("{")), "")
        late = not watchdog.is_alive()
        watchdog.cancel()
        if not line:
            self._complaints.seek(0)
            words = self._complaints.read().split("\n")
            said = next((line.strip() for line in reversed(words) if line.strip()), "nothing")
            raise Failed(f"no answer in {PATIENCE:.0f} s" if late else f"ended; last it said: {said}")
        return dict(json.loads(line))

    def _end(self) -> None:
        self._process.kill()
        self._process.wait()
        for file in (self._process.stdin, self._process.stdout, self._complaints):
            assert file is not None
            file.close()

    def __enter__(self) -> Remote:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()
