"""The reference velocities of eight robots: the paper's outer loop, or one of the baselines in its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from escort_mj.components.component import OUTSIDE, block_at, number_of, reader
from escort_mj.components.dispatch import one_of
from escort_mj.components.setup import MissionSetup
from escort_mj.control.nsb import compose, ruled, stacked
from escort_mj.control.outer_loops import OUTER_LOOPS, OuterLoop
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, reachable
from escort_mj.native.lanes import any_of, everywhere, load, store
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import rows_at, set_rows, where
from escort_mj.plan import Plan, State


class OuterLoopParameters(Fields):
    """Which outer loop a mission has."""

    outer: Annotated[int, Value("1", "place in OUTER_LOOPS; OUTSIDE for none")]
    outer_place: Annotated[int, Value("1", "where its block in `parameters` begins")]
    outer_composes: Annotated[bool, Value("1", "whether behaviors are composed by priority first")]
    outer_avoids: Annotated[bool, Value("1", "whether it leaves out those that keep distances to bodies")]
    outer_meets: Annotated[bool, Value("1", "whether the velocities of teammates matter to it")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {
            "outer": number_of(setup.outer, OUTER_LOOPS) if setup.led else OUTSIDE,
            "outer_place": setup.outer,
            "outer_composes": setup.outer.composes,
            "outer_avoids": setup.outer.avoids,
            "outer_meets": setup.outer.meets,
        }


class ResidualState(Fields):
    """What is commanded from outside beside the behaviors."""

    residual: Annotated[Array, "corrected", "p", Value("m/s", "added to what they lead to")]


@inlined
def reference_velocities(i: int, plan: Plan, state: State, moved: bool) -> None:
    """Computes the reference velocities of those robots that run their outer loop now.

    Args:
        i: First robot, from 0: i to i + 7, as far as there are so many.
        plan: What the controller knows.
        state: Its state; `v_d`, `avoidance_active` and `outer_updates` are written.
        moved: Whether this is the first evaluation at the present time.
    """
    for phase in range(plan.phase_first.shape[0]):
        if not any_of(stacked(i, phase, plan, state)):
            continue
        if plan.outer != OUTSIDE:
            if plan.outer_composes and any_of(ruled(i, phase, plan, state)):
                compose(i, phase, plan, state)
                if state.residual.shape[0] > 0:
                    _add_residual(i, phase, plan, state)
            _finish(plan.outer, i, phase, plan, state)
        if moved:
            runs = ruled(i, phase, plan, state) & (load(state.lost, i) < 0.5)
            store(state.outer_updates, i, load(state.outer_updates, i) + where(runs, 1.0, everywhere(0.0)))


@inlined
def _add_residual(i: int, phase: int, plan: Plan, state: State) -> None:
    """Add what is commanded to the velocities of those robots that have just got theirs."""
    mine = ruled(i, phase, plan, state) & (load(state.lost, i) < 0.5)
    wanted = rows_at(state, state.v_d, i)
    set_rows(state.v_d, i, where(mine, wanted + rows_at(state, state.residual, i), wanted))


@inlined
def _nothing(i: int, phase: int, plan: Plan, state: State) -> None:
    """What an outer loop does that only composes behaviors."""


def _kernel_of(loop: type[OuterLoop]) -> Callable[..., Any]:
    """Return the kernel of what an outer loop does beyond composing behaviors by priority."""
    if "velocity_lanes" not in vars(loop):
        return _nothing
    write, read = inlined(vars(loop)["velocity_lanes"]), reader(loop)

    def finish(i: int, phase: int, plan: Plan, state: State) -> None:
        write(read(block_at(plan.outer_place, plan), 0), i, phase, plan, state)

    return on_demand_unrolled(reachable(finish, f"finish_by_{loop.own_name()}"))


_finish = one_of([_kernel_of(loop) for loop in OUTER_LOOPS])
