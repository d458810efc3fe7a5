"""What a run records: each signal's name, dimensions, unit and meaning, in the order of a sample.

A component declares what it records as fields (`native/fields`), in a module that costs little to import: its
kernel writes them, the callback copies them at each sample, the trace names its parts. Here they are put
together.

Frames: world. Units: SI. Robots are numbered from 1 in a trace's coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from itertools import accumulate
from math import prod
from typing import NamedTuple

from escort_mj.behaviors.signals import RadiusSignals
from escort_mj.components.memory import MemorySignals
from escort_mj.components.mission import DriveSignals, MissionSignals
from escort_mj.components.movers import MoverSignals
from escort_mj.components.obstacles import ObstacleSignals
from escort_mj.components.teams import TeamSignals
from escort_mj.control.signals import (
    FailureSignals,
    GoalSignals,
    InnerLoopSignals,
    OpponentSignals,
    OuterLoopSignals,
    SupervisorSignals,
    TaskSignals,
)
from escort_mj.knowledge.signals import KnowledgeSignals, RadioSignals
from escort_mj.monitor.signals import (
    CAUSES,
    ClearanceSignals,
    ContactSignals,
    Episode,
    LyapunovSignals,
    MotionSignals,
    TruthSignals,
    WatchSignals,
)
from escort_mj.native.fields import Extent, Recorded, declared
from escort_mj.sensing.lidar import LidarSignals
from escort_mj.sensing.sensors import ReadingSignals, SensorSignals

TIME = 0  # the column of a sample that holds its time
TRUTH, LYAPUNOV, DRIVES, GOALS = "truth", "lyapunov", "drives", "goals"
KNOWLEDGE, RADIO, LIDAR, OPPONENTS, TEAMS = "knowledge", "radio", "lidar", "opponents", "teams"
MOVERS, SEVERAL, RADII, WATCHES = "movers", "several", "radii", "watches"
MEMORIES, READINGS = "memories", "readings"
DIMS: dict[Extent, tuple[str, ...]] = {
    (1,): (),
    ("n",): ("robot",),
    ("known",): ("robot",),
    ("judged",): ("robot",),
    ("driven",): ("robot",),
    ("headed",): ("robot",),
    ("informed",): ("robot",),
    ("hearing",): ("robot",),
    ("returned",): ("robot",),
    ("slots",): ("slot",),
    ("rays",): ("ray",),
    ("opponents",): ("opponent",),
    ("guarding",): ("robot",),
    ("members",): ("robot",),
    ("escorted",): ("obstacle",),
    ("teams",): ("team",),
    ("movers",): ("mover",),
    ("several",): ("robot",),
    ("resized",): ("robot",),
    ("watches",): ("watch",),
    ("memories",): ("memory",),
    ("readings",): ("reading",),
    ("p",): ("axis",),
    ("p", "p"): ("axis", "axis_2"),
    ("m",): ("obstacle",),
    ("behaviors",): ("behavior",),
    ("coordinates",): ("coordinate",),
    ("watched",): ("group",),
    (len(CAUSES),): ("cause",),
}
"""Dimensions of a trace by extents in memory."""
CHANNELS: dict[Extent, str] = {
    ("known",): TRUTH,
    ("judged",): LYAPUNOV,
    ("driven",): DRIVES,
    ("headed",): GOALS,
    ("informed",): KNOWLEDGE,
    ("hearing",): RADIO,
    ("returned",): LIDAR,
    ("opponents",): OPPONENTS,
    ("guarding",): OPPONENTS,
    ("members",): TEAMS,
    ("escorted",): TEAMS,
    ("teams",): TEAMS,
    ("movers",): MOVERS,
    ("several",): SEVERAL,
    ("resized",): RADII,
    ("watches",): WATCHES,
    ("memories",): MEMORIES,
    ("readings",): READINGS,
}
"""Channels of which all signals have such an extent: it is 0 where they are not recorded."""


class Signals(
    MissionSignals,
    ObstacleSignals,
    SensorSignals,
    SupervisorSignals,
    FailureSignals,
    OuterLoopSignals,
    TaskSignals,
    InnerLoopSignals,
    MemorySignals,
    ClearanceSignals,
    MotionSignals,
    ContactSignals,
    TruthSignals,
    LyapunovSignals,
    DriveSignals,
    GoalSignals,
    KnowledgeSignals,
    RadioSignals,
    LidarSignals,
    OpponentSignals,
    TeamSignals,
    MoverSignals,
    RadiusSignals,
    WatchSignals,
    ReadingSignals,
):
    """All that is recorded: what a sample has, in this order."""


class Signal(NamedTuple):
    """One recorded quantity.

    Attributes:
        name: Variable name in the trace.
        dims: Dimensions beside time, out of `robot`, `axis`, `axis_2`, `obstacle`, `behavior`, `coordinate`,
            `cause`, `group`, `slot`, `ray`, `opponent`, `team`, `mover`, `watch`, `memory`,
            `reading`.
        unit: SI unit, `1` for none.
        meaning: One sentence for the trace's attributes and the docs.
        dtype: Of its values in a trace.
        channel: Recorded only where `sizes` has 1 under this name; empty for what is always recorded.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    meaning: str
    dtype: str
    channel: str

    def recorded(self, sizes: Mapping[str, int]) -> bool:
        """Whether a record of these sizes has this signal."""
        return not self.channel or sizes.get(self.channel, 0) == 1

    def size(self, sizes: Mapping[str, int]) -> int:
        """Number of values of one sample, given the size of each dimension; 0 where it is not recorded."""
        return prod(sizes[dim] for dim in self.dims) if self.recorded(sizes) else 0


