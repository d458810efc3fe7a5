"""Base of behaviors: what one asks of each robot by itself."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, NamedTuple

from escort_mj.behaviors.equations import TeamEquations
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Inequality, Task, as_task, keep_task
from escort_mj.components.equations import VECTOR, Answer, Call
from escort_mj.components.setup import MissionSetup
from escort_mj.components.views import BEHAVIOR_OUTPUTS


class Avoidance(NamedTuple):
    """What distances robots keep: one inequality for each body, distance >= safe distance.

    Attributes:
        safe_distance: To obstacles and failed robots [m].
        teammate_distance: To teammates that a robot sees [m]; 0: to none.
        heard_distance: To all places where teammates that a robot hears may be [m]; 0: to none.
        to_surface: 1 if distances are between surfaces, 0 if between centers.
        sidestep: Share of the velocity that a body blocks, up to which the speed around it is made up.
    """

    safe_distance: float
    teammate_distance: float = 0.0
    heard_distance: float = 0.0
    to_surface: float = 1.0
    sidestep: float = 0.0


class Plane(NamedTuple):
    """A line (in the plane) or a plane (in space), and a side of it.

    Attributes:
        point: On it, one number for each axis [m].
        normal: A vector of any length but 0 that points to the side on which robots stay [1].
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]


class Behavior(TeamEquations):
    """What velocity each robot is to have, and which directions that takes.

    A subclass has a key `behavior` with its name, parameters, and the equation `task(self, r)`, which returns
    what `keep`, `keep_distance`, `across`, `move` or `both` make; or, with `limits: ClassVar[bool] = True`,
    what `at_least` makes. Kernels evaluate it for eight robots at once. What it integrates of its own, a
    vector for each robot, it declares, as in `way: ClassVar[Memory] = Memory("m", "way gone")`, with the rate
    as `way_rate(self, r)`; the value is `r.way`, at first 0, which stands still while the behavior does not
    rule.
    """

    plural: ClassVar[str] = "behaviors"
    named_by: ClassVar[str] = "behavior"
    method: ClassVar[str] = "task"
    asks: ClassVar[tuple[str, ...]] = ("task",)
    outputs: ClassVar[tuple[str, ...]] = BEHAVIOR_OUTPUTS
    gives: ClassVar[str] = "robot {} a velocity"
    limits: ClassVar[bool] = False
    """Whether what it asks is an inequality."""
    frame: ClassVar[Literal["target", "world"]] = "target"
    """Whether what it asks is relative to the target's motion, or not."""
    chases: ClassVar[bool] = False
    """Whether it needs a target although what it asks is not relative to the target's motion."""
    spreads: ClassVar[bool] = False
    """Whether it spreads the team evenly around the target."""
    uses_vertices: ClassVar[bool] = False
    """Whether it reads `r.vertex`: the mission then works out an even figure with a vertex for each robot."""
    of_mission: ClassVar[tuple[str, ...]] = ()
    """Keys that have one value in all phases."""

    behavior: str

    def task(self, r: Robots) -> Any:
        """Return the task.

        Args:
            r: The robots, and what they know: `q`, `target`, `radius` and more.
        """
        raise NotImplementedError

    def avoidance(self, setup: MissionSetup) -> Avoidance | None:
        """Return what distances to bodies it keeps; None where it keeps none.

        `nsb` asks the task, which asks nothing of robots that are far from all bodies. The other outer loops
        keep the distances instead, each in its way.

        Args:
            setup: The mission.
        """
        return None

    def keeps_off(self, radius: float) -> float:
        """Return how far it keeps a robot's center from the surfaces of obstacles [m]; by default 0.

        Args:
            radius: The robot's [m].
        """
        return 0.0

    def border(self) -> Plane | None:
        """Return what robots do not cross, for pictures; None where there is no such line or plane."""
        return None

    @property
    def arrives_within(self) -> float:
        """Distance within which a robot is where it is sent [m]; 0 where it says no place of each robot."""
        return 0.0

    @property
    def looks_within(self) -> float:
        """Distance from which on it makes no difference to it by how much an obstacle is farther [m]."""
        return 0.0

    @property
    def bids(self) -> bool:
        """Whether robots bid for the places that it gives them."""
        return False

    @property
    def guards(self) -> bool:
        """Whether it sends robots against opponents."""
        return False

    @property
    def convergence(self) -> float:
        """How fast it brings its error to 0 [1/s]: its `gain`, or 0 where none says so."""
        gain = getattr(self, "gain", 0.0)
        return float(gain) if isinstance(gain, int | float) else 0.0

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what keeps the task of robots i to i + 7 in a view: `(parameters, view, i)`."""
        task, robots, move_on = equations["task"], cls.robots(), cls.moving_on(made, equations)

        def ask(parameters: Any, view: Any, i: int) -> None:
            keep_task(task(parameters, robots(i, view, view)), view, i)
            move_on(parameters, view, i)

        def ask_limit(parameters: Any, view: Any, i: int) -> None:
            keep_task(as_task(task(parameters, robots(i, view, view))), view, i)
            move_on(parameters, view, i)

        return ask_limit if cls.limits else ask

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return."""
        if name != cls.method:
            return VECTOR
        if cls.limits:
            return (Inequality,), "what at_least(...) returns"
        return (Task,), "a task, such as keep(...) returns"
