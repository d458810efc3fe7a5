"""What a run records: each signal's name, shape, unit and meaning, in the order of its memory.

The controller's kernel writes these signals, one evaluation of the law at a time, as one contiguous
block; the recorder copies that block; the trace names its parts. All three read this table, so a
signal is added in one line here and written by one line in the kernel.

Frames: world. Units: SI. Robots are numbered from 1 in a trace's coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import accumulate
from math import prod
from typing import NamedTuple


class Signal(NamedTuple):
    """One recorded quantity.

    Attributes:
        name: Variable name in the trace.
        dims: Dimensions beside time, out of `robot`, `axis`, `axis_2`, `obstacle`, `behavior`, `coordinate`,
            `cause`, `group`.
        unit: SI unit, `1` for none.
        meaning: One sentence for the trace's attributes and the docs.
        channel: Recorded only where `sizes` has 1 under this name; empty for what is always recorded.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    meaning: str
    channel: str = ""

    def recorded(self, sizes: Mapping[str, int]) -> bool:
        """Whether a record of these sizes has this signal."""
        return not self.channel or sizes.get(self.channel, 0) == 1

    def size(self, sizes: Mapping[str, int]) -> int:
        """Number of values of one sample, given the size of each dimension; 0 where it is not recorded."""
        return prod(sizes[dim] for dim in self.dims) if self.recorded(sizes) else 0


TIME = 0  # the column of a sample that holds its time
RA = ("robot", "axis")


def axis_names(axes: int) -> list[str]:
    """Names of so many axes: x, y, z, x4, x5 ..."""
    return ["x", "y", "z", *(f"x{k}" for k in range(4, axes + 1))][:axes]


RB = ("robot", "behavior")
TRUTH, LYAPUNOV = "truth", "lyapunov"

CAUSES = (
    "dissipation",  # -kd |e_dot|^2 - slope kp |e|^2 - k s.sw(s): what the proof counts on
    "reference",  # the reference torque rho moves; without adaptation, all of s.rho
    "external",  # forces that are neither the motors' nor the bias: disturbance, contact, coupling
    "noise",  # the law acts on measured, not true, errors
    "saturation",  # applied minus demanded force: at the limit, or of motors that fail
    "anti_windup",  # estimate and reference position are held
    "unexplained",  # the rest: what the timestep's finite length leaves
)
"""Why the Lyapunov function V1 changes."""

ROBOTS, TARGET, OBSTACLES, WALLS, FLOOR = "robots", "target", "obstacles", "walls", "floor"
GROUPS = (ROBOTS, TARGET, OBSTACLES, WALLS)
"""Groups of bodies whose clearances are watched; `floor` is one for contacts only."""

# Control signals of one and the same evaluation of the law, at the sample's time.
# Then what was worst since the previous sample (every physics step is looked at), then running totals.
SIGNALS: tuple[Signal, ...] = (
    Signal("time", (), "s", "time of the evaluation of the law"),
    Signal("q", RA, "m", "true position of the robots"),
    Signal("v", RA, "m/s", "true velocity of the robots"),
    Signal("q_measured", RA, "m", "position that the law was given"),
    Signal("v_measured", RA, "m/s", "velocity that the law was given"),
    Signal("q_d", RA, "m", "reference position: the integral of the reference velocity"),
    Signal("v_d", RA, "m/s", "reference velocity from the behaviors (outer loop)"),
    Signal("e", RA, "m", "tracking error q_d - q_measured"),
    Signal("e_dot", RA, "m/s", "velocity tracking error v_d - v_measured"),
    Signal("s", RA, "m/s", "sliding variable e_dot + slope * e"),
    Signal("tau", RA, "N", "force demanded by the law (inner loop), before the force limit"),
    Signal("rho_hat", RA, "N", "adaptive estimate of the reference torque"),
    Signal("disturbance", RA, "N", "external force that disturbs the robots"),
    Signal("target_position", ("axis",), "m", "position of the target"),
    Signal("target_velocity", ("axis",), "m/s", "velocity of the target"),
    Signal("target_position_measured", ("axis",), "m", "position of the target that the law was given"),
    Signal("target_velocity_measured", ("axis",), "m/s", "velocity of the target that the law was given"),
    Signal("avoidance_active", ("robot",), "1", "1 while obstacle avoidance rules the robot, else 0"),
    Signal("lost", ("robot",), "1", "1 once the team knows that the robot's motors have failed, else 0"),
    Signal("phase", ("robot",), "1", "phase of the supervisor that rules the robot, 0 for the mission's own"),
    Signal(
        "ruling", ("robot",), "1", "active behavior of highest priority, by its place in `behavior`; -1: none"
    ),
    Signal("task_error", RB, "m", "error of each active task: depth of intrusion, or distance from the wish"),
    Signal("task_wish", RB, "m/s", "speed that each task wants for itself"),
    Signal("task_removed", RB, "m/s", "what the projections of higher priorities removed of that velocity"),
    Signal("task_angle", RB, "rad", "smallest angle to an active task above; pi/2 is no conflict (eq. 19)"),
    Signal("outer_updates", ("robot",), "1", "runs of the outer loop so far"),
    Signal(
        "force",
        RA,
        "N",
        "force that motors applied, after their limits; without what holds up a quadrotor",
    ),
    Signal("obstacle_position", ("obstacle", "axis"), "m", "center of each obstacle"),
    Signal(
        "obstacle_distance",
        ("robot", "obstacle"),
        "m",
        "true distance to each obstacle's center, or to the surface if it is no sphere (negative inside)",
    ),
    Signal(
        "robot_distance_min", ("robot",), "m", "true distance to the nearest other robot, center to center"
    ),
    Signal(
        "clearance",
        ("robot", "group"),
        "m",
        "least surface-to-surface distance to any body of the group since the previous sample; "
        "negative by how deep they overlap, inf for none",
    ),
    Signal(
        "clearance_body",
        ("robot", "group"),
        "1",
        "the body of the group that was so near, as an index into `body`; -1 for none",
    ),
    Signal(
        "target_clearance",
        ("group",),
        "m",
        "the same of the target: least distance since the previous sample",
    ),
    Signal("target_clearance_body", ("group",), "1", "the body that was so near to the target; -1 for none"),
    Signal("speed_max", ("robot",), "m/s", "largest speed since the previous sample"),
    Signal(
        "target_speed_max",
        (),
        "m/s",
        "the target's largest displacement in a physics step since the previous sample, over the timestep",
    ),
    Signal("obstacle_speed_max", ("obstacle",), "m/s", "the same of each obstacle"),
    Signal(
        "kinetic_energy", (), "J", "largest kinetic energy of all that moves freely since the previous sample"
    ),
    Signal("contacts_untold", (), "1", "contacts so far that the contact log had no room for"),
    Signal("saturated_time", ("robot",), "s", "time so far in which a motor was at its limit"),
    Signal("effort", ("robot",), "N^2 s", "integral so far of the squared force"),
    Signal("work", ("robot",), "J", "integral so far of |force . velocity|"),
    Signal(
        "force_variation", ("robot",), "N", "sum so far of the force's absolute change, all axes (chattering)"
    ),
    Signal("qpos", ("coordinate",), "m or 1", "MuJoCo's generalized positions, for replay"),
    # The truth channel: what the simulator knows and the law does not.
    Signal("mass_matrix", (*RA, "axis_2"), "kg", "the robot's own block of MuJoCo's mass matrix", TRUTH),
    Signal(
        "mass_coupling",
        ("robot",),
        "kg",
        "norm of what couples the robot to other coordinates of its kinematic tree in the mass matrix",
        TRUTH,
    ),
    Signal(
        "bias_force",
        RA,
        "N",
        "bias force C v + g, as MuJoCo has it; without what holds up a quadrotor",
        TRUTH,
    ),
    Signal("external_force", RA, "N", "M a + bias - force: what neither motor nor bias explains", TRUTH),
    Signal(
        "reference_torque",
        RA,
        "N",
        "true reference torque M q_r'' + C q_r' + g, which rho_hat estimates",
        TRUTH,
    ),
    Signal(
        "skew_residual", ("robot",), "kg/s", "largest symmetric part of dM/dt - 2 C, by differences", TRUTH
    ),
    Signal("coriolis_residual", ("robot",), "N", "largest of |C v + g - bias|, C by differences of M", TRUTH),
    Signal("lyapunov", ("robot",), "J", "the robot's share of the Lyapunov function V1", LYAPUNOV),
    Signal("lyapunov_change", ("robot", "cause"), "J", "change of V1 so far, by its cause", LYAPUNOV),
)


