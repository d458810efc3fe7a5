"""The fields of all components together: what kernels are given (`Plan`) and what they write (`State`).

Each is one flat vector of numbers, so that it travels where MuJoCo keeps it: the plan in the model's custom
numbers, the state in `MjData.userdata`. A component declares its fields beside its kernel, and its class is
one of the bases here: the fields lie one behind the other in this order. Sizes by name: n robots, p axes,
m obstacles, `packing` says what the others are.
"""

from __future__ import annotations

import hashlib

from escort_mj import plan
from escort_mj.behaviors.chords import ChordParameters, ChordState
from escort_mj.behaviors.formation import FormationParameters, FormationState
from escort_mj.behaviors.goal import GoalParameters, GoalState
from escort_mj.behaviors.learned import LearnedParameters, LearnedState
from escort_mj.behaviors.surface import RadiusParameters, RadiusState
from escort_mj.behaviors.vertices import VertexParameters, VertexState
from escort_mj.components.component import ComponentParameters
from escort_mj.components.memory import MemoryParameters, MemoryState
from escort_mj.components.mission import MissionParameters, MissionState
from escort_mj.components.movers import MoverParameters, MoverState
from escort_mj.components.obstacles import ObstacleParameters, ObstacleState
from escort_mj.components.rays import ShapeParameters
from escort_mj.components.teams import TeamParameters, TeamState
from escort_mj.components.views import BehaviorView, LawView
from escort_mj.control.controller import ControllerParameters, ControllerState
from escort_mj.control.custom.calls import CustomState
from escort_mj.control.deciding import PolicyParameters
from escort_mj.control.disturbing import DisturbanceParameters, DisturbanceState
from escort_mj.control.failure import FailureParameters, FailureState
from escort_mj.control.harmonics import HarmonicParameters
from escort_mj.control.inner import InnerLoopParameters, InnerLoopState
from escort_mj.control.knowing import EstimatorParameters
from escort_mj.control.messages import MessageState
from escort_mj.control.nsb import LimitState, StackParameters
from escort_mj.control.opponents import OpponentParameters, OpponentState
from escort_mj.control.outer_loops.detour import DetourState
from escort_mj.control.outer_loops.meeting import PaceState
from escort_mj.control.supervisor import SupervisorParameters, SupervisorState
from escort_mj.control.trigger import TriggerParameters, TriggerState
from escort_mj.control.velocity import OuterLoopParameters, ResidualState
from escort_mj.disturbances.disturbance import DisturbanceView
from escort_mj.estimators.belief import EstimatorView
from escort_mj.failures.failure import FailureView
from escort_mj.knowledge.auction import AuctionParameters, AuctionState
from escort_mj.knowledge.belief import BeliefParameters, BeliefState
from escort_mj.knowledge.links import LinkParameters, LinkState
from escort_mj.knowledge.sight import SightParameters, SightState
from escort_mj.knowledge.teammates import TeammateParameters, TeammateState
from escort_mj.monitor.clearances import ClearanceParameters, ClearanceState
from escort_mj.monitor.contacts import ContactState
from escort_mj.monitor.lyapunov import LyapunovParameters, LyapunovState
from escort_mj.monitor.motion import MotionState
from escort_mj.monitor.sampling import SamplingParameters, SamplingState
from escort_mj.monitor.truth import TruthParameters, TruthState
from escort_mj.native.fields import Array, declared
from escort_mj.native.kernels import inlined, vector_at
from escort_mj.native.memory import FIRST, LENGTH, Layout, viewer
from escort_mj.numerics.neighbors import NeighborState
from escort_mj.numerics.program import ProgramParameters, ProgramState
from escort_mj.numerics.reform import ReformingParameters, ReformingState
from escort_mj.policies.body import PolicyView
from escort_mj.radios.radio import RadioView
from escort_mj.sensing.lidar import LidarParameters, LidarState
from escort_mj.sensing.sensors import SensorParameters, SensorState
from escort_mj.sensors.sensor import SensorView
from escort_mj.signals import Signals


