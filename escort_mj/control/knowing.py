"""What each robot knows, step by step: it looks, tells, hears, and estimates where the target is."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.vertices import turned_rotation
from escort_mj.components.component import number_of, reader
from escort_mj.components.dispatch import one_of
from escort_mj.control.custom.calls import custom_estimator
from escort_mj.control.nsb import block_at
from escort_mj.estimators import ESTIMATORS, Estimator, EstimatorView
from escort_mj.estimators.estimator import estimator_view
from escort_mj.estimators.kalman import believe, believed
from escort_mj.knowledge.auction import Auction, begin_auction, hear_bids
from escort_mj.knowledge.belief import LEAST_VARIANCE, Belief, carry, target_shown, target_speed_shown
from escort_mj.knowledge.links import NOBODY
from escort_mj.knowledge.messages import NEVER, Mail, Message, begin_radio, send
from escort_mj.knowledge.sight import Sight, SightedBody, look, sight_target, variances
from escort_mj.knowledge.teammates import places_known
from escort_mj.native.fields import Fields, Value, declared
from escort_mj.native.kernels import inlined, reachable, view_addresses
from escort_mj.native.lanes import WIDTH, everywhere, load, load_rows, row_of, set_row, stack_rows, store_rows
from escort_mj.native.memory import shape_of
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.gaussian import START, normal, normals

if TYPE_CHECKING:
    from escort_mj.control.failure import KnownRobots
    from escort_mj.control.setup import Setup
    from escort_mj.control.teams import Teams
    from escort_mj.memory.layout import Plan, State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


UNSURE = -1.0  # in place of a density: there is no covariance


class EstimatorParameters(Fields):
    """Which estimator robots have."""

    estimator: Annotated[int, Value("1", "place in ESTIMATORS")]
    estimator_place: Annotated[int, Value("1", "where its block in `parameters` begins")]
    estimate_moves: Annotated[bool, Value("1", "whether estimates move on between two measurements")]
    estimate_density: Annotated[
        float, Value("m^2/s^3", "of the noise that it expects; -1 where it does not say how sure it is")
    ]

    @classmethod
    def packed(cls, setup: Setup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {
            "estimator": number_of(setup.estimator, ESTIMATORS),
            "estimate_moves": setup.estimator.predicts,
            "estimate_density": setup.estimator.density if setup.estimator.has_covariance else UNSURE,
        }


@on_demand
def know(plan: Plan, state: State) -> None:
    """Lets robots look, send and hear, as far as that is due, and moves their estimates on.

    Args:
        plan: Gives sight, radio and estimator.
        state: Gives time, truth and measurements; beliefs, messages and estimates are written.
    """
    n, step, talks = state.q.shape[0], int(state.step[0]), state.link_from.shape[0] > 0
    first = state.evaluated[0] == 0.0
    for i in range(n if first else state.told.shape[0]):
        if first or state.told[i] != 0.0:
            _begin(i, 0 if first else step, plan, state)
    if first:
        if talks:
            begin_radio(plan, state)
        if plan.auctioned:
            begin_auction(plan, state)
    if step % plan.sight_every == 0:
        sight_target(plan, state)
        state.message[0] = -1.0
        for i in range(n):
            if state.target_seen[i] != 0.0:
                _update(plan.estimator, i, plan, state)
    if talks and step >= state.radio_next[0]:
        send(plan, state)
    for i in range(n):
        state.team_news[i] = 0.0 if talks else 1.0
    if talks and step >= state.radio_next[1]:
        _deliver(step, plan, state)
    _move_estimates(plan, state)
    if state.sampled[0] != 0.0 or state.steps.shape[0] > 0:
        _note(plan, state)


@inlined
def _begin(i: int, draw: int, plan: Plan, state: State) -> None:
    """Starts with what robot i is told of its target, before the mission or when it has another one."""
    p, size = state.q.shape[1], state.belief.shape[1]
    drawn = state.belief_work[0, :size]
    c, c_dot = target_shown(i, plan, state), target_speed_shown(i, plan, state)
    normals(size, plan.seed, 1, START, i, draw, drawn)
    for k in range(size * size):
        state.belief_covariance[i, k] = 0.0
    for k in range(size):
        deviation = plan.start_deviation[k // p]
        state.belief[i, k] = deviation * drawn[k]
        state.belief_covariance[i, (size + 1) * k] = max(deviation * deviation, LEAST_VARIANCE)
    for k in range(p):
        state.belief[i, k] += c[k]
        state.belief[i, p + k] += c_dot[k]
    state.belief_time[i] = state.belief_fix[i] = state.time[0]


@inlined
def _deliver(step: int, plan: Plan, state: State) -> None:
    """Hands messages over that arrive now: slot by slot, the oldest first."""
    (n, slots), depth, upcoming = state.link_from.shape, state.sent_step.shape[1], NEVER
    for i in range(n):
        for s in range(slots):
            j = int(state.link_from[i, s])
            if j < 0:
                continue
            link, newest = i * slots + s, int(state.messages_sent[j])
            for number in range(max(newest - depth, 0), newest):
                arrival = state.link_arrival[link, number % depth]
                if arrival < 0.0:
                    continue
                if arrival > step:
                    upcoming = min(upcoming, arrival)
                    continue
                state.link_arrival[link, number % depth] = NOBODY
                state.messages_heard[i] += 1.0
                if state.sent_step[j, number % depth] > state.link_step[i, s]:
                    state.link_step[i, s] = state.sent_step[j, number % depth]
                    message = j * depth + number % depth
                    for k in range(state.q.shape[1]):
                        state.heard_position[link, k] = state.sent_position[message, k]
                        state.heard_velocity[link, k] = state.sent_velocity[message, k]
                    if plan.team_radius.shape[0] > 0 and not _of_own_targets(i, s, message, state):
                        continue
                    state.team_news[i] = 1.0
                    _agree(i, message, state.link_step[i, s], plan, state)
                    if plan.auctioned:
                        hear_bids(i, message, plan, state)
                    state.message[0] = message
                    _update(plan.estimator, i, plan, state)
    state.radio_next[1] = upcoming


@inlined
def _of_own_targets(i: int, s: int, message: int, state: State) -> bool:
    """Whether a message, the newest in slot s of robot i, is about the targets that its team has now."""
    team = state.member_of[i]
    return state.sent_team[message] == team and state.link_step[i, s] >= state.team_aimed[int(team) - 1]


@inlined
def _agree(i: int, message: int, sent: float, plan: Plan, state: State) -> None:
    """Turns the figure of robot i toward that of a robot that it hears: a step of a consensus."""
    p, share = state.q.shape[1], 1.0 / (state.link_from.shape[1] + 1.0)
    if plan.team_radius.shape[0] > 0 and sent < state.team_formed[int(state.member_of[i]) - 1]:
        return  # that was another figure
    for a in range(p):
        for b in range(p):
            off = state.sent_rotation[message, a * p + b] - state.rotation[i, a, b]
            state.rotation[i, a, b] += share * off


@inlined
def _move_estimates(plan: Plan, state: State) -> None:
    """Writes where robots believe the target to be now, eight of them at once."""
    n, p = state.q.shape
    size = state.belief.shape[1]
    rows, place, speed = stack_rows(3 * p), stack_rows(p), stack_rows(p)
    moves = 1.0 if plan.estimate_moves else 0.0
    for i in range(0, n, WIDTH):
        load_rows(state.belief, i, rows[:size])
        elapsed = moves * (state.time[0] - load(state.belief_time, i))
        for k in range(p):
            bend = row_of(rows, 2 * p + k) if size > 2 * p else everywhere(0.0)
            ahead = row_of(rows, p + k) + 0.5 * elapsed * bend
            set_row(place, k, row_of(rows, k) + elapsed * ahead)
            set_row(speed, k, row_of(rows, p + k) + elapsed * bend)
        store_rows(state.target_estimate, i, place)
        store_rows(state.target_velocity_estimate, i, speed)


@inlined
def _note(plan: Plan, state: State) -> None:
    """Writes what is recorded only: how sure robots are, how old what they know is, and whom they hear."""
    n, p = state.q.shape
    slots, size = state.link_from.shape[1], state.belief.shape[1]
    x, covariance = state.belief_work[0, :size], state.belief_work[1]
    for i in range(n):
        state.information_age[i] = state.time[0] - state.belief_fix[i]
        for k in range(size * size):
            covariance[k] = state.belief_covariance[i, k]
        carry(x, covariance, p, state.time[0] - state.belief_time[i], plan.estimate_density)
        for a in range(p):
            for b in range(p):
                sure = plan.estimate_density != UNSURE
                state.target_covariance[i, a * p + b] = covariance[a * size + b] if sure else 0.0
        for s in range(slots):
            age = (state.step[0] - state.link_step[i, s]) * plan.timestep
            known = state.link_step[i, s] >= 0.0 and age <= plan.radio_timeout
            state.heard_from[i, s] = state.link_from[i, s] + 1.0 if known else 0.0


_inlined_once = cache(inlined)  # estimators share what they inherit


def _kernel_of(estimator: type[Estimator]) -> Callable[..., Any]:
    """Return a kernel that lets an estimator that ships change the belief of a robot."""
    update, read = _inlined_once(estimator.update_kernel), reader(estimator)

    def change(i: int, plan: Plan, state: State) -> None:
        plan_at, state_at = view_addresses(state)
        view = estimator_view(plan_at, state_at, state.q.shape[1])
        update(read(block_at(plan.estimator_place, plan), 0), view, i)

    return on_demand(reachable(change, f"update_by_{estimator.model_fields['estimator'].default}"))


_update = one_of([*map(_kernel_of, ESTIMATORS), custom_estimator])


# The same in plain NumPy.


class Minds:
    """What each robot of a team knows."""

    def __init__(self, setup: Setup) -> None:
        self._setup, self._new = setup, True
        self.mail = Mail(setup) if setup.radio is not None else None
        variance, of_way = variances(setup.sight or Sight(()), setup)
        blank = blank_view(setup.count, setup.axes, setup.estimator.orders * setup.axes)
        self.view = blank._replace(
            timestep=setup.timestep, way_variance=of_way, sight_variance=np.array(variance)
        )
        self.seen = np.zeros(setup.count)
        self.auction: Auction | None = None
        self.rotation = np.broadcast_to(np.eye(setup.axes), (setup.count, setup.axes, setup.axes)).copy()
        self._news = np.zeros(setup.count, dtype=bool)

    def follow(self, setup: Setup) -> None:
        """Take note of where obstacles are by now."""
        self._setup = setup
        if self.mail is not None:
            self.mail.setup = setup

    def update(
        self, t: float, q: Array, measured: tuple[Array, ...], target: Array, lost: Mask,
        teams: Teams | None = None, headings: Array | None = None,
    ) -> None:  # fmt: skip
        """Let robots look, tell and hear.

        Args:
            t: Time [s].
            q: True positions, shape (n, p) [m].
            measured: Robots' positions and velocities, and those of each robot's target, or of the middle of
                its team's targets, as the team's sensors show them, shape (n, p).
            target: True position of the target, shape (p,) [m].
            lost: Robots that have failed, shape (n,).
            teams: Who is in which team; None where all are one.
            headings: Which way robots look, shape (n, p) [1]; None where they see all around.
        """
        setup, (q_m, v_m, c, c_dot), view = self._setup, measured, self.view
        estimator, step = setup.estimator, round(t / setup.timestep)
        view.time[0], view.message[0], view.q_measured[:], view.v_measured[:] = t, -1.0, q_m, v_m
        if self._new:
            for i in range(setup.count):
                believe(self._told(i, t, 0, c[i], c_dot[i]), view, i)
            if setup.auctioned and setup.figure is not None:
                self.auction = Auction(q_m - view.belief[:, : setup.axes], setup.figure.vertices)
        elif teams is not None:
            for i in np.flatnonzero(teams.told).tolist():
                believe(self._told(i, t, step, c[i], c_dot[i]), view, i)
        self._new = False
        if setup.sight is not None and step % setup.sight.every == 0:
            for i in range(setup.count):
                targets = [SightedBody(target, setup.target_radius or 0.0)]
                if teams is not None:
                    own: list[int] = teams.targets[teams.members[i]]
                    targets = [
                        SightedBody(setup.obstacle_position[j], setup.obstacle_radius[j], j) for j in own
                    ]
                shown = c[i], c_dot[i]
                found = None if lost[i] else look(i, step, (q, headings), targets, shown, setup)
                self.seen[i] = found is not None
                if found is not None:
                    view.seen_position[i], view.seen_velocity[i] = found.position, found.velocity
                    view.seen_range[i], view.seen_bearing[i] = found.range, found.bearing
                    estimator.update(view, i)
        self._news = np.full(setup.count, self.mail is None)
        members = np.zeros(setup.count, dtype=int) if teams is None else teams.members
        if self.mail is not None:
            self.mail.send(
                t,
                q,
                lambda j, now: Message(
                    j,
                    now,
                    q_m[j],
                    v_m[j],
                    believed(view, j),
                    self.rotation[j].copy(),
                    int(members[j]),
                    self._bids(j),
                ),
                lost,
            )
            for i in range(setup.count):
                for message in self.mail.deliver(i, t):
                    if message.team != members[i]:
                        continue
                    if teams is not None and message.step < teams.aimed[members[i]]:
                        continue  # that was about other targets
                    said, view.message[0] = message.belief, 0.0
                    view.sent_belief[0], view.sent_covariance[0] = said.x, said.covariance.ravel()
                    view.sent_belief_time[0], view.sent_fix[0] = said.time, said.fix
                    estimator.update(view, i)
                    share = 1.0 / (len(self.mail.links[i]) + 1.0)
                    if teams is None or message.step >= teams.formed[members[i]]:
                        self.rotation[i] += share * (message.rotation - self.rotation[i])
                    self._news[i] = True
                    if self.auction is not None and message.bids is not None:
                        self.auction.hear(i, *message.bids)

    def turn(self, t: float, q: Array, team: KnownRobots, teams: Teams | None = None) -> None:
        """Let robots that have learned of teammates turn their figures.

        Args:
            t: Time [s].
            q: Measured positions, shape (n, p) [m].
            team: Who is left, in which figure.
            teams: As for `update`.
        """
        members = None if teams is None else teams.members
        mates, centers = places_known(t, q, team.lost, members, self.mail), self.estimate(t)[0]
        for i in np.flatnonzero(self._news & ~team.lost).tolist():
            vertices = team.vertices if self.auction is None else self.auction.known(i)
            known = np.isfinite(mates[i] + vertices).all(axis=1)
            left = ~team.lost if members is None else ~team.lost & (members == members[i])
            self.rotation[i] = turned_rotation(
                self.rotation[i], mates[i][known], centers[i], vertices[known], known.sum() / left.sum()
            )

    def _bids(self, j: int) -> tuple[Array, NDArray[np.int64]] | None:
        """Return the bids that robot j knows of; None where nobody bids."""
        auction = self.auction
        return None if auction is None else (auction.bid[j].copy(), auction.bidder[j].copy())

    def _told(self, i: int, t: float, draw: int, c: Array, c_dot: Array) -> Belief:
        """Return what a robot knows at the start, or when it has other targets."""
        setup, orders = self._setup, self._setup.estimator.orders
        deviation = np.repeat(setup.start_deviation[:orders], setup.axes)
        x = deviation * normal(len(deviation), setup.seed, START, i, draw)
        x[: 2 * setup.axes] += np.concatenate([c, c_dot])
        return Belief(x, np.diag(np.maximum(deviation**2, LEAST_VARIANCE)), t, t)

    def estimate(self, t: float) -> tuple[Array, Array]:
        """Return where robots believe the target to be, and how it moves, shape (n, p) [m, m/s]."""
        estimator, p = self._setup.estimator, self._setup.axes
        beliefs = [believed(self.view, i) for i in range(self._setup.count)]
        known = [b.at(t, p, estimator.density) if estimator.predicts else b for b in beliefs]
        return np.array([b.x[:p] for b in known]), np.array([b.x[p : 2 * p] for b in known])


def blank_view(n: int, p: int, size: int) -> EstimatorView:
    """Return memory for what the estimators of n robots see and write, with one message at a time."""
    sizes = {"n": n, "informed": n, "p": p, "believed": size, "hearing": 1, "depth": 1}
    fields = declared(EstimatorView).items()
    blank = {name: np.zeros(shape_of(field, sizes)) for name, field in fields if field.kind is np.ndarray}
    return EstimatorView(timestep=0.0, way_variance=0.0, **blank)
