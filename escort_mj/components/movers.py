"""Bodies that move by themselves: obstacles and a target with mass, driven along their trajectories.

MuJoCo gives bodies that are merely put where they should be no velocity: they would not push. These have
mass and slide along the axes, and a force drives each of them so that its velocity at the end of the step is

    v = v_d + gain (x_d - x)

as far as the force's limit allows and nothing else pushes. Bodies with a policy have no trajectory: v is what
their policy wants.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np

from escort_mj.components.mission import axis_names
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.lanes import copy_numbers
from escort_mj.native.on_demand import on_demand, on_demand_in_space
from escort_mj.native.vectors import dot, norm, numbers_at, set_numbers_at
from escort_mj.numerics.program import evaluate_program
from escort_mj.plan import Plan, State

TARGET = -1.0  # in the place of an obstacle
NO_POLICY = -1.0
WAITS, COMES, INTERCEPTED, REACHED = 0.0, 1.0, 2.0, 3.0  # status of an opponent
COMMANDED = -2.0  # in the place of a policy: what the body wants is written from outside, between steps


class MoverParameters(Fields):
    """What moves by itself, and how it is driven."""

    mover_mass: Annotated[Array, "movers", Value("kg", "of each")]
    mover_force_limit: Annotated[Array, "movers", Value("N", "largest force that drives it")]
    mover_gain: Annotated[Array, "movers", Value("1/s", "how fast it comes back to its trajectory")]
    mover_obstacle: Annotated[Array, "movers", Value("1", "which obstacle, from 0; -1 for the target")]
    mover_start: Annotated[Array, "movers", "p", Value("m", "where it begins")]
    mover_first: Annotated[Array, "movers", Value("1", "first of `policy_memory` that is its policy's")]
    mover_paths: Annotated[
        Array, "movers*p", 2, Value("1", "first instruction and their number, axis by axis")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {
            "mover_mass": [mover.mass for mover in setup.movers],
            "mover_force_limit": [mover.force_limit for mover in setup.movers],
            "mover_gain": [mover.gain for mover in setup.movers],
            "mover_obstacle": [mover.obstacle for mover in setup.movers],
            "mover_first": np.cumsum([0, *map(len, kept_by(setup))])[:-1],
            "mover_start": np.reshape([mover.path.position(0.0) for mover in setup.movers], (-1, setup.axes)),
        }


class MoverSignals(Fields):
    """What moves such bodies; recorded where there are any."""

    mover_work: Annotated[
        Array,
        "movers",
        Recorded(
            "J", "integral of |driving force . velocity| so far; for opponents, only while on their way"
        ),
    ]


class PolicySignals(Fields):
    """What policies keep; recorded where they keep something."""

    policy_memory: Annotated[
        Array, "policy_values", Recorded("1", "what policies keep of their own; units in `policy_unit`")
    ]


class MoverState(Fields):
    """Where moving bodies are, and what drives them."""

    mover_position: Annotated[Array, "movers", "p", Value("m", "of each, as MuJoCo has it")]
    mover_velocity: Annotated[Array, "movers", "p", Value("m/s", "likewise")]
    mover_force: Annotated[Array, "movers", "p", Value("N", "that drives it in the present step")]
    mover_wish: Annotated[Array, "movers", "p", Value("m/s", "what its policy, or its path, wants")]
    policy_memory_next: Annotated[Array, "policy_values", Value("1", "what becomes of `policy_memory`")]
    mover_acts: Annotated[Array, "movers", Value("1", "whether its policy acts at the moment")]


def kept_by(setup: MissionSetup) -> list[dict[str, str]]:
    """Return what the policy of each body keeps: the unit of each number, by name."""
    found = []
    for mover in setup.movers:
        own = mover.policy.memories() if mover.policy is not None else {}
        along = [f".{axis}" for axis in axis_names(setup.axes)]
        found.append(
            {
                name + axis: memory.unit
                for name, memory in own.items()
                for axis in (along if memory.vector else [""])
            }
        )
    return found


@on_demand_in_space
def drive(plan: Plan, state: State) -> None:
    """Finds what force drives moving bodies.

    Args:
        plan: Gives their drives and trajectories.
        state: Gives `time`, `mover_position`, `mover_velocity` and `mover_wish`; `mover_force` is written.
    """
    p, time = state.q.shape[1], state.time[0]
    for b in range(plan.mover_mass.shape[0]):
        for k in range(p):
            first, count = int(plan.mover_paths[b * p + k, 0]), int(plan.mover_paths[b * p + k, 1])
            wanted, _ = evaluate_program(plan.code, first, count, plan.segments, time, state.operands)
            _, speed = evaluate_program(
                plan.code, first, count, plan.segments, time + plan.timestep, state.operands
            )
            if plan.mover_policy[b] == NO_POLICY:
                state.mover_wish[b, k] = speed + plan.mover_gain[b] * (wanted - state.mover_position[b, k])
        change = numbers_at(state, state.mover_wish, b) - numbers_at(state, state.mover_velocity, b)
        force = plan.mover_mass[b] * change / plan.timestep
        most = plan.mover_force_limit[b]
        if dot(force, force) > most * most:
            force = (most / norm(force)) * force
        set_numbers_at(state.mover_force, b, force)


@on_demand
def place_movers(plan: Plan, state: State) -> None:
    """Takes over where moving bodies are.

    Args:
        plan: Says which obstacle each of them is, or the target.
        state: Gives `mover_position` and `mover_velocity`; positions and velocities of obstacles or of the
            target are written.
    """
    for b in range(plan.mover_obstacle.shape[0]):
        p, obstacle = state.q.shape[1], plan.mover_obstacle[b]
        if obstacle == TARGET:
            copy_numbers(state.mover_position[b], state.target_position, p)
            copy_numbers(state.mover_velocity[b], state.target_velocity, p)
        else:
            copy_numbers(state.mover_position[b], state.obstacle_position[int(obstacle)], p)
            copy_numbers(state.mover_velocity[b], state.obstacle_velocity[int(obstacle)], p)
