"""The controller's memory: its parameters (`Plan`) and its state (`State`), each one flat vector of numbers.

Flat, so that both travel where MuJoCo keeps them: the plan in the model's custom numbers, the state in
`MjData.userdata`. The order of fields is written once, in `unpack_plan` and `unpack_state`; everything
else, Python included, asks those two for views.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors import Chords, Repulsion, Surface, Vertices
from escort_mj.control.failure import FAILURE_SIZE
from escort_mj.control.laws import ApdSmc, Asmc, ComputedTorque, Pd, PdSmc, SuperTwisting
from escort_mj.control.outer_loops import BarrierFilter, Nsb, PotentialField
from escort_mj.control.program import INSTRUCTION_SIZE, PIECE_SIZE, STACK_DEPTH
from escort_mj.control.reform import scratch_size
from escort_mj.kernels import DOUBLE, matrix_at, shared, vector_at
from escort_mj.signals import CAUSES

Array = NDArray[np.float64]

MAGIC = 4144.20190919  # marks a model as ours: the paper's article number and date
SCALARS = 48
OUTER = 28  # place of the outer loop's kind; its gain behind it
OUTER_DISTANCE = 45
LAW = 31  # place of the law's kind; its own number behind it
LEVEL_SIZE = 8
SIDESTEP, COLUMN = 6, 7  # places in a row of the ladder
PHASE_SIZE = 9
AVOID_OBSTACLES, CHORDS, SURFACE, VERTICES, REPULSION = 0.0, 1.0, 2.0, 3.0, 4.0
KINDS = {Chords: CHORDS, Surface: SURFACE, Vertices: VERTICES, Repulsion: REPULSION}
SLIDING, PD, COMPUTED_TORQUE, SUPER_TWISTING = 0, 1, 2, 3
NSB, POTENTIAL_FIELD, BARRIER_FILTER = 0, 1, 2
LOOP_KINDS = {Nsb: NSB, PotentialField: POTENTIAL_FIELD, BarrierFilter: BARRIER_FILTER}
LAW_KINDS = {
    ApdSmc: SLIDING,
    Asmc: SLIDING,
    PdSmc: SLIDING,
    Pd: PD,
    ComputedTorque: COMPUTED_TORQUE,
    SuperTwisting: SUPER_TWISTING,
}
MAX_CYCLES = 2
PAIRS_PER_ROBOT = 8  # more touches than that at once are not told apart
MAX_LEVELS = 8
CAUSE_COUNT = len(CAUSES)
CLOCK_SIZE = 8
TRUTH = 30  # place in the header: 0 no truth is recorded, 1 truth, 2 truth with the Lyapunov function


class Plan(NamedTuple):
    """What the compiled controller knows; n robots, p axes, m obstacles. SI units, world frame."""

    timestep: float
    stride: int  # physics steps between two samples
    seed: int
    radius: float
    target_feedforward: bool
    max_speed: float
    outer: int  # one of LOOP_KINDS
    outer_gain: float  # of the repulsion [m^4/s], or rate of the filter [1/s]
    outer_distance: float  # below which repulsion grows no further [m]
    law: int  # one of LAW_KINDS
    acceleration_filter: float
    kp: float
    kd: float
    k: float
    mu: float
    rho_hat_0: float
    slope: float
    boundary_layer: float
    smoothing: int
    anti_windup: bool
    noise_position: float
    noise_velocity: float
    chord_length: float
    truth: bool
    lyapunov: bool
    trigger_distance: float  # 0 where the outer loop runs at every step
    trigger_share: float
    trigger_dwell: float
    trigger_longest: float
    ladder: Array  # (levels of all phases, LEVEL_SIZE): kind, then the behavior's own numbers
    phases: Array  # (phases, PHASE_SIZE), see `supervisor`
    predecessors: Array  # (cycles, n)
    vertices: Array  # (n, p), unit vectors; (0, p) where no behavior asks for them
    obstacle_position: Array  # (m, p)
    obstacle_radius: Array  # (m,)
    robot_radius: Array  # (n,)
    force_limit: Array  # (n,)
    target: Array  # (p, 2): first instruction and number of instructions of each axis
    disturbance: Array  # (p, 2)
    code: Array  # (instructions, 3)
    pieces: Array  # (pieces, 5)
    failures: Array  # (n, FAILURE_SIZE), (0, FAILURE_SIZE) where nobody fails
    figures: Array  # even points of n - 1, n - 2 ... robots, one figure below another
    turns: Array  # (k p, p): rotations to start from, one below another


class State(NamedTuple):
    """Views of the controller's state: first the record (see `signals.py`), then what is its own."""

    time: Array
    q: Array
    v: Array
    q_measured: Array
    v_measured: Array
    q_d: Array
    v_d: Array
    e: Array
    e_dot: Array
    s: Array
    tau: Array
    rho_hat: Array
    disturbance: Array
    target_position: Array
    target_velocity: Array
    avoidance_active: Array
    lost: Array
    phase: Array
    ruling: Array
    task_error: Array
    task_wish: Array
    task_removed: Array
    task_angle: Array
    outer_updates: Array
    force: Array
    obstacle_distance: Array
    robot_distance_min: Array
    obstacle_clearance_worst: Array
    robot_clearance_worst: Array
    contacts: Array
    contact_force: Array
    contact_onsets: Array
    saturated_time: Array
    effort: Array
    work: Array
    force_variation: Array
    qpos: Array
    mass_matrix: (
        Array  # (n, p * p); it and all that follows up to `lyapunov_change` only in the truth channel
    )
    mass_coupling: Array
    bias_force: Array
    external_force: Array
    reference_torque: Array
    skew_residual: Array
    coriolis_residual: Array
    lyapunov: Array
    lyapunov_change: Array
    mass_before: Array  # (n, p * p): of the step before, as are the next two; truth channel only
    reference_torque_before: Array  # (n, p)
    v_d_before: Array  # (n, p)
    pending: Array  # (n, CAUSES): change of V1 in the step that begins
    q_d_rate: Array  # (n, p)
    rho_hat_rate: Array  # (n, p)
    force_before: Array  # (n, p): force of the step before, for its variation
    rotation: Array  # (p, p): of the even figure
    touching: (
        Array  # (2, PAIRS_PER_ROBOT * n): keys of the pairs that touched in the step before, and in this
    )
    latched: Array  # (n, phases): 1 while a phase's condition holds
    held: Array  # (n, p + 3): relative position, time, phase and losses at the last run of the outer loop
    fresh: Array  # (n,): 1 where the outer loop runs now
    tasks: Array  # ((2 + MAX_CYCLES) * MAX_LEVELS, p): scratch of `conflicts`
    clock: Array  # (CLOCK_SIZE,): see the constants below
    switching: Array  # (n * p,): scratch, the smoothed sign of s
    stack: Array  # (2 * STACK_DEPTH,): scratch of `program.evaluate`
    model_mass: Array  # (n, p * p): mass matrix of each robot; (0, p * p) where the law is not told it
    model_bias: Array  # (n, p): bias force, and (0, p) likewise
    v_d_filtered: Array  # (n, p): v_d behind a filter; (0, p) where no law differentiates it
    v_d_rate: Array  # (n, p): its derivative, and (0, p) likewise
    command: Array  # (n, p): force that the motors are told
    vertices: Array  # as in the plan, and of fewer robots after a loss
    predecessors: Array  # as in the plan, and past lost robots after a loss
    chord_length: Array  # (1,): as in the plan, and of a smaller ring after a loss
    scratch: Array  # of `reform`