E = ("episode",)
EPISODE: tuple[Signal, ...] = (
    Signal("episode_first", E, "1", "the body that touches, as an index into `body`"),
    Signal("episode_second", E, "1", "the body that it touches, the later one in `body`"),
    Signal("episode_start", E, "s", "time of the first physics step in which they touch"),
    Signal("episode_end", E, "s", "end of the last physics step in which they touch"),
    Signal("episode_touch_time", E, "s", "physics steps in which they touch, times the timestep"),
    Signal("episode_peak_force", E, "N", "largest normal force of a physics step, all contact points summed"),
    Signal("episode_peak_time", E, "s", "time of that step"),
    Signal("episode_impulse", E, "N s", "sum of normal force times timestep"),
    Signal("episode_depth", E, "m", "largest penetration"),
    Signal("episode_closing_speed", E, "m/s", "speed along the normal at which they meet, in the first step"),
)
"""A contact episode: one unbroken touch of one pair of bodies, watched at every physics step."""

FIRST, SECOND, START, END, TOUCH_TIME, PEAK_FORCE, PEAK_TIME, IMPULSE, DEPTH, CLOSING_SPEED = range(
    len(EPISODE)
)


def record_size(sizes: Mapping[str, int]) -> int:
    """Number of values of one whole sample.

    Args:
        sizes: Size of each dimension: `robot`, `axis`, `obstacle`, `behavior`, `coordinate`; 1 for each
            channel that is recorded, with the sizes of its dimensions, see `truth_sizes`.
    """
    return sum(signal.size(sizes) for signal in SIGNALS)


def truth_sizes(axes: int, truth: bool, lyapunov: bool) -> dict[str, int]:
    """Sizes that the truth channel adds to those of a record.

    Args:
        axes: p.
        truth: Whether the truth is recorded.
        lyapunov: Whether the law has the Lyapunov function V1.
    """
    return {TRUTH: int(truth), LYAPUNOV: int(truth and lyapunov), "axis_2": axes, "cause": len(CAUSES)}


def columns(name: str, sizes: Mapping[str, int]) -> slice:
    """Where a signal stands in a sample.

    Args:
        name: Which signal.
        sizes: Size of each dimension: `robot`, `axis`, `obstacle`, `coordinate`.
    """
    return _all_columns(tuple(sizes.items()))[name]


@cache
def _all_columns(sizes: tuple[tuple[str, int], ...]) -> dict[str, slice]:
    """Where each signal stands in a sample."""
    ends = list(accumulate((signal.size(dict(sizes)) for signal in SIGNALS), initial=0))
    return {signal.name: slice(*ends[k : k + 2]) for k, signal in enumerate(SIGNALS)}
