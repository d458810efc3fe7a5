"""The law once more, in plain NumPy and straight from the paper: the oracle of the kernels.

Here the team is one vector of p n coordinates. A behavior is a task with the paper's block-diagonal
Jacobian J, shape (n, p n); its velocity is J^+ Lambda sigma~ and its null space I - J^+ J, with
`numpy.linalg.pinv` for J^+. Nothing is simplified, so this code and the kernels share neither a line
nor a closed form. It is slow, and it is what the kernels are held against.

Unless said otherwise q, v, e are of the whole team, shape (n, p) [m], [m/s], [m], world frame.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import tests.oracle.set_based  # noqa: F401 (registers its velocities)
from escort_mj.components.views import LawView
from escort_mj.control.outer_loops import BarrierFilter, SetBased
from escort_mj.control.setup import Setup
from tests.oracle.behaviors import turned_rotation
from tests.oracle.conflicts import Tasks, weigh
from tests.oracle.failure import KnownRobots, motors
from tests.oracle.knowing import Minds
from tests.oracle.laws import force
from tests.oracle.opponents import Threats, Watch
from tests.oracle.outer_loops import velocities
from tests.oracle.places import GoalsReached, Places
from tests.oracle.sensing import Instruments, Scanner
from tests.oracle.setup import setup_now
from tests.oracle.supervisor import Supervisor
from tests.oracle.task import Situation
from tests.oracle.teammates import places_heard, places_known
from tests.oracle.teams import Teams
from tests.oracle.trigger import Holder

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class ReferenceSignals(NamedTuple):
    """One evaluation of the law; names, units and meanings as in `escort_mj.signals`."""

    q_measured: Array  # (n, p)
    v_measured: Array  # (n, p)
    q_d: Array  # (n, p)
    v_d: Array  # (n, p)
    e: Array  # (n, p)
    e_dot: Array  # (n, p)
    s: Array  # (n, p)
    tau: Array  # (n, p)
    rho_hat: Array  # (n, p)
    disturbance: Array  # (n, p)
    target_position: Array  # (p,)
    target_velocity: Array  # (p,)
    target_position_measured: Array  # (p,)
    target_velocity_measured: Array  # (p,)
    avoidance_active: Mask  # (n,)
    lost: Mask  # (n,)
    command: Array  # (n, p)
    phase: Array  # (n,)
    ruling: Array  # (n,)
    task_error: Array  # (n, behaviors)
    task_wish: Array  # (n, behaviors)
    task_removed: Array  # (n, behaviors)
    task_angle: Array  # (n, behaviors)
    outer_updates: Array  # (n,)
    target_estimate: Array  # (n, p), or (0, p) where robots have no estimates of their own
    target_velocity_estimate: Array  # likewise


class ReferenceController:
    """The whole law with its state: reference position q_d [m] and estimate rho_hat [N], both (n, p).

    Args:
        setup: What the controller is given.
        stride: Every so many physics steps a sample is taken; the task signals are computed in those only.
        extra: Physics steps of further samples.
    """

    def __init__(self, setup: Setup, stride: int = 25, extra: Collection[int] = ()) -> None:
        self.setup, self.stride, self.extra = setup_now(setup), stride, extra

    def reset(self, q0: Array) -> None:
        """Starts a mission at the true initial positions: q_d(0) = q(0), rho_hat(0) as the law says."""
        self.q_d = np.array(q0, dtype=np.float64)
        self.rho_hat = self.setup.by_robot("estimate_at_start")[:, None] + np.zeros_like(self.q_d)
        self._time: float | None = None
        self._instruments = Instruments(self.setup)
        self._scanner = Scanner()
        self._team = KnownRobots.whole(self.setup)
        self._applied = self._applied_before = np.zeros_like(self.q_d)
        self._rotation = np.eye(self.setup.axes)
        self._minds = Minds(self.setup) if self.setup.estimating else None
        self._watch = Watch(self.setup) if self.setup.opponents else None
        self._threats: Threats | None = None
        self._teams = Teams(self.setup) if self.setup.teams else None
        if self._minds is not None and self._teams is not None:
            self._minds.rotation = self._teams.rotation  # changed in place by both
        self._goals, self._places = GoalsReached(self.setup), Places(self.setup)
        self._q_d_rate = np.zeros_like(self.q_d)
        self._rho_hat_rate = np.zeros_like(self.q_d)
        self._supervisor, self._holder = Supervisor(self.setup), Holder(self.setup)
        self._v_d, self._avoiding = np.zeros_like(self.q_d), np.zeros(self.setup.count, dtype=bool)
        self._updates = np.zeros(self.setup.count)
        self._memory: dict[str, Array] = {}
        by_behavior = np.zeros((self.setup.count, len(self.setup.kinds)))
        self._tasks = Tasks(self._updates, *[by_behavior] * 4)
        self._v_d_before, self._a_d = self._v_d, np.zeros_like(self.q_d)
        self._law_memory = np.zeros((len(self.setup.law.memories()), *self.q_d.shape))
        self._law_memory_rate = np.zeros_like(self._law_memory)

    def evaluate(
        self,
        t: float,
        q: Array,
        v: Array,
        mass: Array | None = None,
        bias: Array | None = None,
        obstacle_points: Array | None = None,
        target_state: tuple[Array, Array] | None = None,
        headings: Array | None = None,
    ) -> ReferenceSignals:
        """Advances the state if time has advanced, then evaluates the law.

        Args:
            t: Time [s]; the state moves one timestep if this is later than at the last evaluation.
            q: True positions, shape (n, p) [m].
            v: True velocities, shape (n, p) [m/s].
            mass: Mass matrix of each robot, for laws that are given it, shape (n, p, p) [kg]; None for 1 kg.
            bias: Bias force, likewise, shape (n, p) [N]; None for none.
            obstacle_points: What each robot, and last the target, sees of each obstacle, shape
                (n + 1, m, p) [m]; None for centers that rest.
            target_state: Position [m] and velocity [m/s] of a target that can be bumped, shape (p,) each;
                None for one that moves as commanded.
            headings: Which way robots look that do not see all around, shape (n, p) [1].
        """
        if obstacle_points is not None:
            self.setup = replace(self.setup, obstacle_points=obstacle_points)
            self._supervisor.setup = self._holder.setup = self.setup
        setup, law = self.setup, self.setup.law
        first, before = self._time is None, self._v_d
        moved = self._time is None or t > self._time
        if self._time is not None and moved:
            self.q_d = self.q_d + setup.timestep * self._q_d_rate
            self.rho_hat = self.rho_hat + setup.timestep * self._rho_hat_rate
            self._applied_before = self._applied
        self._time = t

        true_target = target_state or (setup.target.position(t), setup.target.velocity(t))
        if self._watch is not None and moved:
            self._watch.judge(t, q, true_target[0], self._team.lost, setup)
        q_m, v_m, target, target_velocity = self._instruments.read(t, moved, q, v, *true_target)
        if setup.sensing.lidar is not None:
            if moved:
                self._returns = self._scanner.returns(t, q, q_m, setup)
            seen = np.concatenate([self._returns, setup.obstacles_seen()[-1:]])
            setup = self.setup = replace(setup, obstacle_points=seen)
            self._supervisor.setup = self._holder.setup = setup
        push = np.zeros(q.shape)
        if setup.disturbance is not None:
            push += setup.disturbance.position(t)

        if self._teams is not None and moved:
            self._team = self._teams.form(t, q_m, self._team, setup)
        noticed = self._team  # whom it has lost by now is noticed after robots have looked and talked
        team, self._rotation = noticed.at(t, q_m, target, self._rotation, setup)
        self._team, lost = team, team.lost
        n, mates, heard = len(q), None, None
        if self._watch is not None and moved:
            self._threats = self._watch.assign(q_m, target, lost, setup, self._teams)
        c, c_dot = np.tile(target, (n, 1)), np.tile(target_velocity, (n, 1))
        members = None if self._teams is None else self._teams.members
        mail = None if self._minds is None else self._minds.mail
        if self._teams is not None:
            c, c_dot = self._teams.center[members], self._teams.velocity[members]
        if self._minds is not None:
            if moved:
                self._minds.follow(setup)
                measured = q_m, v_m, c, c_dot
                self._minds.update(t, q, measured, true_target[0], noticed.lost, self._teams, headings)
            c, c_dot = self._minds.estimate(t)
            if self._minds.auction is not None:
                team = replace(team, vertices=self._minds.auction.taken())
        if setup.apart:
            mates = places_known(t, q_m, lost, members, mail)
        if mail is not None:
            heard = places_heard(t, q_m, lost, setup, mail)
        e = self.q_d - q_m
        phase = self._supervisor.choose(t, q_m, c, lost, members)
        held = self._v_d - c_dot * setup.target_feedforward
        if moved:
            self._goals.choose(q_m, phase)
            self._places.place(t, q_m, lost, target, target_velocity, phase, self._goals)
        fresh = self._holder.fires(t, q_m, c, held, phase, self._avoiding, self._supervisor, lost, heard)
        if moved and fresh.any() and setup.figure is not None:
            if self._minds is not None:
                self._minds.turn(t, q_m, team, self._teams)
            elif self._teams is not None:
                self._teams.turn(q_m, team)
            else:
                self._rotation = turned_rotation(self._rotation, q_m[~lost], target, team.vertices[~lost])
        apart, rotation = (
            self._minds or self._teams,
            np.broadcast_to(self._rotation, (n, *self._rotation.shape)),
        )
        now = Situation(
            setup, team, rotation if apart is None else apart.rotation, q_m, v_m, e, c, c_dot,
            self._goals.point, self._goals.velocity, t, mates, self._threats, members,
            heard=heard,
        )  # fmt: skip
        tasks = self._compose(now, phase, fresh)
        self._updates = self._updates + (fresh & moved & ~lost)
        v_d, active = self._v_d, self._avoiding
        if moved:
            self._v_d_before, self._a_d_before = v_d if first else before, self._a_d
        if any(each.differentiates for each in setup.all_laws):
            lag = setup.by_robot("filter_time", members)[:, None]
            self._a_d = (v_d - self._v_d_before + lag * self._a_d_before) / (lag + setup.timestep)
        e_dot = v_d - v_m
        s = e_dot + setup.by_robot("slope", members)[:, None] * e
        mass = np.broadcast_to(np.eye(setup.axes), (*q.shape, setup.axes)) if mass is None else mass
        bias = np.zeros(q.shape) if bias is None else bias
        if moved:
            self._law_memory = self._law_memory + setup.timestep * self._law_memory_rate
        robots = LawView(
            setup.timestep, law.slope, np.array([t]), q_m, v_m, self.q_d, v_d, e, e_dot, s, setup.force_limit,
            mass.reshape(len(q), -1), bias, self._a_d, self.rho_hat, self._law_memory, np.zeros(1),
            np.zeros_like(e), np.zeros_like(e), np.zeros_like(self._law_memory), np.zeros_like(e),
        )  # fmt: skip
        tau, rate = np.zeros_like(e), np.zeros_like(e)
        for number, each in enumerate(setup.all_laws):
            mine = setup.laws_of(members) == number
            robots.rho_hat_rate[:] = 0.0
            force(each, robots)  # type: ignore[attr-defined]
            tau[mine], rate[mine] = robots.tau[mine], robots.rho_hat_rate[mine]
        self._law_memory_rate = robots.component_rate

        anti_windup = setup.by_robot("anti_windup", members)[:, None] > 0.0
        outward = (np.abs(tau) > setup.force_limit[:, None]) & (s * tau > 0.0) & anti_windup
        tau[lost] = 0.0
        self._q_d_rate = np.where(outward | lost[:, None], v_m, v_d)
        self._rho_hat_rate = np.where(outward | lost[:, None], 0.0, rate)
        command = motors(t, tau, self._applied_before, setup)
        self._applied = np.clip(command, -setup.force_limit[:, None], setup.force_limit[:, None])
        return ReferenceSignals(
            q_m, v_m, self.q_d, v_d, e, e_dot, s, tau, self.rho_hat, push, *true_target, target,
            target_velocity, active, lost, command, phase.astype(float), *tasks, self._updates,
            *(known[:0] if self._minds is None else known for known in (c, c_dot)),
        )  # fmt: skip

    def _compose(self, now: Situation, phase: NDArray[np.int64], fresh: Mask) -> Tasks:
        """Runs the outer loop of each phase, for the robots that it rules; returns the task signals."""
        setup, team = now.setup, now.team
        step = round((self._time or 0.0) / setup.timestep)
        sampled = step % self.stride == 0 or step in self.extra
        chosen: dict[int, Tasks] = {}
        v_d, avoiding = self._v_d.copy(), self._avoiding.copy()
        memory = {name: array.copy() for name, array in self._memory.items()}
        for number in sorted(set(phase.tolist())):
            stack = self._supervisor.stack(number)
            then = replace(
                now, held=np.where(fresh[:, None], np.nan, self._v_d),
                memory={name: array.copy() for name, array in self._memory.items()},
            )  # fmt: skip
            wanted, active = velocities(self.setup.outer, stack, then)
            mine = (phase == number) & (fresh | isinstance(setup.outer, SetBased | BarrierFilter))
            for name, array in then.memory.items():
                memory.setdefault(name, array.copy())[mine] = array[mine]
            v_d[mine], avoiding[mine] = wanted[mine], active[mine]
            if sampled:
                chosen[number] = weigh(stack, now)
        v_d[team.lost], avoiding[team.lost] = 0.0, False
        self._v_d, self._avoiding, self._memory = v_d, avoiding, memory
        if not sampled:
            return self._tasks
        rows = [[signal[i] for signal in chosen[int(number)]] for i, number in enumerate(phase)]
        self._tasks = Tasks(*(np.array(signal) for signal in zip(*rows, strict=True)))
        return self._tasks