# Places in State.clock
STARTED, LAST_TIME, WATCHED_STEP, CONTACTS_BEFORE = 0, 1, 2, 3
DIFFERENTIATING = 7  # whether v_d has been differentiated before


@shared
def axes_of(address: int) -> int:
    """Dimension of the space of the packed plan at an address."""
    return int(vector_at(address, SCALARS)[2])


@shared
def _take(at: int, rows: int, columns: int) -> tuple[int, Array]:
    """The block of memory at an address as a matrix, and the address of the block after it."""
    return at + DOUBLE * rows * columns, matrix_at(at, rows, columns)


@shared
def _reserve(n: int, losses: int) -> int:
    """Points of the figures of n - 1, n - 2 ... robots, for so many losses."""
    return losses * n - losses * (losses + 1) // 2


@shared
def unpack_plan(address: int, axes: int) -> Plan:
    """Views the packed plan at an address; nothing is copied, nothing owned.

    Args:
        address: Where the plan is.
        axes: p; kernels pass a literal here, so that the compiler knows it and unrolls all loops over axes.
    """
    x = vector_at(address, SCALARS)
    n, p, m = int(x[1]), axes, int(x[3])
    levels, cycles, instructions, pieces = int(x[5]), int(x[6]), int(x[7]), int(x[8])
    at, ladder = _take(address + DOUBLE * SCALARS, levels, LEVEL_SIZE)
    at, phases = _take(at, int(x[37]), PHASE_SIZE)
    at, predecessors = _take(at, cycles, n)
    at, vertices = _take(at, int(x[27]), p)
    at, obstacle_position = _take(at, m, p)
    at, obstacle_radius = _take(at, 1, m)
    at, robot_radius = _take(at, 1, n)
    at, force_limit = _take(at, 1, n)
    at, target = _take(at, p, 2)
    at, disturbance = _take(at, p, 2)
    at, code = _take(at, instructions, INSTRUCTION_SIZE)
    at, table = _take(at, pieces, PIECE_SIZE)
    losses = int(x[35])
    at, failures = _take(at, n if losses > 0 else 0, FAILURE_SIZE)
    at, figures = _take(at, _reserve(n, losses) if x[27] > 0.0 else 0, p)
    at, turns = _take(at, int(x[36]) * p, p)
    return Plan(
        x[10], int(x[9]), int(x[11]), x[12], x[13] != 0.0, x[14],
        int(x[OUTER]), x[OUTER + 1], x[OUTER_DISTANCE],
        int(x[LAW]), x[LAW + 1],
        x[15], x[16], x[17], x[18], x[19],
        x[20], x[21], int(x[22]), x[23] != 0.0,
        x[24], x[25], x[26], x[TRUTH] > 0.0, x[TRUTH] > 1.0, x[39], x[40], x[41], x[42],
        ladder, phases, predecessors, vertices, obstacle_position, obstacle_radius[0],
        robot_radius[0], force_limit[0], target, disturbance, code, table,
        failures, figures, turns,
    )  # fmt: skip


