"""When robots run their outer loops anew."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles
from escort_mj.control.setup import Setup
from tests.oracle.behaviors import intrusion
from tests.oracle.supervisor import Supervisor
from tests.oracle.teammates import Heard

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Holder:
    """The event trigger: which robots run the outer loop, and since when the others hold their velocity."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.since = np.full(setup.count, -np.inf)
        self.place = np.zeros((setup.count, setup.axes))
        self.phase = np.full(setup.count, -1)
        self.lost = 0

    def fires(
        self,
        t: float,
        q: Array,
        c: Array,
        w: Array,
        phase: NDArray[np.int64],
        avoided: Mask,
        supervisor: Supervisor,
        lost: Mask,
        heard: Heard | None,
    ) -> Mask:
        """Who runs the outer loop at t; w is what they hold, relative to the target, shape (n, p) [m/s]."""
        trigger = self.setup.trigger
        if trigger is None:
            return np.ones(len(q), dtype=bool)
        fired = (self.phase != phase) | avoided | lost | (lost.sum() != self.lost)
        self.lost = int(lost.sum())
        for i, number in enumerate(phase):
            stack = supervisor.stack(int(number))
            gain = next((b.convergence for b in stack if b.convergence > 0.0), np.inf)
            for behavior in stack:
                if isinstance(behavior, AvoidObstacles):
                    fired[i] |= intrusion(behavior, q, self.setup, lost, heard)[0][i] > 0.0
            bound = trigger.distance + trigger.share * float(np.linalg.norm(w[i])) / gain
            waited = t - self.since[i] + 0.5 * self.setup.timestep
            moved = float(np.linalg.norm(q[i] - c[i] - self.place[i]))
            fired[i] |= waited >= trigger.dwell and (waited >= trigger.longest or moved > bound)
        self.since[fired], self.phase[fired] = t, phase[fired]
        self.place[fired] = (q - c)[fired]
        return fired
