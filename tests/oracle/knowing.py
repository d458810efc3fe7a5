"""What robots come to know of their targets by what they see, hear and estimate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.setup import Setup
from escort_mj.estimators.belief import EstimatorView
from escort_mj.knowledge.belief import LEAST_VARIANCE, MADE
from escort_mj.knowledge.sight import TargetSight, variances
from escort_mj.native.fields import declared
from escort_mj.native.memory import shape_of
from escort_mj.numerics.gaussian import START
from tests.oracle.behaviors import turned_rotation
from tests.oracle.estimators import Belief, believe, believed, update
from tests.oracle.failure import KnownRobots
from tests.oracle.noise import normal
from tests.oracle.radio import Auction, Mail, Message
from tests.oracle.sight import SightedBody, look
from tests.oracle.teammates import places_known
from tests.oracle.teams import Teams

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def looks_apart(sight: TargetSight, timestep: float) -> int:
    """Return how many steps of so many seconds are between two looks."""
    return 1 if sight.rate is None else max(round(1.0 / (sight.rate * timestep)), 1)


class Minds:
    """What each robot of a team knows."""

    def __init__(self, setup: Setup) -> None:
        self._setup, self._new = setup, True
        self.mail = Mail(setup) if setup.radio is not None else None
        variance, of_way = variances(setup.sight or TargetSight(), setup)
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
        if setup.sight is not None and step % looks_apart(setup.sight, setup.timestep) == 0:
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
                    update(estimator, view, i)
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
                    update(estimator, view, i)
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
    sizes = {"n": n, "estimating": n, "p": p, "believed": size, "hearing": 1, "depth": 1, "made": MADE}
    fields = declared(EstimatorView).items()
    blank = {name: np.zeros(shape_of(field, sizes)) for name, field in fields if field.kind is np.ndarray}
    return EstimatorView(timestep=0.0, way_variance=0.0, **blank)