class Plan(
    plan.Plan,
    MissionParameters,
    ObstacleParameters,
    MoverParameters,
    ShapeParameters,
    PolicyParameters,
    OpponentParameters,
    TeamParameters,
    ComponentParameters,
    SensorParameters,
    LidarParameters,
    BeliefParameters,
    SightParameters,
    LinkParameters,
    TeammateParameters,
    AuctionParameters,
    EstimatorParameters,
    ControllerParameters,
    ProgramParameters,
    HarmonicParameters,
    SupervisorParameters,
    StackParameters,
    OuterLoopParameters,
    TriggerParameters,
    DisturbanceParameters,
    MemoryParameters,
    InnerLoopParameters,
    ChordParameters,
    VertexParameters,
    GoalParameters,
    FormationParameters,
    LearnedParameters,
    RadiusParameters,
    FailureParameters,
    ReformingParameters,
    ClearanceParameters,
    SamplingParameters,
    TruthParameters,
    LyapunovParameters,
):
    """What the compiled controller is given; SI units, world frame."""


class State(
    plan.State,
    Signals,
    MissionState,
    ObstacleState,
    MoverState,
    OpponentState,
    TeamState,
    SensorState,
    LidarState,
    BeliefState,
    SightState,
    LinkState,
    MessageState,
    AuctionState,
    TeammateState,
    ControllerState,
    ProgramState,
    FailureState,
    SupervisorState,
    TriggerState,
    PaceState,
    DetourState,
    DisturbanceState,
    MemoryState,
    InnerLoopState,
    ChordState,
    VertexState,
    GoalState,
    FormationState,
    LearnedState,
    RadiusState,
    ReformingState,
    CustomState,
    LimitState,
    ResidualState,
    NeighborState,
    ClearanceState,
    MotionState,
    ContactState,
    TruthState,
    LyapunovState,
    SamplingState,
):
    """What the compiled controller writes: first what is recorded, last the samples that it keeps."""


def _mark() -> float:
    """Return a number that tells these fields: models with other fields are not ours."""
    both = (*declared(Plan).items(), *declared(State).items())
    fields = [(name, field.kind.__name__, field.shape) for name, field in both]
    return float(int.from_bytes(hashlib.sha256(repr(fields).encode()).digest()[:6]))


MAGIC = _mark()
BY_ROBOT = (
    *(
        "n",
        "known",
        "judged",
        "headed",
        "learning",
        "estimating",
        "turned",
        "guarding",
        "bidding",
        "apart",
        "members",
        "mixed",
        "resized",
        "remembering",
        "pushed",
        "corrected",
        "blown",
        "blown_twice",
        "failing",
        "ruled",
    ),
)
LAYOUT = Layout(MAGIC, Plan, State, whole=BY_ROBOT)
LAYOUT.part(LawView)
LAYOUT.part(BehaviorView)
LAYOUT.part(PolicyView)
LAYOUT.part(EstimatorView)
LAYOUT.part(RadioView)
LAYOUT.part(DisturbanceView)
LAYOUT.part(SensorView)
LAYOUT.part(FailureView)


@inlined
def axes_of(address: int) -> int:
    """Return the dimension of the space of the packed plan at an address."""
    return int(vector_at(address, FIRST + 1)[FIRST])


@inlined
def size_of(address: int) -> int:
    """Return the length of the packed plan at an address."""
    return int(vector_at(address, FIRST)[LENGTH])


def unpack_plan(address: int, axes: int) -> Plan:
    """View the packed plan at an address; nothing is copied, nothing owned.

    Args:
        address: Where the plan is.
        axes: p; kernels pass a literal here, so that the compiler knows it and unrolls all loops over axes.
    """
    view: Plan = LAYOUT.read(Plan, address, address)
    return view


def unpack_state(plan_address: int, address: int, axes: int) -> State:
    """View the state at an address, given the address of its plan and p; nothing is copied or owned."""
    view: State = LAYOUT.read(State, plan_address, address)
    return view


viewer(lambda: (LAYOUT, Plan), unpack_plan)
viewer(lambda: (LAYOUT, State), unpack_state)


def state_size(packed: Array) -> int:
    """Return the length of the state vector that belongs to a packed plan."""
    return LAYOUT.state_size(packed)
