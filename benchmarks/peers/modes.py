"""The peers, the ways they are used here, and what differs from ours in what they compute."""

from __future__ import annotations

from typing import NamedTuple

SIZES = (5, 50, 500)


class Mode(NamedTuple):
    """A way to use a peer.

    Attributes:
        peer: Whose adapter and environment.
        mode: What the adapter calls it.
        title: What readers do.
        rigid: Whether it is rigid bodies under control: whether it is to be compared as such.
        kind: The kind of our robots that take turns with it.
        axes: In the plane or in space.
        dynamics: What moves its robots.
        contacts: What touching does.
        control: What tells its robots where to go, and how often.
        precision: Of its numbers.
        sizes: Numbers of robots.
        many: Whether it flies many missions at once; ours then flies one on each core.
    """

    peer: str
    mode: str
    title: str
    rigid: bool
    kind: str
    axes: int
    dynamics: str
    contacts: str
    control: str
    precision: str
    sizes: tuple[int, ...] = SIZES
    many: bool = False


DRONES, BALLS, DISCS, CARTS, FLOW = (
    "rigid quadrotors, 6 degrees of freedom",
    "rigid balls, 6 degrees of freedom",
    "discs with mass and drag, 2 degrees of freedom",
    "kinematic discs",
    "rigid quadrotors with rotor dynamics, 6 degrees of freedom",
)
SOLVED, PUSHED, MOVED, NONE = (
    "constraint solver",
    "penalty forces",
    "separated after each step",
    "none: drones pass through each other",
)
MODES = (
    Mode(
        "gym_pybullet_drones",
        "pid",
        "gym-pybullet-drones",
        True,
        "quadrotor",
        3,
        DRONES,
        SOLVED,
        "its PID, in Python for each drone, at 48 Hz",
        "double",
    ),
    Mode(
        "gym_pybullet_drones",
        "constant",
        "gym-pybullet-drones, no control",
        False,
        "quadrotor",
        3,
        DRONES,
        SOLVED,
        "none: constant rotor speeds",
        "double",
    ),
    Mode(
        "pybullet",
        "controlled",
        "PyBullet",
        True,
        "point_mass",
        3,
        BALLS,
        SOLVED,
        "a PD law in NumPy at each step",
        "double",
    ),
    Mode(
        "crazyflow",
        "stepped",
        "crazyflow, step by step",
        True,
        "quadrotor",
        3,
        FLOW,
        NONE,
        "its Mellinger controller, commanded from Python at each step",
        "single",
    ),
    Mode(
        "crazyflow",
        "compiled",
        "crazyflow, all in JAX",
        True,
        "quadrotor",
        3,
        FLOW,
        NONE,
        "its Mellinger controller, commanded in the compiled loop",
        "single",
    ),
    Mode(
        "crazyflow",
        "worlds",
        "crazyflow, all in JAX, 1024 worlds",
        True,
        "quadrotor",
        3,
        FLOW,
        NONE,
        "the same",
        "single",
        (5,),
        True,
    ),
    Mode(
        "vmas",
        "one",
        "VMAS",
        True,
        "point_mass",
        2,
        DISCS,
        PUSHED,
        "a PD law in PyTorch at each step",
        "single",
    ),
    Mode(
        "vmas",
        "worlds",
        "VMAS, 1024 worlds",
        True,
        "point_mass",
        2,
        DISCS,
        PUSHED,
        "the same",
        "single",
        (5,),
        True,
    ),
    Mode(
        "irsim",
        "velocities",
        "IR-SIM",
        False,
        "point_mass",
        2,
        CARTS,
        MOVED,
        "a velocity law in NumPy at each step",
        "double",
    ),
    Mode(
        "irsim",
        "rvo",
        "IR-SIM, its RVO",
        False,
        "point_mass",
        2,
        CARTS,
        MOVED,
        "its reciprocal velocity obstacles",
        "double",
    ),
)
