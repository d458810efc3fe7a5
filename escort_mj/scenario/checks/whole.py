"""What must hold between the keys of a scenario, beyond the type and bounds of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator

from pydantic import BaseModel

from escort_mj.numerics.steps import last_step
from escort_mj.scenario.checks.disturbances import check_disturbances
from escort_mj.scenario.checks.expectations import check_bounds, check_sides, check_told, check_windows
from escort_mj.scenario.checks.failures import check_failures
from escort_mj.scenario.checks.fitting import check_fits
from escort_mj.scenario.checks.goals import check_goals, check_one_way, check_target
from escort_mj.scenario.checks.knowledge import (
    check_communication,
    check_known,
    check_target_sight,
)
from escort_mj.scenario.checks.mission import (
    check_behaviors,
    check_formation,
    check_supervisor,
    check_trigger,
    check_video,
)
from escort_mj.scenario.checks.motion import check_motion, check_order
from escort_mj.scenario.checks.obstacles import (
    check_clutter,
    check_environment,
    check_obstacle_names,
    check_obstacles,
    check_walls,
)
from escort_mj.scenario.checks.passage import check_doors, check_radii
from escort_mj.scenario.checks.policies import check_guards, check_leaders, check_opponents, check_policy
from escort_mj.scenario.checks.robots import (
    check_heights,
    check_kinds,
    check_models,
    check_motors,
    check_spans,
    check_taut,
    check_team,
    check_tethers,
    check_weights,
)
from escort_mj.scenario.checks.sensing import (
    check_delays,
    check_headings,
    check_lidar,
)
from escort_mj.scenario.checks.space import check_around, check_body, check_clearance, check_gravity
from escort_mj.scenario.checks.teams import (
    check_circles,
    check_escorts,
    check_laws,
    check_members,
    check_of_team,
    check_one_team,
    check_team_targets,
)
from escort_mj.scenario.checks.typed import check_functions, check_vectors
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission, mission_of
from escort_mj.scenario.schema.scenario import Scenario, Target

MAX_STEPS = 1e8  # beyond, time / timestep no longer tells steps apart
MAX_TRACE = 4 * 2**30  # bytes


def check_recording(mission: Mission) -> Iterator[Finding]:
    """Samples are a whole number of steps apart, and steps are few enough to be taken."""
    scenario = mission.scenario
    timestep, rate, duration = scenario.physics.timestep, scenario.recording.rate, scenario.duration
    path: Path = ("recording", "rate")
    if last_step(duration, timestep) < 1 or duration / timestep > MAX_STEPS:
        limit = f"from {timestep:g} to {MAX_STEPS * timestep:g} s" if duration >= timestep else "at least one"
        yield Finding(
            ("duration",),
            f"found {duration / timestep:.3g} steps of {timestep:g} s; expected a duration {limit}",
            related=(("physics", "timestep"),),
        )
    steps = 1.0 / (rate * timestep)
    whole = max(round(steps), 1)
    if not math.isclose(steps, whole, rel_tol=1e-6):
        rates = sorted({1.0 / (k * timestep) for k in (max(math.floor(steps), 1), math.ceil(steps))})
        yield Finding(
            path,
            f"found {rate:g} samples per second, {steps:.6g} steps of {timestep:g} s apart; expected a whole "
            f"number of steps, as with {' or '.join(f'{near:.9g}' for near in rates)}",
            related=(("physics", "timestep"),),
        )


def check_size(mission: Mission) -> Iterator[Finding]:
    """The trace, before it is compressed, is not too large."""
    size = mission.trace_size
    if size > MAX_TRACE:
        yield Finding(
            ("recording", "rate"),
            f"found a trace of {size / 2**30:.3g} GiB; expected at most {MAX_TRACE / 2**30:g}: "
            "lower recording.rate or duration",
            related=(("duration",), ("robots", "count"), ("robots",)),
        )


# By physics, too: without it nobody has looked at the sizes of what is around.
AROUND = ("obstacles", "walls", "clutter", "environment", "opponents", "teams", "physics")
CLUTTERED = ("axes", "seed", "duration", "target", "robots")  # what clutter is drawn by, beside those
Check = Callable[[Mission], Iterator[Finding]]

# Which parts of a scenario each check looks at: a check waits until those are right by themselves.
SHAPES: tuple[tuple[Check, tuple[str, ...]], ...] = (
    (check_functions, ("duration",)),
    (check_vectors, ("axes",)),  # a part that is wrong by itself holds its defaults, which fit any axes
    (check_gravity, ("axes", "physics", "environment")),
    (check_headings, ("robots", "sensing")),
    (check_team, ("axes", "robots")),
    (check_around, ("robots", "mission", "teams")),
    (check_tethers, ("axes", "robots", "target")),
    (check_kinds, ("axes", "robots")),
    (check_motion, ("target", "obstacles")),
    (check_order, ("target", "obstacles", "teams", "mission")),
    (check_disturbances, ("axes", "duration", "uncertainty")),
    (check_obstacles, ("axes", "physics", "obstacles")),
    (check_walls, ("axes", "walls")),
    (check_environment, ("axes", "environment")),
    (check_body, ("axes", "physics", "target")),
    (check_policy, ("axes", "target", "opponents", "teams")),
    (check_opponents, ("axes", "physics", "target", "opponents", "teams")),
    (check_team_targets, ("axes", "duration", "physics", "teams")),
    (check_escorts, ("teams",)),
)
ROOM: tuple[tuple[Check, tuple[str, ...]], ...] = ((check_clutter, AROUND),)
RELATIONS: tuple[tuple[Check, tuple[str, ...]], ...] = (
    (check_recording, ("duration", "physics", "recording")),
    (check_bounds, ("expect",)),
    (check_windows, ("expect", "duration", "physics")),
    (
        check_told,
        ("expect", "mission", "opponents", "knowledge", "communication", "recording", "controller", "teams"),
    ),
    (check_sides, ("expect", "axes", "robots", *AROUND)),
    (check_obstacle_names, ("axes", *AROUND)),
    (check_behaviors, ("mission",)),
    # Other parts that are wrong hold defaults.
    (check_fits, ("axes", "robots", "mission", "communication", "knowledge")),
    (check_trigger, ("mission",)),
    (check_guards, ("mission", "opponents")),
    (check_leaders, ("axes", "seed", "target", "robots", *AROUND)),
    (check_video, ("duration", "video")),
    (check_supervisor, ("duration", "robots", "mission", *AROUND)),
    (check_one_way, ("mission",)),
    (check_target, ("target", "mission", "expect", "teams")),
    (check_members, ("teams", "axes", "robots")),
    (check_laws, ("teams", "controller")),
    (check_one_team, ("teams", "target", "sensing", "mission", *AROUND)),
    (check_circles, ("teams", "axes", "duration", "robots", "mission")),
    (check_of_team, ("teams", "mission", "expect")),
    (check_goals, ("axes", "seed", "target", "robots", "mission", *AROUND)),
    (check_formation, ("axes", "target", "robots", "mission", "teams")),
    (check_radii, ("axes", "duration", "target", "robots", "mission")),
    (check_doors, ("axes", "duration", "target", "robots", *AROUND)),
    (check_motors, ("axes", "robots")),
    (check_taut, ("axes", "seed", "target", "robots", *AROUND)),
    (check_models, ("robots", "recording", "controller", "teams")),
    (check_heights, ("axes", "physics", "robots")),
    (check_spans, ("axes", "seed", "target", "robots", "mission", *AROUND)),
    (check_weights, ("axes", "physics", "robots")),
    (check_delays, ("axes", "duration", "physics", "robots", "sensing")),
    (check_lidar, ("axes", "mission", "physics", "robots", "sensing")),
    (check_known, ("knowledge", "communication", "mission", "target", "teams", "robots")),
    (check_target_sight, ("knowledge", "robots", "teams", "physics", "axes")),
    (check_communication, ("communication", "robots", "physics", "axes")),
    (check_failures, ("axes", "duration", "robots", "mission")),
    (check_clearance, ("axes", "seed", "target", "robots", "mission", *AROUND)),
)


WHOLE: tuple[tuple[Check, tuple[str, ...]], ...] = ((check_size, tuple(Scenario.model_fields)),)


def findings_between_keys(scenario: Scenario, wrong: Collection[str] = ()) -> list[Finding]:
    """Everything wrong between the keys of a scenario.

    Args:
        scenario: Whose keys are right one by one, but for the parts in `wrong`.
        wrong: Top-level keys that are known to be wrong and hold defaults; checks of them are left out.
    """
    found: list[Finding] = []
    for checks in (SHAPES, ROOM, RELATIONS, WHOLE):
        parts = {*wrong, *(str(finding.path[0]) for finding in found)}
        if "target" in parts:  # what is around starts from where it is, whatever a check looks at
            scenario = BaseModel.model_copy(scenario, update={"target": Target()})  # Scenario's own checks it
        mission = mission_of(scenario)
        for check, needs in checks:
            around = "clutter" in needs and scenario.clutter is not None
            if parts.isdisjoint(needs) and not (around and parts.intersection(CLUTTERED)):
                found += check(mission)
    return found
