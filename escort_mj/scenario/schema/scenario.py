"""The scenario, version 1: every key, its type, default and bounds.

Cross-checks that need more than one key stand in `checks.py`; reading files in `load.py`.
"""

from collections.abc import Callable, Mapping
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Field, NonNegativeFloat, PositiveFloat

from escort_mj.behaviors import AvoidObstacles, Surface, Vertices
from escort_mj.components.parameters import TEXT, Deferred, Parameters, Radius, Vector
from escort_mj.control.outer_loops import SetBased
from escort_mj.control.trigger import Trigger
from escort_mj.laws import ApdSmc
from escort_mj.scenario.arguments import Overrides, argument_error
from escort_mj.scenario.schema.environment import Environment
from escort_mj.scenario.schema.expectations import AnyExpectation
from escort_mj.scenario.schema.fields import (
    BODY_NAME,
    RUN_NAME,
    Behaviors,
    Component,
    Disturbance,
    Law,
    OuterLoop,
    Policy,
    Radio,
    Rule,
)
from escort_mj.scenario.schema.knowledge import Knowledge
from escort_mj.scenario.schema.obstacle_tables import (
    MOST_SCENERY,
    Clutter,
    Drive,
    Motion,
    Obstacle,
    Scenery,
    Wall,
)
from escort_mj.scenario.schema.opponents import Opponents
from escort_mj.scenario.schema.plugin_source import PluginSource
from escort_mj.scenario.schema.robots import Robots
from escort_mj.scenario.schema.sensing import Sensing
from escort_mj.scenario.schema.teams import MOST_TEAMS, Team

if TYPE_CHECKING:
    from typing import Self

    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

MAX_AXES = 9
MOST_DISTURBANCES = 16
MAX_OBSTACLES = 5000


class Physics(Parameters):
    """Settings of the physics engine."""

    timestep: Annotated[float, Field(gt=0, le=0.1)] = 0.002
    """Physics and control step [s]."""
    integrator: Literal["euler", "implicitfast", "implicit"] = "euler"
    """MuJoCo's integrator (RK4 is not available: it would evaluate the law four times per step)."""
    solver: Literal["newton", "cg", "pgs"] | None = None
    """MuJoCo's constraint solver; null: `newton`, or `cg` in a crowd (100 robots or more)."""
    friction: bool | None = None
    """Whether contacts between bodies have friction; null: yes, except in a crowd. Rolling bodies always have
    friction with the floor."""
    gravity: Annotated[Vector, Field(min_length=3, max_length=3)] | None = None
    """Gravity in the world frame [m/s^2]; null: 9.81 downward if a kind of robot or a slope needs it,
    otherwise none."""


class Target(Motion):
    """The escorted target. Set `position` or `waypoints`; without either, it rests at the origin."""

    radius: Radius = 0.3
    """Radius of the body [m]."""
    body: Drive | None = None
    """Mass and drive of a target that can be pushed; null: with a policy, 1 kg driven by up to 20 N; without
    one, the target is kinematic and follows its path whatever it meets."""
    policy: Policy | None = None
    """Policy of the target; null: it follows its path. With a policy, the target starts at `position` and can
    be blocked, pushed and caught."""

    @property
    def drive(self) -> Drive | None:
        """Its mass and drive; None where it is kinematic."""
        return self.body or (None if self.policy is None else Drive(mass=1.0, force_limit=20.0))


class Phase(Parameters):
    """A phase of the mission; if several phases apply, the last one in the list takes effect."""

    name: Annotated[str, Field(pattern=BODY_NAME)] | None = None
    """Name in the trace; null: phase_1, phase_2 and so on."""
    behaviors: Behaviors
    """Behaviors in order of priority, as in `mission.behaviors`."""
    after: NonNegativeFloat = 0.0
    """Start of the phase [s]."""
    before: PositiveFloat | None = None
    """End of the phase [s]; null: the end of the run."""
    when: Rule | None = None
    """Condition for the phase; null: the phase depends on time only."""
    team: str | None = None
    """Name of the team to which the phase applies, in scenarios with `teams`; null: all robots."""


class Mission(Parameters):
    """The task of the robots: the outer loop."""

    radius: Radius = 5.0
    """Distance of the robots from the target [m]."""
    behaviors: Behaviors = (
        AvoidObstacles.model_construct(),
        Vertices.model_construct(),
        Surface.model_construct(),
    )
    """Behaviors in order of priority, highest first: names, or tables with a name and parameters."""
    supervisor: Annotated[tuple[Annotated[Phase, Deferred()], ...], Field(max_length=32)] = ()
    """Phases with their own behaviors, priorities or gains, selected by time or by a condition; outside these
    phases, `behaviors` applies."""
    trigger: Trigger | None = None
    """Condition for updates of the reference velocity; null: at every physics step."""
    outer: OuterLoop = SetBased.model_construct()
    """Composition of the behaviors into one velocity: `set_based`, `nsb` (the paper) or a baseline, given as
    a name or as a table with parameters (without the key `loop`, it is `set_based`)."""
    target_feedforward: bool = True
    """Whether the target's measured velocity is added to the velocities of the escort behaviors (not in the
    paper)."""
    max_speed: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    """Largest reference speed [m/s], allocated to the behaviors by priority; null: no limit (the paper)."""


