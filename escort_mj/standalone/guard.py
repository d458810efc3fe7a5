"""Watches the measurements and calls of a controller; where a limit is exceeded, it acts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import UsageError
from escort_mj.standalone.limits import Event, Limits

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CAUSES = ("age", "speed", "jump", "area", "frozen")
AT_ONCE = ("age", "area", "frozen")  # robots that exceed these are out at once
REST = 0.02  # speed below which a stopping robot is held where it is; at ten times this, no more [m/s]
SLACK = 1e-6  # by which times may differ that are the same on a clock of today [s]
HOLD = (
    0.1  # farthest from where it came to rest that a robot is drawn back; beyond, it is held where it is [m]
)
HARD = 0.5  # share of the force limit that moves a robot
MILLI = 1e-3
NARROW = 0.05  # extent of a team whose coordinates may be degrees
LONG = 100.0  # coordinates that may be millimeters


class Watch(NamedTuple):
    """What is known of the robots; arrays only, so that it can be saved.

    Attributes:
        q: Last usable position of each robot, shape (n, p) [m].
        v: Velocity measured with it, shape (n, p) [m/s].
        stamp: Time of that measurement, shape (n,) [s]; -inf for none.
        raw: Last measurement, usable or not: position and velocity, shape (n, 2 p).
        changed: Time since which the digits have been the same although the robot must move, shape (n,) [s].
        since: Call since which measurements have been usable, shape (n,) [s]; inf for none.
        out: Whether the robot is out, shape (n,).
        back: When it came back, shape (n,) [s]; -inf for never out.
        held: Its command then, shape (n, p) [N].
        told: Whether the event of a cause has been noted and still lasts, shape (n, causes).
        guess: Velocity by the last usable measurement and the commands since then, shape (n, p) [m/s].
        anchor: Where a robot that has come to rest is held, shape (n, p) [m].
        anchored: Whether it is, shape (n,).
        command: Last command, shape (n, p) [N].
        acted: Time of the last command, shape () [s]; NaN for none.
        called: Time of the last call with measurements, shape () [s]; NaN for none.
    """

    q: Array
    v: Array
    stamp: Array
    raw: Array
    changed: Array
    since: Array
    out: Mask
    back: Array
    held: Array
    told: Mask
    guess: Array
    anchor: Array
    anchored: Mask
    command: Array
    acted: Array
    called: Array


class Excess(NamedTuple):
    """A limit that is exceeded.

    Attributes:
        cause: The limit.
        robot: From 0; -1 for all.
        action: What it says.
        words: What was found and what is allowed.
    """

    cause: str
    robot: int
    action: str
    words: str


class Judgement(NamedTuple):
    """What is made of the measurements of one call.

    Attributes:
        watch: What is then known of the robots.
        events: What was done.
        stop: Cause and words of a stop of all robots; empty for none.
        fresh: Which robots have a usable measurement in this call, shape (n,).
        returned: Which robots come back in this call, shape (n,).
        ages: Time since each robot's last usable measurement, shape (n,) [s]; inf for none.
    """

    watch: Watch
    events: list[Event]
    stop: tuple[str, str]
    fresh: Mask
    returned: Mask
    ages: Array


class Guard:
    """Limits of one controller, and what is known of its robots.

    The methods that change it may be called from several threads.

    Attributes:
        limits: The limits.
        watch: What is known of the robots.
        events: What was done.
        stopped: Why all robots are to rest; empty while they are not.
        ages: Time since each robot's last usable measurement at the last call, shape (n,) [s].
    """

    def __init__(self, limits: Limits, mass: Array, force_limit: Array, axes: int) -> None:
        """Begin to watch.

        Args:
            limits: The limits.
            mass: Of each robot, shape (n,) [kg].
            force_limit: Largest force of each robot per axis, shape (n,) [N].
            axes: p.
        """
        self.limits, self._mass, self._most = limits, mass[:, None], force_limit[:, None]
        self._shape = len(mass), axes
        self.events: list[Event] = []
        self.stopped = ""
        self._lock = Lock()
        self.watch: Watch
        self.forget(np.zeros(self._shape))

    def forget(self, places: Array) -> None:
        """Begin again.

        Args:
            places: Where robots without a measurement are taken to be, shape (n, p) [m].
        """
        (n, p), never = self._shape, np.full(len(self._mass), -math.inf)
        nothing = np.zeros((n, p))
        with self._lock:
            if self.stopped:
                self._note(float(self.watch.called), -1, "user", "reset", "the mission starts again")
            self.stopped, self.ages = "", np.full(n, math.inf)
            self.velocity = nothing
            self.watch = Watch(
                q=places.copy(), v=nothing, stamp=never, raw=np.full((n, 2 * p), math.nan), changed=never,
                since=-never, out=np.zeros(n, bool), back=never, held=nothing,
                told=np.zeros((n, len(CAUSES)), bool), guess=nothing, anchor=nothing,
                anchored=np.zeros(n, bool), command=nothing, acted=np.array(math.nan),
                called=np.array(math.nan),
            )  # fmt: skip

    def judge(self, now: float, q: Array, v: Array, stamps: Array) -> Judgement:
        """Hold measurements against the limits; nothing changes yet.

        Args:
            now: Time of the call [s].
            q: Positions, shape (n, p) [m]; NaN for robots without a measurement.
            v: Velocities, shape (n, p) [m/s].
            stamps: Times of the measurements, shape (n,) [s].

        Raises:
            UsageError: If a limit is exceeded whose action is `error`.
        """
        was, limits = self.watch, self.limits
        usable: Mask = np.asarray(np.isfinite(np.hstack([q, v])).all(axis=1))
        raw = np.hstack([q, v])
        same = (raw == was.raw).all(axis=1)
        new = usable & ((stamps > was.stamp) | ((stamps == was.stamp) & ~same))  # not one that comes again
        raw = np.where(new[:, None], raw, was.raw)
        pushed = (np.abs(was.command) > HARD * self._most).any(axis=1)
        moves = same & ((v != 0.0).any(axis=1) | pushed)
        changed = np.where(new & ~moves, stamps, was.changed)
        found = {cause: np.zeros(len(q), bool) for cause in CAUSES}
        if limits.age is not None:
            found["age"] = new & (stamps - now > limits.age + SLACK)
        if limits.speed is not None:
            found["speed"] = new & (np.linalg.norm(v, axis=1) > limits.speed)
        if limits.jump is not None:
            found["jump"] = new & (np.linalg.norm(q - was.q, axis=1) > self._reach(stamps))
        if limits.area is not None:
            found["area"] = new & (limits.area.beyond(np.where(usable[:, None], q, 0.0)) > 0.0)
        if limits.frozen is not None:
            found["frozen"] = new & (stamps - changed > limits.frozen + SLACK)
        first = np.isneginf(was.stamp)
        fresh = new & ~(
            found["age"] | found["speed"] | found["jump"] | found["frozen"] | (found["area"] & first)
        )
        stamp = np.where(fresh, stamps, was.stamp)
        ages = now - stamp
        if limits.age is not None:
            found["age"] |= ages > limits.age + SLACK
        excesses = [*self._silence(now), *self._excesses(found, now, q, v, stamps, ages, usable)]
        self._refuse(excesses)
        return self._judged(now, excesses, found, fresh, ages, was._replace(
            q=np.where(fresh[:, None], q, was.q), v=np.where(fresh[:, None], v, was.v), stamp=stamp,
            raw=raw, changed=changed,
        ))  # fmt: skip

    def _judged(
        self,
        now: float,
        excesses: list[Excess],
        found: Mapping[str, Mask],
        fresh: Mask,
        ages: Array,
        watch: Watch,
    ) -> Judgement:
        """Say who is out, who is back, and whether all are to stop."""
        limits, was = self.limits, self.watch
        late = ages > (math.inf if limits.age is None else limits.age + SLACK)  # and not stamps of the future
        dropped = np.zeros(len(fresh), bool)
        for cause in AT_ONCE:
            dropped |= found[cause] & (getattr(limits, f"on_{cause}") == "drop") & ((cause != "age") | late)
        bad = np.any([*found.values()], axis=0)
        since = np.where(bad, math.inf, np.where(fresh, np.minimum(was.since, now), was.since))
        returned = was.out & fresh & ~dropped & (now - since >= limits.rejoin - SLACK)
        out = (was.out & ~returned) | dropped
        events, stop = [], ("", "")
        if self.stopped:
            return Judgement(watch._replace(since=since), [], stop, fresh, returned & False, ages)
        told = was.told & np.array([found[cause] for cause in CAUSES]).T
        for cause, robot, action, words in excesses:
            if action == "stop":
                stop = stop if stop[1] else (cause, words)
                continue
            column = CAUSES.index(cause)
            goes = bool(out[robot] and not was.out[robot] and cause in AT_ONCE)
            if goes or not (told[robot, column] or (cause == "age" and was.out[robot])):
                does = "it is out" if goes else "its measurement is not used"
                kind = "out" if goes else "ignored"
                events.append(Event(now, robot + 1, cause, kind, f"{words}; {does}"))
            told[robot, column] = True
        for robot in np.flatnonzero(returned).tolist():
            words = f"robot {robot + 1} is back: its measurements have been usable for {limits.rejoin:g} s"
            events.append(Event(now, robot + 1, "age", "back", words))
        if out.all() and not stop[1]:
            stop = ("age", "no robot is left")
        if stop[1]:
            out, returned, events = was.out, returned & False, []
        watch = watch._replace(
            since=since, out=out, told=told, back=np.where(returned, now, was.back),
            held=np.where(returned[:, None], was.command, was.held),
        )  # fmt: skip
        return Judgement(watch, events, stop, fresh, returned, ages)

    def settle(self, now: float, judged: Judgement, force: Array, velocity: Array) -> Array:
        """Take over what was judged, and return the command of each robot, shape (n, p) [N].

        Args:
            now: Time of the call [s].
            judged: What `judge` returned.
            force: Of the law, shape (n, p) [N]; not used when all robots stop.
            velocity: Reference velocities of the law, shape (n, p) [m/s].
        """
        with self._lock:
            last = self.watch
            kept = {name: getattr(last, name) for name in ("guess", "anchor", "anchored", "command", "acted")}
            self.watch, self.ages = judged.watch._replace(**kept, called=np.array(now)), judged.ages
            self.events.extend(judged.events)
            if judged.stop[1]:
                self._halt(now, *judged.stop)
            braking = self._brake(now, judged.fresh)
            rests = (judged.watch.out | bool(self.stopped))[:, None]
            share = self._share(now)
            command = np.where(rests, braking, share * force + (1.0 - share) * self.watch.held)
            self.velocity = np.where(rests, 0.0, share * velocity)
            self.watch = self.watch._replace(command=command, acted=np.array(now))
            return command.copy()

    def command(self, now: float) -> Array:
        """Return what robots are to do now: the last command, or the stop if no call has come for too long.

        Args:
            now: Present time [s].
        """
        with self._lock:
            called, silence = float(self.watch.called), self.limits.silence
            if not self.stopped and silence is not None and abs(now - called) > silence + SLACK:
                words = f"no call for {now - called:.3g} s; allowed are {silence:g} s (silence)"
                self._halt(now, "silence", words)
            if self.stopped:
                braking = self._brake(now, np.zeros(len(self._mass), bool))
                self.watch = self.watch._replace(command=braking, acted=np.array(now))
            return self.watch.command.copy()

    def halt(self, cause: str, words: str, now: float | None = None) -> None:
        """Let all robots come to rest until the mission starts again.

        Args:
            cause: The limit that is exceeded, `law` or `user`.
            words: Why.
            now: Present time [s]; None for that of the last call.
        """
        with self._lock:
            self._halt(float(self.watch.called) if now is None else now, cause, words)

    def save(self) -> dict[str, Any]:
        """Return copies of everything that later calls depend on."""
        with self._lock:
            kept = {name: np.array(value) for name, value in self.watch._asdict().items()}
            return kept | {
                "ages": self.ages.copy(),
                "velocity": self.velocity.copy(),
                "stopped": np.array(self.stopped),
            }

    def load(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `save` returned."""
        with self._lock:
            self.watch = Watch(**{name: np.array(saved[name]) for name in Watch._fields})
            self.ages, self.velocity = np.array(saved["ages"]), np.array(saved["velocity"])
            self.stopped = str(saved["stopped"])

    def _halt(self, now: float, cause: str, words: str) -> None:
        if not self.stopped:
            self.stopped, self.velocity = words, np.zeros(self._shape)
            self._note(now, -1, cause, "stop", f"all robots stop: {words}")

    def _note(self, now: float, robot: int, cause: str, action: str, words: str) -> None:
        self.events.append(Event(0.0 if math.isnan(now) else now, robot + 1, cause, action, words))

    def _share(self, now: float) -> Array:
        """Share of the law in the commands of robots that have come back, shape (n, 1)."""
        rejoin = self.limits.rejoin
        if rejoin == 0.0:
            return np.ones((len(self._mass), 1))
        return np.clip((now - self.watch.back) / rejoin, 0.0, 1.0)[:, None]

    def _brake(self, now: float, fresh: Mask) -> Array:
        """Return forces that bring robots to rest and hold them, shape (n, p) [N].

        Robots without a usable measurement brake by what their velocity must be after the commands since the
        last one; they are not held.
        """
        was, limits, time = self.watch, self.limits, self.limits.braking_time
        longest = max(limits.age or 0.0, limits.silence or 0.0, time)
        passed = 0.0 if np.isnan(was.acted) else min(max(now - float(was.acted), 0.0), longest)
        guess = np.where(fresh[:, None], was.v, was.guess + passed * was.command / self._mass)
        speed, stops = np.linalg.norm(guess, axis=1), was.out | bool(self.stopped)
        anchored = stops & (speed < np.where(was.anchored, 10.0 * REST, REST)) & (fresh | was.anchored)
        strayed = np.linalg.norm(was.q - was.anchor, axis=1) > HOLD
        anchor = np.where((anchored & (~was.anchored | strayed))[:, None], was.q, was.anchor)
        rate = min(1.0 / time, 0.5 / passed if passed else math.inf)
        pull = np.where((anchored & fresh)[:, None], rate**2 * (was.q - anchor), 0.0)
        self.watch = was._replace(guess=guess, anchor=anchor, anchored=anchored)
        return np.clip(-self._mass * (2.0 * rate * guess + pull), -self._most, self._most)

    def _reach(self, stamps: Array) -> Array:
        """How far robots can have come since their last usable measurements, shape (n,) [m]."""
        limits = self.limits
        assert limits.speed is not None and limits.jump is not None
        return np.asarray(limits.speed * (stamps - self.watch.stamp) + limits.jump)

    def _silence(self, now: float) -> Iterator[Excess]:
        """What is wrong with the time of a call."""
        called, longest = float(self.watch.called), self.limits.silence
        if longest is None or math.isnan(called) or 0.0 <= now - called <= longest + SLACK:
            return
        if now < called:
            words = f"time: found {now:g} s after {called:g} s; time must not step back (reset starts again)"
        else:
            words = (
                f"time: found {now:g} s after {called:g} s; allowed are at most {longest:g} s "
                "between two calls (silence); reset starts again"
            )
        yield Excess("silence", -1, self.limits.on_silence, words)

    def _excesses(
        self,
        found: Mapping[str, Mask],
        now: float,
        q: Array,
        v: Array,
        stamps: Array,
        ages: Array,
        usable: Mask,
    ) -> list[Excess]:
        """Return what each robot exceeds, in words."""
        limits, says = self.limits, Says(self.limits, self.watch, q)

        def age(i: int) -> str:
            if usable[i] and stamps[i] > now:
                ahead = f"{stamps[i] - now:.3g} s ahead of the call"
                return f"robot {i + 1}: its measurement is from {stamps[i]:g} s, {ahead}"
            if math.isinf(ages[i]):
                return f"robot {i + 1} has not been measured yet"
            old = f"its last usable measurement is {ages[i]:.3g} s old"
            return f"robot {i + 1}: {old}; allowed are {limits.age:g} s (age)"

        def speed(i: int) -> str:
            return says.speed(i, float(np.linalg.norm(v[i])))

        def jump(i: int) -> str:
            return says.jump(i, float(self._reach(stamps)[i]))

        def frozen(i: int) -> str:
            return f"robot {i + 1}: the same digits for over {limits.frozen:g} s though it must move (frozen)"

        words: dict[str, Callable[[int], str]] = {
            "age": age, "speed": speed, "jump": jump, "area": says.area, "frozen": frozen,
        }  # fmt: skip
        return [
            Excess(cause, i, getattr(limits, f"on_{cause}"), words[cause](i))
            for cause in CAUSES
            for i in np.flatnonzero(found[cause]).tolist()
        ]

    def _refuse(self, excesses: list[Excess]) -> None:
        if errors := [each.words for each in excesses if each.action == "error"]:
            raise UsageError("\n".join(errors))


