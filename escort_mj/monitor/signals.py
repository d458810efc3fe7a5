"""What monitors record: the worst of all physics steps since the last sample, totals, the truth, contacts."""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Recorded

ROBOTS, TARGET, OBSTACLES, WALLS, FLOOR = "robots", "target", "obstacles", "walls", "floor"
GROUPS = (ROBOTS, TARGET, OBSTACLES, WALLS)
"""Groups of bodies whose clearances are watched; `floor` is one for contacts only."""

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
            "true distance to each obstacle's center, or to the surface if it is no sphere (negative inside)",
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
            "least surface-to-surface distance to any body of the group since the previous sample; "
            "negative by how deep they overlap, inf for none",
        ),
    ]
    clearance_body: Annotated[
        Array,
        "n",
        "watched",
        Recorded(
            "1", "the body of the group that was so near, as an index into `body`; -1 for none", "int32"
        ),
    ]
    target_clearance: Annotated[
        Array, "watched", Recorded("m", "the same of the target: least distance since the previous sample")
    ]
    target_clearance_body: Annotated[
        Array, "watched", Recorded("1", "the body that was so near to the target; -1 for none", "int32")
    ]


class MotionSignals(Fields):
    """Largest speeds since the previous sample, and what the motors did so far."""

    speed_max: Annotated[Array, "n", Recorded("m/s", "largest speed since the previous sample")]
    target_speed_max: Annotated[
        Array,
        1,
        Recorded(
            "m/s",
            "the target's largest displacement in a physics step since the previous sample, "
            "over the timestep",
        ),
    ]
    obstacle_speed_max: Annotated[Array, "m", Recorded("m/s", "the same of each obstacle")]
    kinetic_energy: Annotated[
        Array,
        1,
        Recorded("J", "largest kinetic energy of all that moves freely since the previous sample"),
    ]
    saturated_time: Annotated[Array, "n", Recorded("s", "time so far in which a motor was at its limit")]
    effort: Annotated[Array, "n", Recorded("N^2 s", "integral so far of the squared force")]
    work: Annotated[Array, "n", Recorded("J", "integral so far of |force . velocity|")]
    force_variation: Annotated[
        Array, "n", Recorded("N", "sum so far of the force's absolute change, all axes (chattering)")
    ]


class ContactSignals(Fields):
    """What the log of contacts has no room for."""

    contacts_untold: Annotated[
        Array, 1, Recorded("1", "contacts so far that the contact log had no room for", "int64")
    ]


class TruthSignals(Fields):
    """What the simulator knows and the law does not; `known` is n where it is recorded, else 0."""

    mass_matrix: Annotated[
        Array, "known", "p*p", Recorded("kg", "the robot's own block of MuJoCo's mass matrix")
    ]
    mass_coupling: Annotated[
        Array,
        "known",
        Recorded(
            "kg",
            "norm of what couples the robot to other coordinates of its kinematic tree in the mass matrix",
        ),
    ]
    bias_force: Annotated[
        Array,
        "known",
        "p",
        Recorded("N", "bias force C v + g, as MuJoCo has it; without what holds up a quadrotor"),
    ]
    external_force: Annotated[
        Array, "known", "p", Recorded("N", "M a + bias - force: what neither motor nor bias explains")
    ]
    reference_torque: Annotated[
        Array,
        "known",
        "p",
        Recorded("N", "true reference torque M q_r'' + C q_r' + g, which rho_hat estimates"),
    ]
    skew_residual: Annotated[
        Array, "known", Recorded("kg/s", "largest symmetric part of dM/dt - 2 C, by differences")
    ]
    coriolis_residual: Annotated[
        Array, "known", Recorded("N", "largest of |C v + g - bias|, C by differences of M")
    ]


class LyapunovSignals(Fields):
    """V1 of the paper's proof; `judged` is `known` where the law has V1, else 0."""

    lyapunov: Annotated[Array, "judged", Recorded("J", "the robot's share of the Lyapunov function V1")]
    lyapunov_change: Annotated[
        Array, "judged", len(CAUSES), Recorded("J", "change of V1 so far, by its cause")
    ]


class Episode(Fields):
    """A contact episode: one unbroken touch of one pair of bodies, watched at every physics step."""

    episode_first: Annotated[float, Recorded("1", "the body that touches, as an index into `body`", "int32")]
    episode_second: Annotated[
        float, Recorded("1", "the body that it touches, the later one in `body`", "int32")
    ]
    episode_start: Annotated[float, Recorded("s", "time of the first physics step in which they touch")]
    episode_end: Annotated[float, Recorded("s", "end of the last physics step in which they touch")]
    episode_touch_time: Annotated[
        float, Recorded("s", "physics steps in which they touch, times the timestep")
    ]
    episode_peak_force: Annotated[
        float, Recorded("N", "largest normal force of a physics step, all contact points summed")
    ]
    episode_peak_time: Annotated[float, Recorded("s", "time of that step")]
    episode_impulse: Annotated[float, Recorded("N s", "sum of normal force times timestep")]
    episode_depth: Annotated[float, Recorded("m", "largest penetration")]
    episode_closing_speed: Annotated[
        float, Recorded("m/s", "speed along the normal at which they meet, in the first step")
    ]


EPISODE_SIZE = len(Episode.__annotations__)
FIRST, SECOND, START, END, TOUCH_TIME, PEAK_FORCE, PEAK_TIME, IMPULSE, DEPTH, CLOSING_SPEED = range(
    EPISODE_SIZE
)
