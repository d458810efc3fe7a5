"""What monitors record: the worst of all physics steps since the last sample, totals, the truth, contacts."""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Recorded

ROBOTS, TARGET, OBSTACLES, WALLS, FLOOR = "robots", "target", "obstacles", "walls", "floor"
GROUPS = (ROBOTS, TARGET, OBSTACLES, WALLS)
"""Groups of bodies whose clearances are watched; `floor` is one for contacts only."""

GEOMS = "geoms"
"""Shape of a robot that is more than its hull: several geoms of its own."""

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


class ClearanceSignals(Fields):
    """Distances; the least clearances are those of all physics steps since the previous sample."""

    obstacle_distance: Annotated[
        Array,
        "n",
        "m",
        Recorded(
            "m",
            "true distance to the center of each spherical obstacle, or to the surface "
            "of any other (negative inside)",
        ),
    ]
    robot_distance_min: Annotated[
        Array, "n", Recorded("m", "true distance to the nearest other robot, center to center")
    ]
    clearance: Annotated[
        Array,
        "n",
        "watched",
        Recorded(
            "m",
            "minimum surface-to-surface distance to each group of bodies since the "
            "previous sample; negative if bodies overlap, inf if the group has no other body",
        ),
    ]
    clearance_body: Annotated[
        Array,
        "n",
        "watched",
        Recorded("1", "closest body of each group, as an index into `body`; -1 for none", "int32"),
    ]
    target_clearance: Annotated[
        Array,
        "watched",
        Recorded("m", "minimum distance of the target to each group of bodies since the previous sample"),
    ]
    target_clearance_body: Annotated[
        Array, "watched", Recorded("1", "body closest to the target; -1 for none", "int32")
    ]


class MotionSignals(Fields):
    """Largest speeds since the previous sample, and what the motors did so far."""

    speed_max: Annotated[Array, "n", Recorded("m/s", "largest speed since the previous sample")]
    point_speed_max: Annotated[
        Array,
        "several",
        Recorded(
            "m/s",
            "largest possible speed of any point of the robot's colliding geoms since the previous sample, "
            "turning included; 0 for a robot that is its hull",
        ),
    ]
    target_speed_max: Annotated[
        Array,
        1,
        Recorded(
            "m/s",
            "largest displacement of the target in a physics step since the previous "
            "sample, divided by the timestep",
        ),
    ]
    obstacle_speed_max: Annotated[
        Array,
        "m",
        Recorded(
            "m/s",
            "largest displacement of each obstacle in a physics step since the previous "
            "sample, divided by the timestep",
        ),
    ]
    kinetic_energy: Annotated[
        Array,
        1,
        Recorded("J", "largest kinetic energy of all freely moving bodies since the previous sample"),
    ]
    saturated_time: Annotated[Array, "n", Recorded("s", "time so far with a motor at its limit")]
    effort: Annotated[Array, "n", Recorded("N^2 s", "integral of the squared force so far")]
    work: Annotated[Array, "n", Recorded("J", "integral of |force . velocity| so far")]
    force_variation: Annotated[
        Array,
        "n",
        Recorded("N", "sum of the absolute changes of the force so far, over all axes (chattering)"),
    ]


class WatchSignals(Fields):
    """What expectations ask about every physics step; `watches` is their number, mostly 0."""

    watch_value: Annotated[
        Array,
        "watches",
        Recorded(
            "SI",
            "what was found in the physics steps since the previous sample: the worst value, the sum "
            "of all, or the time of the last one beyond the bound",
        ),
    ]
    watch_count: Annotated[
        Array,
        "watches",
        Recorded("1", "number of values that it was found among; 0 for none, and then it says nothing"),
    ]
    watch_time: Annotated[Array, "watches", Recorded("s", "time of the worst value, or of the last one")]
    watch_who: Annotated[
        Array, "watches", Recorded("1", "index of who or what had it, such as a robot, from 0", "int32")
    ]


class ContactSignals(Fields):
    """What the log of contacts has no room for."""

    contacts_untold: Annotated[
        Array, 1, Recorded("1", "number of contacts so far that did not fit into the contact log", "int64")
    ]


class TruthSignals(Fields):
    """What the simulator knows and the law does not; `known` is n where it is recorded, else 0."""

    mass_matrix: Annotated[
        Array, "known", "p*p", Recorded("kg", "block of MuJoCo's mass matrix for the robot")
    ]
    mass_coupling: Annotated[
        Array,
        "known",
        Recorded(
            "kg",
            "norm of the mass matrix entries that couple the robot to other coordinates "
            "of its kinematic tree",
        ),
    ]
    bias_force: Annotated[
        Array,
        "known",
        "p",
        Recorded("N", "MuJoCo's bias force C v + g; without the force that compensates a quadrotor's weight"),
    ]
    external_force: Annotated[
        Array, "known", "p", Recorded("N", "M a + bias - force: all forces except motor and bias forces")
    ]
    reference_torque: Annotated[
        Array,
        "known",
        "p",
        Recorded("N", "true reference torque M q_r'' + C q_r' + g, which rho_hat estimates"),
    ]
    skew_residual: Annotated[
        Array,
        "known",
        Recorded("kg/s", "largest entry of the symmetric part of dM/dt - 2 C, by finite differences"),
    ]
    coriolis_residual: Annotated[
        Array,
        "known",
        Recorded("N", "largest entry of |C v + g - bias|, with C from finite differences of M"),
    ]


class LyapunovSignals(Fields):
    """V1 of the paper's proof; `judged` is `known` where the law has V1, else 0."""

    lyapunov: Annotated[Array, "judged", Recorded("J", "the robot's share of the Lyapunov function V1")]
    lyapunov_change: Annotated[Array, "judged", len(CAUSES), Recorded("J", "change of V1 so far, by cause")]


class Episode(Fields):
    """A contact episode: one unbroken touch of one pair of bodies, watched at every physics step."""

    episode_first: Annotated[
        float, Recorded("1", "first body of the touch, as an index into `body`", "int32")
    ]
    episode_second: Annotated[
        float, Recorded("1", "second body of the touch, the later one in `body`", "int32")
    ]
    episode_start: Annotated[float, Recorded("s", "time of the first physics step of the touch")]
    episode_end: Annotated[float, Recorded("s", "end of the last physics step of the touch")]
    episode_touch_time: Annotated[
        float, Recorded("s", "number of physics steps with contact, times the timestep")
    ]
    episode_peak_force: Annotated[
        float, Recorded("N", "largest normal force in a physics step, summed over all contact points")
    ]
    episode_peak_time: Annotated[float, Recorded("s", "time of the largest normal force")]
    episode_impulse: Annotated[float, Recorded("N s", "integral of the normal force")]
    episode_depth: Annotated[float, Recorded("m", "largest penetration")]
    episode_closing_speed: Annotated[
        float, Recorded("m/s", "speed along the normal in the first step of the touch")
    ]


EPISODE_SIZE = len(Episode.__annotations__)
FIRST, SECOND, START, END, TOUCH_TIME, PEAK_FORCE, PEAK_TIME, IMPULSE, DEPTH, CLOSING_SPEED = range(
    EPISODE_SIZE
)