def _signals(kind: type) -> Iterator[Signal]:
    """Yield what a class of recorded fields declares."""
    for name, field in declared(kind).items():
        assert isinstance(field.value, Recorded)
        dims = tuple(dim for extent in field.shape for dim in DIMS[extent])
        channel = next((CHANNELS[extent] for extent in field.shape if extent in CHANNELS), "")
        yield Signal(name, dims, field.value.unit, field.value.meaning, field.value.dtype, channel)


SIGNALS: tuple[Signal, ...] = tuple(_signals(Signals))
EPISODE: tuple[Signal, ...] = tuple(signal._replace(dims=("episode",)) for signal in _signals(Episode))
"""Columns of a contact episode."""


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


def channel_sizes(
    driven: bool,
    headed: bool,
    informed: bool = False,
    axes: int = 0,
    slots: int = 0,
    rays: int = 0,
    opponents: int = 0,
    teams: int = 0,
    movers: int = 0,
    several: bool = False,
    resized: bool = False,
    watches: int = 0,
    memories: int = 0,
    readings: int = 0,
) -> dict[str, int]:
    """Sizes that some missions add to those of a record.

    Args:
        driven: Whether there are robots with drives of their own.
        headed: Whether there are robots with goals.
        informed: Whether robots know only what they see and hear.
        axes: p.
        slots: How many teammates a robot hears at most; 0 without a radio.
        rays: How many rays of a lidar are recorded.
        opponents: How many there are.
        teams: How many there are; 0 where all robots are one.
        movers: How many bodies are driven by a force.
        several: Whether some robot is more than its hull.
        resized: Whether the distance that robots keep from the target changes.
        watches: How many quantities are watched in every physics step because an expectation asks for them.
        memories: How many numbers of their own laws and disturbances integrate for every robot and axis.
        readings: How many numbers sensors of other kinds than the plain one record of every robot.
    """
    channels = {DRIVES: driven, GOALS: headed, KNOWLEDGE: informed, RADIO: slots > 0, LIDAR: rays > 0}
    channels |= {OPPONENTS: opponents > 0, TEAMS: teams > 0, MOVERS: movers > 0, SEVERAL: several}
    channels |= {RADII: resized, WATCHES: watches > 0, MEMORIES: memories > 0, READINGS: readings > 0}
    sizes = {name: 1 for name, recorded in channels.items() if recorded}
    if informed:
        sizes["axis_2"] = axes
    if slots:
        sizes["slot"] = slots
    if rays:
        sizes["ray"] = rays
    if opponents:
        sizes["opponent"] = opponents
    if teams:
        sizes["team"] = teams
    if movers:
        sizes["mover"] = movers
    if watches:
        sizes["watch"] = watches
    if memories:
        sizes["memory"] = memories
    if readings:
        sizes["reading"] = readings
    return sizes


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
