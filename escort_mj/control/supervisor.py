"""The supervisor (paper fig. 2): which behaviors rule each robot, in which order, by time and condition."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np

from escort_mj.behaviors.robots import robots_at
from escort_mj.components.component import block_at, number_of, reader
from escort_mj.components.dispatch import one_of
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_rule
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, inlined_once
from escort_mj.native.lanes import WIDTH, everywhere, store
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.rules import RULES, Rule
from escort_mj.rules.rule import TEAM

ALWAYS = -1.0  # in place of the rule of a phase without a condition


class SupervisorParameters(Fields):
    """The phases of a mission, the first of them without a condition."""

    phase_first: Annotated[Array, "phases", Value("1", "first of its levels")]
    phase_levels: Annotated[Array, "phases", Value("1", "how many levels it has")]
    phase_after: Annotated[Array, "phases", Value("s", "not before this time")]
    phase_before: Annotated[Array, "phases", Value("s", "only before this time")]
    phase_team: Annotated[Array, "phases", Value("1", "team that it rules, from 1; 0 for all robots")]
    phase_rule: Annotated[
        Array, "phases", Value("1", "place in RULES, their number for a plugin's; -1 for no condition")
    ]
    phase_rule_place: Annotated[Array, "phases", Value("1", "where its block in `parameters` begins")]
    phase_rule_row: Annotated[Array, "phases", Value("1", "where its own memory begins")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        phases, names = setup.phases, [None, *(team.name for team in setup.teams)]
        levels = [len(stack) for stack in setup.stacks]
        rules = [ALWAYS if phase.when is None else number_of(phase.when, RULES) for phase in phases]
        return {
            "phase_first": np.cumsum([0, *levels[:-1]]),
            "phase_levels": levels,
            "phase_after": [0.0, *(phase.after for phase in phases)],
            "phase_before": [math.inf, *(phase.before or math.inf for phase in phases)],
            "phase_team": [0, *(names.index(phase.team) for phase in phases)],
            "phase_rule": [ALWAYS, *rules],
            "phase_rule_place": [0, *(phase.when or 0 for phase in phases)],
            "phase_rule_row": [0, *setup.memory_rows("rules")],
        }


class SupervisorState(Fields):
    """What is compared, and what hysteresis remembers."""

    compared: Annotated[Array, "ruled", Value("1", "what a rule compares, of each robot")]
    latched: Annotated[Array, "n", "phases", Value("1", "1 while a phase's condition holds")]


@on_demand
def supervise(plan: Plan, state: State) -> None:
    """Chooses each robot's phase: the last one whose time and condition hold; phase 0 always does.

    Args:
        plan: Gives the phases.
        state: Gives time and measured positions; `phase` and `latched` are written.
    """
    n = state.q.shape[0]
    time = state.time[0] + 0.5 * plan.timestep  # times of the scenario are met to the nearest step
    for i in range(n):
        state.phase[i] = 0.0
    for f in range(1, plan.phase_first.shape[0]):
        in_time, always = plan.phase_after[f] <= time < plan.phase_before[f], plan.phase_rule[f] == ALWAYS
        if in_time and not always:
            _compare(int(plan.phase_rule[f]), f, plan, state)
        someone = False
        for i in range(n):
            holds = in_time and _rules(i, f, plan, state) and (always or _holds(i, f, plan, state))
            state.latched[i, f] = 1.0 if holds else 0.0
            someone = someone or holds
        together = not always and _rule_of(f, plan).scope == TEAM
        for i in range(n):
            if together and someone and _rules(i, f, plan, state):
                state.latched[i, f] = 1.0
            if state.latched[i, f] != 0.0:
                state.phase[i] = float(f)


@inlined
def _rules(i: int, phase: int, plan: Plan, state: State) -> bool:
    """Whether a robot is in the team that a phase rules."""
    return plan.phase_team[phase] == 0.0 or plan.phase_team[phase] == state.member_of[i]


_read = reader(Rule)


@inlined
def _rule_of(phase: int, plan: Plan) -> Any:
    """Return those parameters of the condition of a phase that all rules have."""
    return _read(block_at(int(plan.phase_rule_place[phase]), plan), 0)


@inlined
def _holds(i: int, phase: int, plan: Plan, state: State) -> bool:
    """Whether a robot meets a phase's condition; a phase that rules is left at its release only."""
    rule = _rule_of(phase, plan)
    bound = rule.end if state.latched[i, phase] != 0.0 else rule.threshold
    return state.compared[i] < bound if rule.below < UNLIMITED else state.compared[i] > bound


def _kernel_of(rule: type[Rule]) -> Callable[..., Any]:
    """Return a kernel that writes what a rule that ships compares."""
    value, read = inlined_once(rule.value), reader(rule)

    def compare(phase: int, plan: Plan, state: State) -> None:
        parameters = read(block_at(int(plan.phase_rule_place[phase]), plan), 0)
        for i in range(0, state.q.shape[0], WIDTH):
            store(state.compared, i, everywhere(value(parameters, robots_at(i, plan, state))))

    return inlined(compare)


_compare = one_of([*map(_kernel_of, RULES), custom_rule])