class Says:
    """Words for measurements that cannot be: what was found, what is allowed, what may be mixed up."""

    def __init__(self, limits: Limits, watch: Watch, q: Array) -> None:
        self.limits, self.watch, self.q = limits, watch, q

    def speed(self, i: int, found: float) -> str:
        """Words for a robot that is too fast."""
        most = self.limits.speed
        assert most is not None
        hint = "; are these millimeters per second?" if 10.0 * most < found <= most / MILLI else ""
        return f"robot {i + 1} moves at {found:.4g} m/s; allowed are {most:g} m/s (speed){hint}"

    def jump(self, i: int, reach: float) -> str:
        """Words for a position that no robot can have reached."""
        q, was = self.q, self.watch
        away = np.linalg.norm(q[i] - was.q, axis=1)
        hint, other = "", int(away.argmin())
        if np.linalg.norm(MILLI * q[i] - was.q[i]) <= reach:
            hint = "; are these millimeters?"
        elif q.shape[0] == q.shape[1] and np.linalg.norm(q[:, i] - was.q[i]) <= reach:
            hint = "; are rows and columns exchanged?"
        elif other != i and away[other] <= reach:
            hint = f"; robot {other + 1} was there: are the robots exchanged?"
        found = f"robot {i + 1} is {away[i]:.4g} m from its last position"
        return f"{found}; it can have come {reach:.4g} m (jump){hint}"

    def area(self, i: int) -> str:
        """Words for a robot that is outside."""
        area, q, hint = self.limits.area, self.q, ""
        assert area is not None
        known = q[np.isfinite(q).all(axis=1)]
        if len(q) > 1 and np.ptp(known, axis=0)[:2].max() < NARROW and np.abs(known[:, :2]).max() <= 180.0:
            hint = "; are these degrees of latitude and longitude?"
        elif area.beyond(MILLI * q[i : i + 1])[0] <= 0.0 and np.abs(q[i]).max() > LONG:
            hint = "; are these millimeters?"
        elif q.shape[0] == q.shape[1] and area.beyond(q[:, i][None])[0] <= 0.0:
            hint = "; are rows and columns exchanged?"
        place = ", ".join(f"{x:.6g}" for x in q[i])
        beyond = area.beyond(q[i : i + 1])[0]
        return f"robot {i + 1} is at ({place}) m, {beyond:.4g} m outside of the area{hint}"
