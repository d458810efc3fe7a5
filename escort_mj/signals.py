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
from typing import Any, NamedTuple

from escort_mj.behaviors.signals import RadiusSignals
from escort_mj.components.memory import MemorySignals
from escort_mj.components.mission import DriveSignals, MissionSignals
from escort_mj.components.movers import MoverSignals, PolicySignals
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
MEMORIES, READINGS, POLICIES, WAITING = "memories", "readings", "policies", "waiting"
DIMS: dict[Extent, tuple[str, ...]] = {
    (1,): (),
    ("n",): ("robot",),
    ("m",): ("obstacle",),
    ("known",): ("robot",),
    ("judged",): ("robot",),
    ("driven",): ("robot",),
    ("headed",): ("robot",),
    ("estimating",): ("robot",),
    ("hearing",): ("robot",),
    ("returned",): ("robot",),
    ("slots",): ("slot",),
    ("rays",): ("ray",),
    ("waiting",): ("formation",),
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
    ("policy_values",): ("policy_value",),
    ("p",): ("axis",),
    ("p", "p"): ("axis", "axis_2"),
    ("behaviors",): ("behavior",),
    ("coordinates",): ("coordinate",),
    ("watched",): ("group",),
    (len(CAUSES),): ("cause",),
}
"""Dimensions of a trace by extents in memory; of those with one name, the first has its size."""
CHANNELS: dict[Extent, str] = {
    ("known",): TRUTH,
    ("judged",): LYAPUNOV,
    ("driven",): DRIVES,
    ("headed",): GOALS,
    ("estimating",): KNOWLEDGE,
    ("hearing",): RADIO,
    ("returned",): LIDAR,
    ("waiting",): WAITING,
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
    ("policy_values",): POLICIES,
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
    PolicySignals,
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
        sizes: Size of each dimension, and 1 for each channel that is recorded, see `record_sizes`.
    """
    return sum(signal.size(sizes) for signal in SIGNALS)


def record_sizes(memory: Mapping[str, int]) -> dict[str, int]:
    """Sizes of a record's dimensions, and 1 for each channel that it has.

    Args:
        memory: Sizes of the dimensions of its signals in memory; 0 for those that are left out.
    """
    known: dict[Any, int] = {**memory, len(CAUSES): len(CAUSES)}
    channels = {channel: 1 for (factor,), channel in CHANNELS.items() if known.get(factor)}
    sizes: dict[str, int] = {}
    for extent, dims in DIMS.items():
        for factor, dim in zip(extent, dims, strict=False):
            sizes.setdefault(dim, known.get(factor, 0))
    recorded = (signal for signal in SIGNALS if signal.recorded(channels))
    return {dim: sizes[dim] for signal in recorded for dim in signal.dims} | channels


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