class Uncertainty(Parameters):
    """Disturbances that the controller does not know."""

    disturbance: tuple[Component, ...] | None = None
    """External force on every robot, per axis [N]: numbers, or expressions in t; null: none."""
    disturbances: Annotated[tuple[Disturbance, ...], Field(max_length=MOST_DISTURBANCES)] = ()
    """Further forces on every robot, which add up: names, or tables with a name and parameters."""

    @property
    def of_time(self) -> tuple[tuple[Component, ...], ...]:
        """Those forces that depend on time alone, one function per axis each [N]."""
        forces = (self.disturbance or (), *(each.of_time for each in self.disturbances))
        return tuple(force for force in forces if force)


class Recording(Parameters):
    """Recorded data."""

    rate: Annotated[float, Field(ge=1e-3)] = 50.0
    """Samples per simulated second [1/s]; the interval must be a whole number of physics steps."""
    truth: bool = False
    """Whether to record the truth channel, which the law does not use: mass matrix, bias and external force,
    reference torque, and the Lyapunov function with the causes of its change."""


class Video(Parameters):
    """The video of a run."""

    width: Annotated[int, Field(ge=160, le=3840, multiple_of=2)] = 960
    """Width [pixel]; must be even."""
    height: Annotated[int, Field(ge=120, le=2160, multiple_of=2)] = 540
    """Height [pixel]; must be even."""
    rate: Annotated[int, Field(ge=1, le=120)] = 25
    """Frames per second of the video."""
    speed: Annotated[float, Field(ge=1e-3, le=1e6)] = 4.0
    """Simulated seconds per second of the video."""
    camera: Literal["overview", "follow", "top", "robot"] = "overview"
    """`overview` shows the whole mission, `follow` follows the target, `top` looks straight down,
    `robot` goes behind one robot."""
    robot: Annotated[int, Field(ge=1)] = 1
    """Robot that the camera `robot` goes behind."""
    look_at: Annotated[Vector, Field(min_length=3, max_length=3)] | None = None
    """Point that the camera looks at the whole time [m]; null: what `camera` shows."""
    azimuth: Annotated[float, Field(ge=-360, le=360)] | None = None
    """Direction in which the camera looks, around the vertical [deg]; 90 looks along +y; null: chosen for the
    mission."""
    elevation: Annotated[float, Field(ge=-90, le=90)] | None = None
    """Direction in which the camera looks, above the horizon [deg]; -90 looks straight down; null: chosen for
    the mission."""
    distance: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Distance of the camera from the point it looks at [m]; null: the smallest at which everything
    that `camera` shows fits into the frame."""
    start: Annotated[float, Field(ge=0, le=1e6)] | None = None
    """Simulated time at which the video begins [s]; null: the start of the run."""
    end: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Simulated time at which the video ends [s]; null: the end of the run."""


class _Checked(ModelMetaclass):
    """Makes what is constructed pass all checks that a file has to pass."""

    if not TYPE_CHECKING:

        @property
        def __signature__(cls):  # noqa: N805
            """Keys alone: what pydantic sets has the whole type of each."""
            keys = [Parameter(key, Parameter.KEYWORD_ONLY, default=...) for key in cls.model_fields]
            return Signature(keys)

        @__signature__.setter
        def __signature__(cls, _): ...  # noqa: N805

        def __call__(cls, /, *given, **data):  # noqa: N805
            if given:
                raise argument_error(cls.__name__, given[0], "keys, such as Scenario(duration=3)")
            # A class with members of plugins has them.
            loads = data.get("plugins") and cls.__base__ is Parameters
            return cls.checked(data, kind=None if loads else cls)


