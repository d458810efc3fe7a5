"""The controller's memory: its parameters (`Plan`) and its state (`State`), each one flat vector of numbers.

Flat, so that both travel where MuJoCo keeps them: the plan in the model's custom numbers, the state in
`MjData.userdata`. Fields and their shapes are declared once, here; `memory` lays them out, in this order.
Sizes by name: n robots, p axes, m obstacles, `packing` says what the others are.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined, vector_at
from escort_mj.native.lanes import WIDTH
from escort_mj.native.memory import FIRST, LENGTH, Layout, viewer
from escort_mj.numerics.cells import CELL_ROWS
from escort_mj.numerics.program import INSTRUCTION_SIZE, PIECE_SIZE, STACK_DEPTH
from escort_mj.signals import CAUSES, EPISODE

Array = NDArray[np.float64]

MAGIC = 4144.20190919  # marks a model as ours: the paper's article number and date
LEVEL_SIZE = 5
KIND, PLACE, COLUMN, GAIN, IN_WORLD = range(LEVEL_SIZE)
"""Columns of the ladder: which behavior, where its parameters are, its column in the record, its gain [1/s],
and whether it asks for a velocity in the world's frame, not in the target's."""
PHASE_SIZE = 9
DRIVE_SIZE = 4
FAILURE_SIZE = 4  # columns: see `control/failure`
SENSOR_SIZE = 6  # columns: see `sensing/sensors`
NSB, POTENTIAL_FIELD, BARRIER_FILTER = 0, 1, 2
OUTSIDE = -1  # law or outer loop: what it would compute is written from outside, between steps
PAIRS_PER_BODY = 8  # so many can touch at once, and end between two samples; more are counted, not logged
CELLS_PER_PAIR = 2  # of the table that finds a pair
MAX_LEVELS = 8
LISTED = 48  # robots from which on lists of neighbors pay
NEIGHBORS = 32  # places in a robot's list: their number, and they
CAUSE_COUNT = len(CAUSES)
TOUCH_SIZE = len(EPISODE) + 1  # an episode, and its force in the present step
PLACE_SIZE = 3
CLOCK_SIZE = 16


class Plan(NamedTuple):
    """What the compiled controller knows; n robots, p axes, m obstacles. SI units, world frame."""

    timestep: float
    stride: int  # every so many physics steps a sample is taken
    seed: int
    radius: float
    target_feedforward: bool
    max_speed: float
    outer: int  # one of the three below, or OUTSIDE
    outer_gain: float  # of the repulsion [m^4/s], or rate of the filter [1/s]
    outer_distance: float  # below which repulsion grows no further [m]
    law: int  # place in LAWS, their number for one of a plugin, or OUTSIDE
    acceleration_filter: float
    estimate_at_start: float
    slope: float
    kp: float  # these six of the Lyapunov function, see `world/loop/lyapunov`
    kd: float
    k: float
    mu: float
    boundary_layer: float
    smoothing: int
    anti_windup: bool
    chord_length: float
    truth: bool
    lyapunov: bool
    trigger_distance: float  # 0 where the outer loop runs at every step
    trigger_share: float
    trigger_dwell: float
    trigger_longest: float
    shaped: bool  # whether some obstacle is no sphere
    nearest_within: float  # from here on the box around a shape will do for its nearest point [m]
    perfect: bool  # whether what is measured is the truth
    alike: bool  # whether all robots run one ladder at every step
    sensing_robots: float  # how far robots see each other, surface to surface [m]
    sensing_obstacles: float
    parameters: Annotated[Array, "parameters"]  # of the law, then of the behaviors: see `component`
    sensors: Annotated[Array, 4, SENSOR_SIZE]  # see `sensing`
    bias: Annotated[Array, "biased", "p"]
    ladder: Annotated[Array, "levels", LEVEL_SIZE]  # see the columns above
    phases: Annotated[Array, "phases", PHASE_SIZE]  # see `supervisor`
    predecessors: Annotated[Array, "cycles", "n"]
    vertices: Annotated[Array, "vertices", "p"]  # unit vectors; (0, p) where no behavior asks for them
    obstacle_position: Annotated[Array, "m", "p"]
    obstacle_radius: Annotated[Array, "m"]
    robot_radius: Annotated[Array, "n"]
    force_limit: Annotated[Array, "n"]
    force_limits: Annotated[Array, "n", "p"]  # the same, axis by axis
    target: Annotated[Array, "p", 2]  # first instruction and number of instructions of each axis
    lines: Annotated[Array, 2, "followed"]  # see `harmonics`
    tones: Annotated[Array, 2, "tones"]
    waves: Annotated[Array, "2*tones", "followed"]
    stretches: Annotated[Array, "stretches", 2]  # of the state, in the order of a record: start and length
    columns: Annotated[Array, "bodies", 2]  # see `Bodies.columns`
    extra: Annotated[Array, "extra"]  # physics steps of further samples, ascending
    disturbance: Annotated[Array, "p", 2]
    drives: Annotated[Array, "movers", DRIVE_SIZE]  # see `movers`
    paths: Annotated[Array, "movers*p", 2]  # instructions of each axis of each of them
    code: Annotated[Array, "instructions", INSTRUCTION_SIZE]
    pieces: Annotated[Array, "pieces", PIECE_SIZE]
    failures: Annotated[Array, "failing", FAILURE_SIZE]  # (0, FAILURE_SIZE) where no robot fails
    figures: Annotated[Array, "points", "p"]  # even points of n - 1, n - 2 ... robots
    turns: Annotated[Array, "turns*p", "p"]  # rotations to start from, one below another


class State(NamedTuple):
    """Views of the controller's state: first what is recorded (see `signals.py`), then what is its own."""

    time: Annotated[Array, 1]
    q: Annotated[Array, "n", "p"]
    v: Annotated[Array, "n", "p"]
    q_measured: Annotated[Array, "n", "p"]
    v_measured: Annotated[Array, "n", "p"]
    q_d: Annotated[Array, "n", "p"]
    v_d: Annotated[Array, "n", "p"]
    e: Annotated[Array, "n", "p"]
    e_dot: Annotated[Array, "n", "p"]
    s: Annotated[Array, "n", "p"]
    tau: Annotated[Array, "n", "p"]
    rho_hat: Annotated[Array, "n", "p"]
    disturbance: Annotated[Array, "n", "p"]
    target_position: Annotated[Array, "p"]
    target_velocity: Annotated[Array, "p"]
    target_position_measured: Annotated[Array, "p"]
    target_velocity_measured: Annotated[Array, "p"]
    avoidance_active: Annotated[Array, "n"]
    lost: Annotated[Array, "n"]
    phase: Annotated[Array, "n"]
    ruling: Annotated[Array, "n"]
    task_error: Annotated[Array, "n", "behaviors"]
    task_wish: Annotated[Array, "n", "behaviors"]
    task_removed: Annotated[Array, "n", "behaviors"]
    task_angle: Annotated[Array, "n", "behaviors"]
    outer_updates: Annotated[Array, "n"]
    force: Annotated[Array, "n", "p"]
    obstacle_position: Annotated[Array, "m", "p"]
    obstacle_distance: Annotated[Array, "n", "m"]
    robot_distance_min: Annotated[Array, "n"]
    clearance: Annotated[Array, "n", "watched"]
    clearance_body: Annotated[Array, "n", "watched"]
    target_clearance: Annotated[Array, "watched"]
    target_clearance_body: Annotated[Array, "watched"]
    speed_max: Annotated[Array, "n"]
    target_speed_max: Annotated[Array, 1]
    obstacle_speed_max: Annotated[Array, "m"]
    kinetic_energy: Annotated[Array, 1]
    contacts_untold: Annotated[Array, 1]
    saturated_time: Annotated[Array, "n"]
    effort: Annotated[Array, "n"]
    work: Annotated[Array, "n"]
    force_variation: Annotated[Array, "n"]
    qpos: Annotated[Array, "coordinates"]
    # From here to `lyapunov_change` there is something only in the truth channel.
    mass_matrix: Annotated[Array, "known", "p*p"]
    mass_coupling: Annotated[Array, "known"]
    bias_force: Annotated[Array, "known", "p"]
    external_force: Annotated[Array, "known", "p"]
    reference_torque: Annotated[Array, "known", "p"]
    skew_residual: Annotated[Array, "known"]
    coriolis_residual: Annotated[Array, "known"]
    lyapunov: Annotated[Array, "judged"]
    lyapunov_change: Annotated[Array, "judged", CAUSE_COUNT]
    mass_before: Annotated[Array, "known", "p*p"]  # of the step before, as are the next two
    reference_torque_before: Annotated[Array, "known", "p"]
    v_d_before: Annotated[Array, "known", "p"]
    pending: Annotated[Array, "judged", CAUSE_COUNT]  # change of V1 in the step that begins
    q_d_rate: Annotated[Array, "n", "p"]
    rho_hat_rate: Annotated[Array, "n", "p"]
    force_before: Annotated[Array, "n", "p"]  # force of the step before, for its variation
    target_before: Annotated[Array, "p"]  # places in the step before, for their displacements
    mover_before: Annotated[Array, "movers", "p"]
    rotation: Annotated[Array, "p", "p"]  # of the even figure
    touches: Annotated[Array, 2, "pairs", TOUCH_SIZE]  # under way: of the step before and of this, by turns
    places: Annotated[Array, 2, "cells", PLACE_SIZE]  # tables that find a pair's row in `touches`
    episodes: Annotated[Array, "pairs", len(EPISODE)]  # that have ended and were not yet taken off
    tally: Annotated[Array, 4]  # see `world/loop/contacts`
    latched: Annotated[Array, "n", "phases"]  # 1 while a phase's condition holds
    held: Annotated[Array, "n", "held"]  # at the last run of the outer loop, see `trigger`
    fresh: Annotated[Array, "n"]  # 1 where the outer loop runs now
    past: Annotated[Array, "past", "p"]  # see `measure`
    ahead: Annotated[Array, 3, "p"]  # at the next step: the target's place and velocity, the disturbance
    ahead_time: Annotated[Array, 2]  # whether they are known, and of which time
    clock: Annotated[Array, CLOCK_SIZE]  # see the constants below
    stack: Annotated[Array, 2 * STACK_DEPTH]  # scratch of `program.evaluate`
    model_mass: Annotated[Array, "told", "p*p"]  # mass matrix of each robot, where the law is told
    model_bias: Annotated[Array, "told", "p"]  # bias force, and (0, p) likewise
    v_d_filtered: Annotated[Array, "differentiating", "p"]  # v_d behind a filter
    v_d_rate: Annotated[Array, "differentiating", "p"]  # its derivative
    law_memory: Annotated[Array, "memories", "n", "p"]  # of a plugin's law
    law_memory_rate: Annotated[Array, "memories", "n", "p"]
    wished_direction: Annotated[Array, "n", "p"]  # what behaviors asked robot by robot say: scratch
    wished_velocity: Annotated[Array, "n", "p"]
    wished_error: Annotated[Array, "n"]
    wished_rank: Annotated[Array, "n"]
    wish_direction: Annotated[Array, "p"]  # what a plugin's behavior says of one robot
    wish_velocity: Annotated[Array, "p"]
    wish_error: Annotated[Array, 1]
    obstacle_point: Annotated[Array, "seen*m", "p"]  # what robots and target see of each; see `movers`
    obstacle_gap: Annotated[Array, "seen*m"]  # from their centers to its surface, negative inside it [m]
    mover_position: Annotated[Array, "movers", "p"]
    mover_velocity: Annotated[Array, "movers", "p"]
    mover_force: Annotated[Array, "movers", "p"]
    command: Annotated[Array, "n", "p"]  # force that the motors are told
    vertices: Annotated[Array, "vertices", "p"]  # as in the plan, and of fewer robots after a loss
    predecessors: Annotated[Array, "cycles", "n"]  # as in the plan, and past lost robots after a loss
    chord_length: Annotated[Array, 1]  # as in the plan, and of a smaller ring after a loss
    scratch: Annotated[Array, "scratch"]  # of `reform`
    # Of a crowd, see `neighbors`: by true positions, and by measured ones where those differ
    neighbors: Annotated[Array, "crowd", NEIGHBORS]
    neighbors_places: Annotated[Array, "crowd", "p"]
    neighbors_note: Annotated[Array, 4]
    seen_neighbors: Annotated[Array, "misled", NEIGHBORS]
    seen_neighbors_places: Annotated[Array, "misled", "p"]
    seen_neighbors_note: Annotated[Array, 4]
    cells: Annotated[Array, CELL_ROWS, "crowd"]  # scratch
    samples: Annotated[Array, "kept", "record"]  # not yet taken off, see `world/loop/sampling`
    spare: Annotated[Array, WIDTH]  # past the last sample


