"""Scatter on chords (paper eq. 4): each robot keeps the formation's edge length to its predecessors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, both, keep_distance
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.numerics.formation import chords_exist


class ChordParameters(Fields):
    """The formation of all robots; no cycles where no behavior asks for them."""

    predecessors: Annotated[Array, "cycles", "n", Value("1", "robot before each in a cycle, from 0")]
    chord_length: Annotated[float, Value("m", "distance to keep from it")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        arrangement = setup.arrangement
        return {
            "predecessors": arrangement.predecessors if arrangement else np.zeros((0, setup.count)),
            "chord_length": arrangement.length if arrangement else 0.0,
        }


class ChordState(Fields):
    """The formation of the robots that are left."""

    predecessors: Annotated[Array, "cycles", "n", Value("1", "past lost robots after a loss")]
    chord_length: Annotated[Array, 1, Value("m", "of a smaller ring after a loss")]


class Chords(Behavior):
    """Spread the robots evenly with equal chords: over a ring in the plane, six on an octahedron in space."""

    spreads: ClassVar[bool] = True
    python_only: ClassVar[frozenset[str]] = frozenset({"order"})

    behavior: Literal["chords"] = "chords"
    of_mission: ClassVar[tuple[str, ...]] = ("order",)
    gain: PositiveFloat = 0.8
    """Gain of the task error [1/s] (paper: Lambda_2)."""
    order: tuple[int, ...] | None = None
    """Order of the robots (from 1) along the formation; null: determined from their initial positions."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield robots or axes of which it has no formation, and robots that cannot keep one."""
        axes, count = mission.axes, mission.robots
        if not chords_exist(count, axes):
            needed = {2: "at least 2 robots, or ", 3: "6 robots, or "}.get(axes, "")
            words = f"chords has no even formation of {count} robots in {axes} axes; expected {needed}"
            words += "vertices or repulsion, which spread any number, in its place"
            because = (("robots", "count"), ("robots", "positions"), ("mission", "behaviors"), ("axes",))
            yield Misfit(words, "", because)
        if self.order is not None and sorted(self.order) != list(range(1, count + 1)):
            yield Misfit(
                f"found {list(self.order)[:20]}; expected each robot from 1 to {count} once", "order"
            )
        if mission.failures and axes != 2:
            words = f"chords has no formation in {axes} axes for the robots that failures leave; "
            yield Misfit(words + "expected vertices in its place", "", (("robots", "failures"),))
        if mission.teams:
            words = "keeps one formation of all robots; with teams expected vertices, repulsion or spacing"
            yield Misfit(words, "", (("teams",),))
        elif mission.heard:
            words = "keeps chords to robots that it may not hear; expected vertices or repulsion"
            yield Misfit(words, "", (("communication",),))

    def task(self, r: Robots) -> Task:
        """Return eq. 4 of each cycle: sigma = |q_i - q_j|^2 / 2, j before i, is to become length^2 / 2."""
        task = keep_distance(r.q - r.predecessor(0), r.chord_length, self.gain)
        if r.cycles == 1:
            return task
        return both(task, keep_distance(r.q - r.predecessor(1), r.chord_length, self.gain))
