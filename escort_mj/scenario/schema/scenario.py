"""The scenario, version 1: every key, its type, default and bounds.

Cross-checks that need more than one key stand in `checks.py`; reading files in `load.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Field, NonNegativeFloat, PositiveFloat

from escort_mj.behaviors import AvoidObstacles, Surface, Vertices
from escort_mj.components.parameters import TEXT, Parameters, Radius
from escort_mj.control.outer_loops import Nsb
from escort_mj.control.supervisor import Condition
from escort_mj.control.trigger import Trigger
from escort_mj.laws import ApdSmc
from escort_mj.scenario.schema.environment import Environment
from escort_mj.scenario.schema.expectations import AnyExpectation
from escort_mj.scenario.schema.fields import (
    BODY_NAME,
    RUN_NAME,
    Behaviors,
    Component,
    Law,
    OuterLoop,
    Vector,
)
from escort_mj.scenario.schema.obstacle_tables import Clutter, Drive, Motion, Obstacle, Wall
from escort_mj.scenario.schema.plugin_source import PluginSource
from escort_mj.scenario.schema.robots import Robots
from escort_mj.scenario.schema.sensing import Sensing

if TYPE_CHECKING:
    from typing import Self

    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

MAX_AXES = 9
MAX_OBSTACLES = 5000


class Physics(Parameters):
    """How MuJoCo steps the world."""

    timestep: Annotated[float, Field(gt=0, le=0.1)] = 0.002
    """Physics and control step [s]."""
    integrator: Literal["euler", "implicitfast", "implicit"] = "euler"
    """MuJoCo's integrator (RK4 would evaluate the law four times a step)."""
    solver: Literal["newton", "cg", "pgs"] | None = None
    """MuJoCo's constraint solver; null: `newton`, but `cg` in a crowd, of 100 robots or more."""
    friction: bool | None = None
    """Whether bodies that touch rub on each other; null: they do, but not in a crowd. What rolls on the floor
    always rubs on it."""
    gravity: Annotated[Vector, Field(min_length=3, max_length=3)] | None = None
    """Gravity, world frame [m/s^2]; null: 9.81 downward where a robot's kind needs it, else none."""


class Target(Motion):
    """The escorted target. Give `position` or `waypoints`; without either it rests at 0."""

    radius: Radius = 0.3
    """Radius of its body [m]."""
    body: Drive | None = None
    """Mass and drive of a target that can be bumped; null: it moves as told, whatever it meets."""


class Phase(Parameters):
    """A stretch of the mission in which other behaviors rule; of the phases that hold, the last one rules."""

    name: Annotated[str, Field(pattern=BODY_NAME)] | None = None
    """Name in the trace; null: phase_1, phase_2 ..."""
    behaviors: Behaviors
    """Behaviors by priority, with their gains, as in `mission.behaviors`."""
    after: NonNegativeFloat = 0.0
    """Not before this time [s]."""
    before: PositiveFloat | None = None
    """Only before this time [s]; null: to the end."""
    when: Condition | None = None
    """Only while this holds; null: whenever the time is right."""


class Mission(Parameters):
    """What the robots are to do: the outer loop."""

    radius: Radius = 5.0
    """Distance to keep from the target [m]."""
    behaviors: Behaviors = (
        AvoidObstacles(),
        Vertices(),
        Surface(),
    )
    """Behaviors by priority, the most important first: names, or tables with a name and parameters."""
    supervisor: Annotated[tuple[Phase, ...], Field(max_length=32)] = ()
    """Phases with other behaviors, orders or gains, by time or condition; else `behaviors` rules."""
    trigger: Trigger | None = None
    """When a robot computes its reference velocity again; null: at every physics step."""
    outer: OuterLoop = Nsb()
    """How behaviors become one velocity: `nsb` (the paper) or a baseline; a name, or a table with gains."""
    target_feedforward: bool = True
    """Whether robots add the target's measured velocity to the escort behaviors (the paper does not)."""
    max_speed: PositiveFloat | None = None
    """Largest reference speed [m/s], spent by priority; null: no limit (the paper)."""


class Uncertainty(Parameters):
    """What the controller is not told."""

    disturbance: tuple[Component, ...] | None = None
    """External force on every robot, per axis [N]: numbers, or expressions in t; null: none."""


class Recording(Parameters):
    """What is kept of a run."""

    rate: PositiveFloat = 50.0
    """Samples per simulated second [1/s]; a whole number of physics steps apart."""
    truth: bool = False
    """Whether to record what the law may not know: mass matrix, bias and external force, reference torque,
    and the Lyapunov function with the causes of its change."""


