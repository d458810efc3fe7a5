"""What the controller records of every evaluation of the law."""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Recorded


class OuterLoopSignals(Fields):
    """The reference velocity and who makes it."""

    v_d: Annotated[Array, "n", "p", Recorded("m/s", "reference velocity from the behaviors (outer loop)")]
    avoidance_active: Annotated[
        Array, "n", Recorded("1", "1 while obstacle avoidance is active, otherwise 0", "int8")
    ]
    outer_updates: Annotated[Array, "n", Recorded("1", "number of updates by the outer loop so far", "int64")]


class GoalSignals(Fields):
    """Where robots with goals go; recorded where there are such robots."""

    goal: Annotated[Array, "headed", "p", Recorded("m", "point that the robot goes to")]
    goals_left: Annotated[Array, "headed", Recorded("1", "number of waypoints after `goal`", "int32")]
    formation_lag: Annotated[
        Array, "waiting", Recorded("s", "time by which a formation is behind, as it waited for its robots")
    ]


class SupervisorSignals(Fields):
    """Who rules."""

    phase: Annotated[
        Array,
        "n",
        Recorded("1", "active phase of the supervisor; 0 for the mission's own behaviors", "int8"),
    ]


class FailureSignals(Fields):
    """Whose motors have failed."""

    lost: Annotated[
        Array,
        "n",
        Recorded("1", "1 once the team knows that the robot's motors have failed, otherwise 0", "int8"),
    ]


class TaskSignals(Fields):
    """How the tasks of each robot get on with each other (paper eq. 19)."""

    ruling: Annotated[
        Array,
        "n",
        Recorded(
            "1", "active behavior of highest priority, as an index into `behavior`; -1 for none", "int8"
        ),
    ]
    task_error: Annotated[
        Array,
        "n",
        "behaviors",
        Recorded("m", "error of each active task: depth of intrusion, or distance from the desired position"),
    ]
    task_wish: Annotated[Array, "n", "behaviors", Recorded("m/s", "speed that each task demands on its own")]
    task_removed: Annotated[
        Array,
        "n",
        "behaviors",
        Recorded("m/s", "part of the velocity of each task that higher priorities removed"),
    ]
    task_angle: Annotated[
        Array,
        "n",
        "behaviors",
        Recorded(
            "rad", "smallest angle to an active task of higher priority; pi/2 means no conflict (eq. 19)"
        ),
    ]


class OpponentSignals(Fields):
    """What becomes of opponents, and which robot guards against which."""

    opponent_status: Annotated[
        Array,
        "opponents",
        Recorded("1", "0 before the opponent sets out, 1 on its way, 2 intercepted, 3 at the target", "int8"),
    ]
    interceptor: Annotated[
        Array, "opponents", Recorded("1", "robot that intercepted an opponent; 0 for none", "int16")
    ]
    threat: Annotated[
        Array, "guarding", Recorded("1", "opponent that a robot guards against; 0 for none", "int16")
    ]


class InnerLoopSignals(Fields):
    """From the reference to the force demanded."""

    q_d: Annotated[
        Array, "n", "p", Recorded("m", "reference position: the integral of the reference velocity")
    ]
    e: Annotated[Array, "n", "p", Recorded("m", "tracking error q_d - q_measured")]
    e_dot: Annotated[Array, "n", "p", Recorded("m/s", "velocity tracking error v_d - v_measured")]
    s: Annotated[Array, "n", "p", Recorded("m/s", "sliding variable e_dot + slope * e")]
    tau: Annotated[
        Array, "n", "p", Recorded("N", "force demanded by the law (inner loop), before the force limit")
    ]
    rho_hat: Annotated[Array, "n", "p", Recorded("N", "adaptive estimate of the reference torque")]
