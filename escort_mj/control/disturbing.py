"""What disturbances do to robots: the kernels of all of them, called for those of the mission."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.component import block_at, number_of
from escort_mj.components.grid import grids_of
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_disturbance
from escort_mj.control.members import asker
from escort_mj.disturbances import DISTURBANCES, Disturbance
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import (
    stack_memory,
    vector_at,
)
from escort_mj.native.lanes import WIDTH, copy_numbers, load, store
from escort_mj.native.on_demand import on_demand, on_demand_unrolled
from escort_mj.numerics.gaussian import DISTURBANCE, normals
from escort_mj.plan import Plan, State

BLOCKS = 4  # of a stream, for the numbers of one disturbance
SECOND = 2**20  # blocks from these to its second numbers
EQUATED = tuple(kind for kind in DISTURBANCES if kind.force is not Disturbance.force)
"""Those of the package that are equations, not functions of time alone."""


class DisturbanceParameters(Fields):
    """Which disturbances are equations; those that depend on time alone are `followed` with the target."""

    disturbance_kind: Annotated[
        Array, "disturbances", Value("1", "place in EQUATED; their number for a plugin's")
    ]
    disturbance_place: Annotated[Array, "disturbances", Value("1", "where its block in `parameters` begins")]
    disturbance_row: Annotated[Array, "disturbances", Value("1", "where its own memory begins")]
    grid_coordinates: Annotated[Array, "grid_coordinates", Value("1, s, m", "see `grids_of`")]
    grid_velocity: Annotated[Array, "grid_points", "p", Value("m/s", "at all points of grids")]
    disturbance_draws: Annotated[Array, "disturbances", Value("1", "how many random numbers it is given")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        coordinates, velocity, _ = grids_of(setup.disturbances, setup.axes)
        return {
            "grid_coordinates": coordinates,
            "grid_velocity": velocity,
            "disturbance_kind": [number_of(each, EQUATED) for each in setup.disturbances],
            "disturbance_place": setup.disturbances,
            "disturbance_row": setup.memory_rows("disturbances"),
            "disturbance_draws": [each.draws for each in setup.disturbances],
        }


class DisturbanceState(Fields):
    """What one of them is given, and what it does."""

    disturbance_force: Annotated[Array, "pushed", "p", Value("N", "of one disturbance")]
    noise: Annotated[Array, "blown", "p", Value("1", "normal random numbers")]
    common_noise: Annotated[Array, "p", Value("1", "likewise, the same for all robots")]
    second_noise: Annotated[Array, "blown_twice", "p", Value("1", "others, for those that draw two")]
    second_common_noise: Annotated[Array, "p", Value("1", "likewise, the same for all robots")]


@on_demand_unrolled
def disturb(plan: Plan, state: State) -> None:
    """Add the forces of all disturbances that are equations to `disturbance`."""
    n, p = state.q.shape
    for d in range(plan.disturbance_kind.shape[0]):
        for number in range(int(plan.disturbance_draws[d])):
            _draw(d, number, plan, state)
        if state.component_memory.shape[0] > 0:
            state.memory_row[0] = plan.disturbance_row[d]
        block = block_at(int(plan.disturbance_place[d]), plan)
        _push(int(plan.disturbance_kind[d]), block, plan, state)
        for at in range(0, n * p, WIDTH):
            store(state.disturbance, at, load(state.disturbance, at) + load(state.disturbance_force, at))


@on_demand
def _draw(d: int, number: int, plan: Plan, state: State) -> None:
    """Draw the first or second random numbers of a disturbance for the present step.

    They are the same in any order and number.
    """
    n, p = state.q.shape
    own, common = state.noise, state.common_noise
    if number == 1:
        own, common = state.second_noise, state.second_common_noise
    drawn, step = vector_at(stack_memory(), p), int(state.step[0])
    for i in range(n + 1):  # past the last robot those that all have in common
        normals(p, plan.seed, 1 + BLOCKS * d + SECOND * number, DISTURBANCE, i, step, drawn)
        copy_numbers(drawn, own[i] if i < n else common, p)


_push = asker(EQUATED, custom_disturbance, on_demand_unrolled)
