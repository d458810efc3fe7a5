"""Command the velocity that a trained network of a file computes from what each robot observes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, move
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.network import WIDEST, Network, evaluate_network, networks_of
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.observation import observe, observed_speed, vectors_observed
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import data_address, matrix_at, stack_memory, vector_at
from escort_mj.native.lanes import everywhere
from escort_mj.native.on_demand import on_demand
from escort_mj.native.vectors import numbers_at, set_numbers_at, where
from escort_mj.plan import Plan, State

EARLY = 1e-9  # s


class LearnedParameters(Fields):
    """The networks that robots follow, of each behavior `learned`."""

    learned_offset: Annotated[Array, "learned", Value("1", "where it begins in `networks`")]
    learned_interval: Annotated[Array, "learned", Value("s", "time between its evaluations")]
    learned_phase: Annotated[Array, "learned", Value("1", "phase that the behavior is of")]
    learned_speed: Annotated[float, Value("m/s", "that the velocities of networks are shares of")]
    learned_sight: Annotated[bool, Value("1", "whether networks are shown robots that are seen")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        found, places = setup.numbered(LearnedBehavior), networks_of(setup)[1]
        return {
            "learned_offset": [places[behavior] for _, behavior in found],
            "learned_interval": [behavior.interval for _, behavior in found],
            "learned_phase": [phase for phase, _ in found],
            "learned_speed": observed_speed(setup.max_speed),
            "learned_sight": not any(each.heard_distance for each in setup.avoidance),
        }


class LearnedState(Fields):
    """Actions of the networks."""

    learned_due: Annotated[Array, "learning", Value("s", "time of the next evaluation, of each robot")]
    learned_action: Annotated[Array, "learning", "p", Value("1", "velocity, as a share of `learned_speed`")]
    learned_next_action: Annotated[Array, "learning", "p", Value("1", "that from the next step on")]


class LearnedBehavior(Network, Behavior):
    """Move each robot at a velocity that a network computes from what the robot observes.

    The network is given the observations of an environment (docs/environments.md) and returns an action: for
    each axis a share, from -1 to 1, of `mission.max_speed` (2 m/s if not set). As in an environment, an
    answer to what a robot observes in one physics step holds from the next one on.
    """

    python_only: ClassVar[frozenset[str]] = frozenset({"network", "interval"})
    frame: ClassVar[Literal["target", "world"]] = "world"
    chases: ClassVar[bool] = True

    behavior: Literal["learned"] = "learned"
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.02
    """Time between evaluations of the network [s]; in training it is 1 / `recording.rate`."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a network of other inputs and outputs, or none."""
        axes, robots = mission.axes, mission.robots
        inputs = vectors_observed(robots, int(mission.opponents)) * axes
        against = " and opponents" * mission.opponents
        yield from self.network_misfits(inputs, axes, f"in {axes} axes with {robots} robots{against}")

    def task(self, r: Robots) -> Task:
        """Return the task of all directions, with the velocity that the network has answered."""
        velocity = where(r.there, r.plan.learned_speed * r.at(r.state.learned_action, 0), 0.0)
        return move(velocity, everywhere(1.0), everywhere(0.0))


@on_demand
def evaluate_networks(plan: Plan, state: State) -> None:
    """Apply the actions of the step before, and evaluate the networks that are due; once per step.

    Args:
        plan: Gives the networks, and which phase they are of.
        state: Gives what robots know; `learned_...` are written.
    """
    n, p = state.q.shape
    buffer, scratch = vector_at(stack_memory(), WIDEST), vector_at(stack_memory(), WIDEST)
    observed = matrix_at(data_address(buffer), vectors_observed(n, state.opponent_status.shape[0]), p)
    for b in range(plan.learned_phase.shape[0]):
        for i in range(n):
            if state.phase[i] != plan.learned_phase[b]:
                continue
            set_numbers_at(state.learned_action, i, numbers_at(state, state.learned_next_action, i))
            if state.time[0] < state.learned_due[i] - EARLY:
                continue
            state.learned_due[i] = state.time[0] + plan.learned_interval[b]
            observe(i, plan, state, plan.learned_speed, plan.learned_sight, observed)
            evaluate_network(plan.networks, int(plan.learned_offset[b]), buffer, scratch)
            for k in range(p):
                state.learned_next_action[i, k] = min(max(buffer[k], -1.0), 1.0)
