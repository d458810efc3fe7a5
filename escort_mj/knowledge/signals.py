"""What is recorded of the robots' knowledge."""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Recorded


class KnowledgeSignals(Fields):
    """What each robot knows of the target; recorded where robots know only what they see and hear."""

    target_estimate: Annotated[
        Array, "estimating", "p", Recorded("m", "position of the target as each robot estimates it")
    ]
    target_velocity_estimate: Annotated[
        Array, "estimating", "p", Recorded("m/s", "velocity of the target as each robot estimates it")
    ]
    target_covariance: Annotated[
        Array,
        "estimating",
        "p*p",
        Recorded("m^2", "covariance of the error of `target_estimate` that the robot expects; 0 if unknown"),
    ]
    target_seen: Annotated[
        Array, "estimating", Recorded("1", "1 if the robot measured the target at its last look", "int8")
    ]
    information_age: Annotated[
        Array,
        "estimating",
        Recorded("s", "age of the newest measurement of the target known to the robot"),
    ]


class RadioSignals(Fields):
    """Who hears whom; recorded where robots communicate."""

    heard_from: Annotated[
        Array,
        "hearing",
        "slots",
        Recorded("1", "robots heard within the timeout, numbered from 1; 0 for none", "int16"),
    ]
    messages_sent: Annotated[Array, "hearing", Recorded("1", "messages sent so far", "int64")]
    messages_heard: Annotated[Array, "hearing", Recorded("1", "messages received so far", "int64")]
    messages_lost: Annotated[
        Array, "hearing", Recorded("1", "messages lost on the way to the robot so far", "int64")
    ]
