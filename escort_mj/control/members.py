"""Kernels that ask the member of a kind that a mission has: one that ships, or a plugin's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from escort_mj.components.component import reader
from escort_mj.components.dispatch import one_of
from escort_mj.components.equations import Equations
from escort_mj.native.kernels import inlined, inlined_once, reachable
from escort_mj.native.memory import part_of
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

Kernel = Callable[..., Any]


def asker(
    members: Sequence[type[Equations]], custom: Kernel, made: Callable[[Kernel], Kernel] = on_demand
) -> Kernel:
    """Return a kernel that asks a member of a kind.

    It is called with the member's place among those that ship, the address of its parameters, what it is
    asked about (a robot, a body or a question; nothing where it is asked about the team), plan and state.

    Args:
        members: Those that ship, of one kind.
        custom: Asks what plugins bring; called likewise, from the address on.
        made: Makes the kernel of each that ships.
    """
    return one_of([*(_kernel_of(member, made) for member in members), custom])


def _kernel_of(member: type[Equations], made: Callable[[Kernel], Kernel]) -> Kernel:
    """Return the kernel that asks a member that ships."""
    equations = {name: inlined_once(equation) for name, equation in member.equations().items()}
    evaluate, read, seen_in = (
        inlined(member.evaluation(inlined, equations)),
        reader(member),
        part_of(member.view),
    )

    def ask_of_team(block: int, plan: Plan, state: State) -> None:
        evaluate(read(block, 0), seen_in(state))

    def ask(block: int, number: int, plan: Plan, state: State) -> None:
        evaluate(read(block, 0), seen_in(state), number)

    def ask_for_answer(block: int, number: int, plan: Plan, state: State) -> int:
        answer: int = evaluate(read(block, 0), seen_in(state), number)
        return answer

    asked = ask_of_team if member.answers is None else ask_for_answer if member.answers else ask
    return made(reachable(asked, f"ask_{member.__name__}"))
