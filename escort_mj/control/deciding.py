"""What bodies with a policy want: the kernels of all policies, called for the bodies that have them."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.component import block_at, number_of
from escort_mj.components.movers import COMES, COMMANDED, NO_POLICY
from escort_mj.components.network import networks_of
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_policy
from escort_mj.control.members import asker
from escort_mj.control.opponents import aim, turn_back
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.on_demand import on_demand_in_space
from escort_mj.native.vectors import numbers_from, set_numbers
from escort_mj.plan import Plan, State
from escort_mj.policies import POLICIES
from escort_mj.policies.policy import ACTS, RESTS


class PolicyParameters(Fields):
    """Which bodies have a policy."""

    willed: Annotated[bool, Value("1", "whether some body has a policy")]
    mover_policy: Annotated[Array, "movers", Value("1", "place in POLICIES; -1 for none, -2 outside")]
    mover_place: Annotated[Array, "movers", Value("1", "where its block in `parameters` begins")]
    mover_speed: Annotated[Array, "movers", Value("m/s", "of its policy; 0 without one")]
    networks: Annotated[Array, "networks", Value("1", "of learned policies and behaviors, see `networks_of`")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        opponents = {*setup.opponent_places} if setup.opponents_outside else set()
        kinds = [
            COMMANDED if mover.obstacle in opponents
            else NO_POLICY if mover.policy is None
            else number_of(mover.policy, POLICIES)
            for mover in setup.movers
        ]  # fmt: skip
        return {
            "mover_policy": kinds,
            "mover_place": [mover.policy or 0 for mover in setup.movers],
            "mover_speed": [0.0 if mover.policy is None else mover.policy.speed for mover in setup.movers],
            "networks": networks_of(setup)[0],
            "willed": any(kind != NO_POLICY for kind in kinds),
        }


@on_demand_in_space
def decide(plan: Plan, state: State) -> None:
    """Asks each policy for the velocity that its body wants, and lets opponents that do not come turn back.

    Args:
        plan: Says which body has which policy.
        state: Gives what policies see; `mover_wish`, `policy_memory` and `mover_acts` are written.
    """
    teams = plan.team_radius.shape[0] > 0
    position = numbers_from(state, state.target_position, 0)
    velocity = numbers_from(state, state.target_velocity, 0)
    for b in range(plan.mover_policy.shape[0]):
        opponent = int(plan.mover_opponent[b])
        if opponent >= 0 and state.opponent_status[opponent] != COMES:
            state.mover_acts[b] = RESTS
            turn_back(b, plan, state)
        elif plan.mover_policy[b] == COMMANDED:
            state.mover_acts[b] = ACTS
        elif plan.mover_policy[b] != NO_POLICY:
            if teams:
                aim(b, plan, state)
            block = block_at(int(plan.mover_place[b]), plan)
            state.mover_acts[b] = _ask(int(plan.mover_policy[b]), block, b, plan, state)
    set_numbers(state.target_position, 0, position)
    set_numbers(state.target_velocity, 0, velocity)


_ask = asker(POLICIES, custom_policy, on_demand_in_space)