# Places in State.clock
STARTED, LAST_TIME, WATCHED_STEP = 0, 1, 2
KEPT = 4  # samples in `State.samples`
EVALUATED = 3  # steps evaluated before the present one
STEP = 5  # number of the present step
REMEMBERED = 6  # time up to which `law_memory` is integrated
DIFFERENTIATING = 7  # whether v_d has been differentiated before
SAMPLED = 8  # whether a sample is taken in the present step
WATCHED_SAMPLED = 9  # whether one was taken in the step that was watched last

# Rows of State.ahead, and places in State.ahead_time
NEXT_PLACE, NEXT_VELOCITY, NEXT_PUSH = 0, 1, 2
IS_KNOWN, NEXT_TIME = 0, 1

LAYOUT = Layout(MAGIC, Plan, State, whole=("n", "known", "judged"))


@inlined
def axes_of(address: int) -> int:
    """Dimension of the space of the packed plan at an address."""
    return int(vector_at(address, FIRST + 1)[FIRST])


@inlined
def size_of(address: int) -> int:
    """Length of the packed plan at an address."""
    return int(vector_at(address, FIRST)[LENGTH])


def unpack_plan(address: int, axes: int) -> Plan:
    """Views the packed plan at an address; nothing is copied, nothing owned.

    Args:
        address: Where the plan is.
        axes: p; kernels pass a literal here, so that the compiler knows it and unrolls all loops over axes.
    """
    plan: Plan = LAYOUT.read(Plan, address, address)
    return plan


def unpack_state(plan_address: int, address: int, axes: int) -> State:
    """Views the state at an address, given the address of its plan and p; nothing is copied or owned."""
    state: State = LAYOUT.read(State, plan_address, address)
    return state


viewer(LAYOUT, Plan, unpack_plan)
viewer(LAYOUT, State, unpack_state)


def state_size(plan: Array) -> int:
    """Length of the state vector that belongs to a packed plan."""
    return LAYOUT.state_size(plan)