@shared
def _law_rows(x: Array, n: int) -> tuple[int, int]:
    """Rows of the model that the law is told, and of the velocities that it differentiates."""
    law = int(x[LAW])
    return n if law == PD or law == COMPUTED_TORQUE else 0, n if law == COMPUTED_TORQUE else 0


@shared
def unpack_state(plan_address: int, address: int, axes: int) -> State:
    """Views the state at an address, given the address of its plan and p; nothing is copied or owned."""
    x = vector_at(plan_address, SCALARS)
    n, p, m, nq, phases, behaviors = int(x[1]), axes, int(x[3]), int(x[4]), int(x[37]), int(x[38])
    known, judged = n * int(x[TRUTH] > 0.0), n * int(x[TRUTH] > 1.0)
    at, time = _take(address, 1, 1)
    at, q = _take(at, n, p)
    at, v = _take(at, n, p)
    at, q_measured = _take(at, n, p)
    at, v_measured = _take(at, n, p)
    at, q_d = _take(at, n, p)
    at, v_d = _take(at, n, p)
    at, e = _take(at, n, p)
    at, e_dot = _take(at, n, p)
    at, s = _take(at, n, p)
    at, tau = _take(at, n, p)
    at, rho_hat = _take(at, n, p)
    at, disturbance = _take(at, n, p)
    at, target_position = _take(at, 1, p)
    at, target_velocity = _take(at, 1, p)
    at, avoidance_active = _take(at, 1, n)
    at, lost = _take(at, 1, n)
    at, phase = _take(at, 1, n)
    at, ruling = _take(at, 1, n)
    at, task_error = _take(at, n, behaviors)
    at, task_wish = _take(at, n, behaviors)
    at, task_removed = _take(at, n, behaviors)
    at, task_angle = _take(at, n, behaviors)
    at, outer_updates = _take(at, 1, n)
    at, force = _take(at, n, p)
    at, obstacle_distance = _take(at, n, m)
    at, robot_distance_min = _take(at, 1, n)
    at, obstacle_clearance_worst = _take(at, 1, n)
    at, robot_clearance_worst = _take(at, 1, n)
    at, contacts = _take(at, 1, 1)
    at, contact_force = _take(at, 1, 1)
    at, contact_onsets = _take(at, 1, 1)
    at, saturated_time = _take(at, 1, n)
    at, effort = _take(at, 1, n)
    at, work = _take(at, 1, n)
    at, force_variation = _take(at, 1, n)
    at, qpos = _take(at, 1, nq)
    at, mass_matrix = _take(at, known, p * p)
    at, mass_coupling = _take(at, 1, known)
    at, bias_force = _take(at, known, p)
    at, external_force = _take(at, known, p)
    at, reference_torque = _take(at, known, p)
    at, skew_residual = _take(at, 1, known)
    at, coriolis_residual = _take(at, 1, known)
    at, lyapunov = _take(at, 1, judged)
    at, lyapunov_change = _take(at, judged, CAUSE_COUNT)
    at, mass_before = _take(at, known, p * p)
    at, reference_torque_before = _take(at, known, p)
    at, v_d_before = _take(at, known, p)
    at, pending = _take(at, judged, CAUSE_COUNT)
    at, q_d_rate = _take(at, n, p)
    at, rho_hat_rate = _take(at, n, p)
    at, force_before = _take(at, n, p)
    at, rotation = _take(at, p, p)
    at, touching = _take(at, 2, PAIRS_PER_ROBOT * n)
    at, latched = _take(at, n, phases)
    at, held = _take(at, n, p + 3)
    at, fresh = _take(at, 1, n)
    at, tasks = _take(at, (2 + MAX_CYCLES) * MAX_LEVELS, p)
    at, clock = _take(at, 1, CLOCK_SIZE)
    at, switching = _take(at, 1, n * p)
    at, stack = _take(at, 1, 2 * STACK_DEPTH)
    told, differentiating = _law_rows(x, n)
    at, model_mass = _take(at, told, p * p)
    at, model_bias = _take(at, told, p)
    at, v_d_filtered = _take(at, differentiating, p)
    at, v_d_rate = _take(at, differentiating, p)
    at, command = _take(at, n, p)
    at, vertices = _take(at, int(x[27]), p)
    at, predecessors = _take(at, int(x[6]), n)
    at, chord_length = _take(at, 1, 1)
    at, scratch = _take(at, 1, scratch_size(n, p) if x[35] > 0.0 and x[27] > 0.0 else 0)
    return State(
        time[0], q, v, q_measured, v_measured, q_d, v_d, e, e_dot, s, tau, rho_hat, disturbance,
        target_position[0], target_velocity[0], avoidance_active[0], lost[0],
        phase[0], ruling[0], task_error, task_wish, task_removed, task_angle, outer_updates[0],
        force, obstacle_distance,
        robot_distance_min[0], obstacle_clearance_worst[0], robot_clearance_worst[0],
        contacts[0], contact_force[0], contact_onsets[0],
        saturated_time[0], effort[0], work[0], force_variation[0], qpos[0],
        mass_matrix, mass_coupling[0], bias_force, external_force, reference_torque,
        skew_residual[0], coriolis_residual[0], lyapunov[0], lyapunov_change,
        mass_before, reference_torque_before, v_d_before, pending,
        q_d_rate, rho_hat_rate, force_before, rotation, touching,
        latched, held, fresh[0], tasks, clock[0], switching[0], stack[0],
        model_mass, model_bias, v_d_filtered, v_d_rate,
        command, vertices, predecessors, chord_length[0], scratch[0],
    )  # fmt: skip


def state_size(plan: Array) -> int:
    """Length of the state vector that belongs to a packed plan."""
    views = unpack_state(plan.ctypes.data, DOUBLE, int(plan[2]))  # of memory that nobody looks at
    return sum(view.size for view in views)
