"""Base of policies: where a body wants to go that has a will of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple, Self

from pydantic import Field

from escort_mj.components.dispatch import in_turn
from escort_mj.components.equations import NUMBER, VECTOR, Answer, Call, Equations
from escort_mj.native.values import maker_of, names_of, with_own
from escort_mj.native.vectors import Vec, set_numbers
from escort_mj.policies.body import Body, PolicyView, kept, place_of

RESTS, ACTS = 0, 1
"""Whether a policy acts on its purpose at the moment."""


class Leader(NamedTuple):
    """A body that another one follows.

    Attributes:
        name: Of the body.
        distance: That is kept between centers [m].
    """

    name: str
    distance: float


class Policy(Equations):
    """The will of a body with its own drive: a target that escapes, or an opponent that wants to reach it.

    A subclass has a key `policy` with its name, parameters, and the equation `velocity(self, r)`, which
    returns the velocity that the body wants. What it keeps of its own, numbers or vectors, it declares and
    moves on in every step, before its velocity is asked for; runs record it. The body's drive follows as far
    as its force limit allows, and MuJoCo's contacts have the last word.
    """

    plural: ClassVar[str] = "policies"
    named_by: ClassVar[str] = "policy"
    method: ClassVar[str] = "velocity"
    view: ClassVar[type] = PolicyView
    outputs: ClassVar[tuple[str, ...]] = ("mover_wish", "policy_memory_next")
    scratch: ClassVar[tuple[str, ...]] = ("policy_memory",)
    answers: ClassVar[str | None] = "ACTS or RESTS"
    gives: ClassVar[str] = "body {} a velocity"
    asks: ClassVar[tuple[str, ...]] = ("velocity", "acts")
    reads: ClassVar[tuple[tuple[str, str], ...]] = tuple((name, name) for name in names_of(Body))
    keeps: ClassVar[str] = "policy_memory"
    keeps_vectors: ClassVar[bool] = True
    seeks: ClassVar[bool] = False
    """Whether it wants to reach the target, as opponents do."""
    of_teams: ClassVar[bool] = True
    """Whether targets of teams may have it."""

    policy: str
    speed: Annotated[float, Field(gt=0.0, le=1e3)] = 1.0
    """Speed at which the body moves [m/s]."""

    def velocity(self, r: Body) -> Vec:
        """Return the velocity that the body wants [m/s].

        Args:
            r: The body: `q`, `target`, `robot(k)` and more.
        """
        raise NotImplementedError

    def acts(self, r: Body) -> Any:
        """Return whether it acts on its purpose at the moment; by default it always does."""
        return True

    @property
    def follows(self) -> Leader | None:
        """Return which body it follows; None where it follows none."""
        return None

    def among(self, bodies: Sequence[str]) -> Self:
        """Return it in a mission with bodies of these names: robots, the target, then obstacles."""
        return self

    @classmethod
    def places(cls) -> dict[str, tuple[int, int]]:
        """Return behind how many numbers and vectors each of those is that it keeps, by name."""
        vectors = [memory.vector for memory in cls.memories().values()]
        return {name: (vectors[:k].count(False), sum(vectors[:k])) for k, name in enumerate(cls.memories())}

    @classmethod
    def body(cls) -> type[Body]:
        """Return what its equations are handed: a body that has by name what the policy keeps."""
        kinds = {name: memory.vector for name, memory in cls.memories().items()}
        return with_own(Body, cls, {name: kept(kinds[name], *place) for name, place in cls.places().items()})

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes the wish of a body and returns `ACTS` or `RESTS`: `(parameters, view, body)`."""
        body_at, velocity, acts = bodies_of(cls), equations["velocity"], equations["acts"]

        def writer(following: Call, numbers: int, vectors: int) -> Call:
            def write(parameters: Any, view: Any, body: int) -> None:
                found = following(parameters, body_at(body, view))
                set_numbers(view.policy_memory_next, place_of(view, body, numbers, vectors), found)

            return made(write)

        places = cls.places()
        move = in_turn(made, (writer(equations[name + cls.moves], *place) for name, place in places.items()))
        all_vectors = sum(each.vector for each in cls.memories().values())
        all_numbers = len(places) - all_vectors

        def decide(parameters: Any, view: Any, body: int) -> int:
            move(parameters, view, body)
            for at in range(place_of(view, body, 0, 0), place_of(view, body, all_numbers, all_vectors)):
                view.policy_memory[at] = view.policy_memory_next[at]
            r = body_at(body, view)
            set_numbers(view.mover_wish, body * view.q.shape[1], velocity(parameters, r))
            return ACTS if acts(parameters, r) else RESTS

        return decide

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return."""
        memory = cls.memories().get(name.removesuffix(cls.moves))
        return VECTOR if name == cls.method or (memory is not None and memory.vector) else NUMBER


@cache
def bodies_of(policy: type[Policy]) -> Any:
    """Return a function that makes what a policy is handed: of the body's number and the view."""
    return maker_of(policy.body())
