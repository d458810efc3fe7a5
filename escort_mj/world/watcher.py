"""What expectations ask about every physics step of a run, folded from sample to sample."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.watching import Folded, fold
from escort_mj.record.recording import Recording, Variable, record
from escort_mj.record.team import of_team
from escort_mj.signals import SIGNALS
from escort_mj.world.labels import facts_of

if TYPE_CHECKING:
    from escort_mj.world.model.build import World

Array = NDArray[np.float64]
BY_NAME = {signal.name: signal for signal in SIGNALS}


class Watcher:
    """Finds what a world's expectations ask about every physics step from the steps that it keeps."""

    def __init__(self, world: World) -> None:
        bare = record(np.zeros((0, world.record_size)), world.sizes, facts_of(world.scenario, world))
        still = {name: one for name, one in bare.data_vars.items() if "time" not in one.dims}
        self._bare, self._watches = replace(bare, data_vars=still), world.mission.watches
        self._sizes = bare.sizes
        self._places: dict[str, tuple[slice, tuple[str, ...], tuple[int, ...]]] = {}
        end = 1
        for name in world.asked:
            signal = BY_NAME[name]
            start, end = end, end + signal.size(world.sizes)
            self._places[name] = slice(start, end), signal.dims, tuple(world.sizes[d] for d in signal.dims)

    def fold(self, steps: Array, starts: NDArray[np.intp]) -> Folded:
        """Fold steps into one number of each watch for each stretch of them.

        Args:
            steps: As the callbacks keep them, shape (steps, numbers).
            starts: First step of each stretch, ascending from 0.

        Returns:
            Shape (stretches, watches).
        """
        whole = self._recorded(steps)
        views = {team: of_team(whole, team) if team else whole for team in {w.team for w in self._watches}}
        values: dict[tuple[str, str], Array] = {}
        found: list[Folded] = []
        for watch in self._watches:
            key = watch.team, watch.course.name
            if key not in values:
                values[key] = watch.course.values(views[watch.team], starts)
            found.append(fold(watch, views[watch.team], starts, values[key]))
        return Folded(*np.array(found).transpose(1, 2, 0))

    def _recorded(self, steps: Array) -> Recording:
        """The steps as a metric reads them."""
        signals: dict[Hashable, Variable] = {
            name: Variable(("time", *dims), steps[:, place].reshape(len(steps), *shape), {})
            for name, (place, dims, shape) in self._places.items()
        }
        coords = {**self._bare.coords, "time": signals.pop("time")}
        whole = Recording(self._bare.attrs, coords, {**self._bare.data_vars, **signals})
        vars(whole)["sizes"] = {**self._sizes, "time": len(steps)}  # as it would find them, of all its arrays
        return whole
