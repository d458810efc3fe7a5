"""Bodies that robots keep distances to: an inequality for each, |x| >= reach."""

from __future__ import annotations

from typing import Any

from escort_mj.behaviors.behavior import Avoidance
from escort_mj.behaviors.robots import Robots
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import Lanes, lane_numbers
from escort_mj.native.values import Computed, maker_of
from escort_mj.native.vectors import Vec, one_row


class Body(Computed):
    """A body as robots i to i + 7 find it.

    Attributes:
        x: The way from its center to each robot [m]; the gradient of |x| is x / |x|.
        covered: Part of |x| that does not count as distance [m].
        safe: Distance that is to be kept [m]; 0 where the body is not avoided.
        counts: For which robots it is one.
    """

    x: Vec
    covered: Lanes
    safe: float
    counts: Any

    @property
    def reach(self) -> Lanes:
        """Length of x below which the inequality is broken [m]."""
        return self.safe + self.covered


_body_of = maker_of(Body)


@inlined
def obstacle_body(avoid: Avoidance, j: int, r: Robots) -> Body:
    """Return obstacle j, where each robot sees it."""
    covered = avoid.to_surface * (r.robot_radius + r.obstacle_radius(j))
    body: Body = _body_of(r.q - r.obstacle(j), covered, avoid.safe_distance, r.there)
    return body


@inlined
def teammate_body(avoid: Avoidance, j: int, r: Robots) -> Body:
    """Return robot j, where it is measured; one that has failed is an obstacle (remark 2)."""
    plan, state, safe = r.plan, r.state, avoid.teammate_distance
    if plan.failure.shape[0] > 0 and state.lost[j] != 0.0:
        safe = max(safe, avoid.safe_distance)
    x = r.q - one_row(state, state.q_measured[j])
    others = r.there & (abs(lane_numbers() + float(r.i - j)) > 0.5)
    body: Body = _body_of(x, avoid.to_surface * (r.robot_radius + plan.robot_radius[j]), safe, others)
    return body
