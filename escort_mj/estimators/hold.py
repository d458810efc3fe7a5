"""The newest measurement that a robot has made or heard of, as it was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from escort_mj.estimators.estimator import Estimator
from escort_mj.knowledge.belief import Belief
from escort_mj.knowledge.sight import Look

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


class Hold(Estimator):
    """The newest measurement that a robot has made or heard of, and nothing else."""

    predicts: ClassVar[bool] = False
    needs: ClassVar[tuple[tuple[str, ...], ...]] = (("position", "velocity"),)
    has_covariance: ClassVar[bool] = False
    estimator: Literal["hold"] = "hold"

    def seen(self, belief: Belief, look: Look, time: float) -> Belief:
        """Return what is measured."""
        return Belief(np.concatenate([look.position, look.velocity]), belief.covariance, time, time)

    def heard(self, belief: Belief, said: Belief, time: float) -> Belief:
        """Return what is newer."""
        return said if said.fix > belief.fix else belief

    def see_kernel(self: Any, i: int, plan: Plan, state: State) -> None:
        """Take over what is measured, compiled."""
        p = state.q.shape[1]
        for k in range(p):
            state.belief[i, k] = state.seen_position[i, k]
            state.belief[i, p + k] = state.seen_velocity[i, k]
        state.belief_time[i] = state.belief_fix[i] = state.time[0]

    def hear_kernel(self: Any, i: int, message: int, plan: Plan, state: State) -> None:
        """Take over what is newer, compiled."""
        if state.sent_fix[message] > state.belief_fix[i]:
            for k in range(state.belief.shape[1]):
                state.belief[i, k] = state.sent_belief[message, k]
            state.belief_time[i] = state.sent_belief_time[message]
            state.belief_fix[i] = state.sent_fix[message]
