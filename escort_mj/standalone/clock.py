"""The law from call to call: it counts in timesteps, and makes up for those that have been missed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.setup import Outside
from escort_mj.errors import UsageError
from escort_mj.standalone.backend import Backend
from escort_mj.standalone.guard import Judgement
from escort_mj.standalone.knowledge import Knowledge

BEFORE = "before."  # in front of what is known of the last call, in a saved state


class Clock:
    """Evaluates a law at the times of calls, whatever clock they go by.

    Attributes:
        before: What was known at the last call; None before the first.
        lost: Which robots are out, shape (n,).
    """

    def __init__(self, backend: Backend, timestep: float, longest_gap: float, count: int) -> None:
        """Begin before the first call.

        Args:
            backend: Evaluates the law once.
            timestep: Of the law [s].
            longest_gap: Longest time between two calls for which missed timesteps are made up for [s].
            count: Number of robots, n.
        """
        self._backend, self._timestep, self._longest = backend, timestep, longest_gap
        self.before: Knowledge | None = None
        self._first = self._evaluated = 0.0  # times of the first call, and up to which the state has come
        self._steps = 0
        self.lost: NDArray[np.bool_] = np.zeros(count, dtype=bool)

    def evaluate(
        self,
        now: Knowledge,
        wish: tuple[Outside, NDArray[np.float64]] | None = None,
        judged: Judgement | None = None,
    ) -> None:
        """Evaluate the law for a time, and before that for the timesteps that have been missed.

        Args:
            now: What is known at that time.
            wish: What is commanded from now on: its kind, and values of shape (n, p).
            judged: Which robots are out, and which come back; None where nobody watches.

        Raises:
            UsageError: If the time steps back, or too far forward; nothing changes.
        """
        backend, before, due = self._backend, self.before, 1
        if before is None:
            self._first = now.time
        else:
            due = self._due(now.time, before.time)
            self._steps += due
        if wish is not None:
            backend.command(*wish)
        for step in range(1, due):
            assert before is not None
            backend.evaluate(now.since(before, step / due))
        self._evaluated = now.time if due else self._evaluated
        now = now._replace(time=self._evaluated)
        if judged is not None and (judged.watch.out != self.lost).any():
            if before is None:  # the law begins with all robots
                backend.evaluate(now)
            backend.regroup(now, judged.watch.out, judged.returned)
            self.lost = judged.watch.out
        backend.evaluate(now)
        self.before = now

    def _due(self, time: float, before: float) -> int:
        """Return how many timesteps the state has to move on."""
        if time < before:
            raise UsageError(
                f"time: found {time:g} s after {before:g} s; time must not step back (reset starts again)"
            )
        due = round((time - self._first) / self._timestep) - self._steps
        if due > 1 and time - before > self._longest:
            raise UsageError(
                f"time: found {time:g} s after {before:g} s; allowed are at most {self._longest:g} s between "
                "two calls (longest_gap); reset starts again"
            )
        return due

    def save(self) -> dict[str, Any]:
        """Return copies of everything that later evaluations depend on."""
        found = self._backend.save()
        found["clock"] = np.array([self._first, self._evaluated, self._steps])
        if self.before is not None:
            known = self.before._asdict().items()
            found |= {BEFORE + name: np.array(value) for name, value in known if value is not None}
        return found

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue from what `save` returned."""
        self._backend.load(state)
        first, evaluated, steps = (float(each) for each in state["clock"])
        self._first, self._evaluated, self._steps = first, evaluated, round(steps)
        kept = {name: np.array(state[BEFORE + name]) for name in Knowledge._fields if BEFORE + name in state}
        self.before = Knowledge(**kept | {"time": float(kept["time"])}) if kept else None  # type: ignore[arg-type]