class Video(Parameters):
    """The video of a run."""

    width: Annotated[int, Field(ge=160, le=3840, multiple_of=2)] = 1280
    """Width [pixel], even."""
    height: Annotated[int, Field(ge=120, le=2160, multiple_of=2)] = 720
    """Height [pixel], even."""
    rate: Annotated[int, Field(ge=1, le=120)] = 30
    """Frames per second of the video."""
    speed: Annotated[float, Field(ge=1e-3, le=1e6)] = 4.0
    """Simulated seconds per second of the video."""
    camera: Literal["overview", "follow", "top"] = "overview"
    """`overview` frames the whole mission, `follow` goes with the target, `top` looks down."""


class _Checked(ModelMetaclass):
    """Makes what is constructed pass all checks that a file has to pass."""

    if not TYPE_CHECKING:

        def __call__(cls, /, **data):  # noqa: N805
            return cls.checked(data, kind=cls)


class Scenario(Parameters, metaclass=_Checked):
    """One mission: everything that a run depends on.

    Args:
        data: Keys and values as in a file; tables may be mappings, and lists and numbers NumPy's.

    Raises:
        ScenarioError: With everything that is wrong, as for a file.
    """

    checked: ClassVar[Callable[..., Any]]
    """Checks plain data and makes a scenario of it: `reader.load.scenario_of`, which is above this floor."""

    if TYPE_CHECKING:

        def __init__(self, **data: Any) -> None: ...

    version: Literal[1] = 1
    """Version of this format."""
    name: Annotated[str, Field(pattern=RUN_NAME)] = "mission"
    """Name of the run's folder and title of its pictures."""
    description: Annotated[str, Field(max_length=2000, pattern=TEXT)] = ""
    """What the scenario is for."""
    plugins: Annotated[tuple[PluginSource, ...], Field(max_length=32)] = ()
    """Laws, behaviors and more of one's own (docs/plugins.md): Python files, from this file's folder, or
    names of installed plugins. They are code that runs: name only what you trust."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
    """Seed of all randomness: positions, and errors of measurements."""
    duration: Annotated[float, Field(gt=0, le=1e6)] = 30.0
    """Simulated time [s]."""
    axes: Annotated[int, Field(ge=2, le=MAX_AXES)] = 2
    """Dimension of the space: 2 is the plane, 3 is space, more is beyond it (docs/axes.md)."""
    physics: Physics = Physics()
    """How MuJoCo steps the world."""
    target: Target = Target()
    """What is escorted."""
    robots: Robots = Robots()
    """The team that escorts it."""
    obstacles: Annotated[tuple[Obstacle, ...], Field(max_length=MAX_OBSTACLES)] = ()
    """What stands or moves in the way."""
    walls: Annotated[tuple[Wall, ...], Field(max_length=100)] = ()
    """Walls and corridors, with doors."""
    clutter: Clutter | None = None
    """Obstacles drawn at random; null: none."""
    environment: Environment = Environment()
    """Floor, slope and medium."""
    mission: Mission = Mission()
    """What the robots are to do: the outer loop."""
    controller: Law = ApdSmc()
    """How they do it: the inner loop's law, its name or a table with its gains (law: apd_smc if left out)."""
    sensing: Sensing = Sensing()
    """What robots measure, and how well."""
    uncertainty: Uncertainty = Uncertainty()
    """What the controller is not told."""
    recording: Recording = Recording()
    """What is kept of a run."""
    video: Video = Video()
    """How a run is shown."""
    expect: tuple[AnyExpectation, ...] = ()
    """What must hold for the run to pass."""

    def replace(self, changes: Mapping[str, Any] | Sequence[str] = (), /, **more: Any) -> Self:
        """Return a checked copy in which some values are others.

        `scenario.replace({"robots.mass": 2})`, `scenario.replace(duration=20, seed=3)`.

        Args:
            changes: Values by their key paths, or texts `key.path=value`.
            more: More values by their key paths.

        Raises:
            ScenarioError: With everything that is wrong with the copy.
        """
        again = type(self).checked
        changed: Self = again(self, changes, kind=type(self)) if changes or not more else self
        return again(changed, more, kind=type(self)) if more else changed

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy; with values to update, what `replace` returns."""
        return self.replace(update) if update else super().model_copy(deep=deep)