class Scenario(Parameters, metaclass=_Checked):
    """A mission: everything that a run depends on.

    Args:
        data: Keys and values as in a file. Tables can be mappings; lists and numbers can be NumPy objects.

    Raises:
        ScenarioError: With all faults, as for a file.
    """

    checked: ClassVar[Callable[..., Any]]
    """Checks plain data and makes a scenario of it: `reader.load.scenario_of`, which is above this floor."""

    if TYPE_CHECKING:

        def __init__(self, **data: Any) -> None: ...

    version: Literal[1] = 1
    """Version of this format."""
    name: Annotated[str, Field(pattern=RUN_NAME)] = "mission"
    """Name of the run folder and title of the figures."""
    description: Annotated[str, Field(max_length=2000, pattern=TEXT)] = ""
    """Description of the scenario."""
    plugins: Annotated[tuple[PluginSource, ...], Field(max_length=32)] = ()
    """Plugins (docs/plugins.md): Python files, relative to the scenario's folder, or names of installed
    plugins. Plugins execute code: use only plugins that you trust."""
    root: Annotated[str, Field(min_length=1, max_length=500)] = "."
    """Folder, relative to the scenario's, that contains all files that the scenario names (robots with their
    meshes, waypoints, networks). Their paths stay relative to the scenario's folder: `..` allows
    `file: ../robots/rover.xml`. A stored scenario needs no root."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
    """Seed of all random numbers, such as those for initial positions and measurement errors."""
    duration: Annotated[float, Field(gt=0, le=1e6)] = 30.0
    """Simulated time [s]."""
    axes: Annotated[int, Field(ge=2, le=MAX_AXES)] = 2
    """Dimension of the space: 2 for the plane, 3 for space, 4 to 9 for higher dimensions (docs/axes.md)."""
    physics: Physics = Physics.model_construct()
    """Settings of the physics engine."""
    target: Target | None = Target.model_construct()
    """The body that the robots escort; null: no target, and behaviors such as `goal` determine where robots
    go."""
    robots: Robots = Robots.model_construct()
    """The team of robots."""
    obstacles: Annotated[tuple[Obstacle, ...], Field(max_length=MAX_OBSTACLES)] = ()
    """Fixed and moving obstacles."""
    scenery: Annotated[tuple[Annotated[Scenery, Deferred()], ...], Field(max_length=MOST_SCENERY)] = ()
    """Surroundings from files (docs/worlds.md). A stored scenario has them among its obstacles."""
    walls: Annotated[tuple[Annotated[Wall, Deferred()], ...], Field(max_length=100)] = ()
    """Walls and corridors, with doors."""
    clutter: Annotated[Clutter, Deferred()] | None = None
    """Random obstacles; null: none."""
    opponents: Annotated[tuple[Annotated[Opponents, Deferred()], ...], Field(max_length=20)] = ()
    """Bodies that try to reach the target and that robots can intercept (docs/pursuit.md)."""
    teams: Annotated[tuple[Annotated[Team, Deferred()], ...], Field(max_length=MOST_TEAMS)] = ()
    """Teams of robots, each with targets of its own in place of `target` (docs/teams.md); empty: all robots
    are one team."""
    environment: Environment = Environment.model_construct()
    """Floor, slope and medium."""
    mission: Mission = Mission.model_construct()
    """The task of the robots: the outer loop."""
    controller: Law = ApdSmc.model_construct()
    """The law of the inner loop: a name, or a table with gains (without the key `law`, the law is `apd_smc`).
    `gains: auto` computes gains that fit the robots (docs/gains.md); the stored scenario contains the
    numbers."""
    sensing: Sensing = Sensing.model_construct()
    """Sensors of the robots and their errors."""
    knowledge: Annotated[Knowledge, Deferred()] | None = None
    """What each robot itself knows about the target; null: all robots share the team's measurements."""
    communication: Radio | None = None
    """Messages between the robots; null: all robots know each other's positions immediately."""
    uncertainty: Uncertainty = Uncertainty.model_construct()
    """Disturbances that the controller does not know."""
    recording: Recording = Recording.model_construct()
    """Recorded data."""
    video: Video = Video.model_construct()
    """Settings of the video."""
    expect: tuple[AnyExpectation, ...] = ()
    """Conditions that the run must meet to pass."""

    @property
    def laws(self) -> tuple[Law, ...]:
        """The laws that robots have, each once: of teams, then of single robots."""
        own = [each.controller for each in self.robots.overrides if each.controller is not None]
        return tuple(dict.fromkeys([*self.team_laws, *own]))

    @property
    def team_laws(self) -> tuple[Law, ...]:
        """The law of each team, or the one of all robots that have none of their own."""
        return tuple(team.controller or self.controller for team in self.teams) or (self.controller,)

    @property
    def law_names(self) -> str:
        """Name of the law; of each team's and robot's, where they differ."""
        names = [str(law.law) for law in self.team_laws]
        if len(set(self.team_laws)) == 1:
            names = names[:1]
        else:
            names = [f"{name} ({team.name})" for name, team in zip(names, self.teams, strict=True)]
        if len(self.laws) > 1:
            own = ((each.robot, each.controller) for each in self.robots.overrides)
            names += [f"{law.law} (robot {robot})" for robot, law in own if law is not None]
        return ", ".join(names)

    def replace(self, changes: Overrides = (), /, **more: Any) -> "Self":
        """Return a validated copy with some values replaced.

        `scenario.replace({"robots.mass": 2})`, `scenario.replace(duration=20, seed=3)`.

        Args:
            changes: Values by key path, or texts `key.path=value`.
            more: Further values by key path.

        Raises:
            ScenarioError: With all faults of the copy.
        """
        again = type(self).checked
        nothing = isinstance(changes, tuple | dict | list | str) and not changes
        changed: Self = self if more and nothing else again(self, changes, kind=type(self))
        return again(changed, more, kind=type(self)) if more else changed

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> "Self":
        """Return a copy; with values to update, what `replace` returns."""
        return self.replace(update) if update else super().model_copy(deep=deep)

    def model_dump(self, **options: Any) -> dict[str, Any]:
        """Return it as plain data, see pydantic, which would warn of nothing but an interrupt that hit it."""
        return super().model_dump(**{"warnings": False} | options)
