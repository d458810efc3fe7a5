"""Seeds of one mission after another, as Gymnasium wants them."""

from __future__ import annotations

import numpy as np

from escort_mj.scenario.arguments import SEEDS, whole_number

MOST = 2**31  # seeds that are drawn stay below it


class Seeds:
    """The seed of each next mission: the one asked for, or else one that a generator draws.

    The generator begins again with each seed that is asked for, so that all that follows is repeated. If none
    has been, the first mission has the scenario's own seed.
    """

    def __init__(self, first: int) -> None:
        self._first: int | None = first
        self._generator = np.random.default_rng(first)

    def next(self, seed: int | None = None) -> int:
        """Return the seed of the next mission.

        Args:
            seed: The one asked for; None to go on.

        Raises:
            UsageError: If it is no whole number of at least 0.
        """
        seed = self._first if seed is None else whole_number(seed, "seed", SEEDS, 0)
        self._first = None
        if seed is None:
            return int(self._generator.integers(MOST))
        self._generator = np.random.default_rng(seed)
        return seed
