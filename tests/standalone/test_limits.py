"""Limits of the controller: each limit with each action, robots out and back, the watchdog, the stop."""

import re
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from escort_mj import Area, Controller, EscortError, Limits
from escort_mj.errors import UsageError
from tests.standalone.test_controller import LAWS_OF_TEAMS, SPATIAL

Fault = Callable[[float, np.ndarray, np.ndarray, np.ndarray], None]
KEYS = "fifty_hertz"
STRICT: dict[str, Any] = {"speed": 3.0, "jump": 0.3, "area": Area.box([-20, -20], [20, 20])}
SQUARE: dict[str, Any] = {
    "duration": 2,
    "target": {"position": [0, 0]},
    "robots": {"positions": [[3, 0], [-3, 0.5]]},
    "mission": {"radius": 3},
}


class Flight:
    """Point masses under a controller; faults change what it is told."""

    def __init__(self, limits: Limits | None, keys: Any = KEYS, **options: Any) -> None:
        self.controller = Controller(keys, limits=limits, **options)
        self.q, self.steps = self.controller.start.copy(), 0
        self.v = np.zeros_like(self.q)
        self.forces: list[np.ndarray] = []
        self.velocities: list[np.ndarray] = []
        self.places: list[np.ndarray] = []

    def fly(self, seconds: float, fault: Fault | None = None) -> "Flight":
        c = self.controller
        for _ in range(round(seconds / c.timestep)):
            time = self.steps * c.timestep
            q, v, stamps = self.q.copy(), self.v.copy(), np.full(c.count, time)
            if fault is not None:
                fault(time, q, v, stamps)
            force = c(time, q, v, times=stamps)
            assert (np.abs(force) <= c.force_limit[:, None]).all() and np.isfinite(force).all()
            self.forces.append(force)
            self.velocities.append(c.velocity)
            self.v = self.v + c.timestep * force / c.mass[:, None]
            self.q = self.q + c.timestep * self.v
            self.places.append(self.q)
            self.steps += 1
        return self

    @property
    def told(self) -> list[tuple[int, str, str]]:
        return [(event.robot, event.cause, event.action) for event in self.controller.events]


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two states have the same bits."""
    return one.keys() == other.keys() and all(one[name].tobytes() == other[name].tobytes() for name in one)


def without(robot: int) -> Fault:
    def fault(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
        q[robot - 1] = np.nan

    return fault


@pytest.mark.parametrize("backend", ["native", "interpreted"])
@pytest.mark.parametrize("keys", [KEYS, SPATIAL, LAWS_OF_TEAMS])
def test_limits_that_nothing_exceeds_change_no_bit(keys: Any, backend: str) -> None:
    far = Limits(speed=100, jump=1, area=Area.sphere(np.zeros(3 if keys is SPATIAL else 2), 1e4))
    seconds = 0.2 if backend == "native" else 0.04
    one, other = (Flight(limits, keys, backend=backend).fly(seconds) for limits in (None, far))
    assert np.array_equal(one.forces, other.forces) and other.controller.events == []
    assert (one.controller.velocity == other.controller.velocity).all()
    assert (one.controller.ages == 0.0).all() and not one.controller.out.any() and not one.controller.stopped


@pytest.mark.parametrize("backend", ["native", "interpreted"])
def test_a_robot_that_is_not_measured_is_out_and_the_others_close_ranks(backend: str) -> None:
    flight = Flight(Limits(), backend=backend)
    flight.fly(1.0).fly(0.1, without(2))
    assert not flight.controller.out.any(), "100 ms are allowed"
    assert flight.controller.ages.tolist() == pytest.approx([0.0, 0.1, 0.0, 0.0])
    flight.fly(4.0 if backend == "native" else 0.5, without(2))
    signals = flight.controller.signals
    assert flight.told == [(2, "age", "out")] and signals["lost"].tolist() == [0, 1, 0, 0]
    assert "robot 2: its last usable measurement is 0.12 s old; allowed are 0.1 s (age)" in str(
        flight.controller.events[0]
    )
    assert np.linalg.norm(flight.v[1]) < 0.02 and (flight.velocities[-1][1] == 0.0).all(), "it has braked"
    if backend == "native":
        away = (flight.q - signals["target_position"])[[0, 2, 3]]
        gaps = [np.linalg.norm(away[i] - away[j]) for i, j in ((0, 1), (1, 2), (2, 0))]
        assert min(gaps) > 0.95 * 1.5 * np.sqrt(3.0), "a triangle"


@pytest.mark.parametrize("mode", ["force", "velocity"])
def test_a_robot_comes_back_without_a_jump_of_its_command(mode: str) -> None:
    flight = Flight(Limits(rejoin=0.5)).fly(1.0).fly(2.0, without(3)).fly(5.0)
    assert flight.told == [(3, "age", "out"), (3, "age", "back")]
    gone, back = (round(event.time / 0.02) for event in flight.controller.events)
    assert back * 0.02 == pytest.approx(3.5), "its measurements have been usable from 3.0 s on"
    commands = np.array(flight.forces if mode == "force" else flight.velocities)[:, 2]
    most = np.abs(np.diff(commands[gone + 20 :], axis=0)).max()
    assert np.abs(commands[back]).max() < 1e-6 and most < 0.1 * np.abs(commands[:gone]).max()
    signals = flight.controller.signals
    radius = np.linalg.norm(flight.q - signals["target_position"], axis=1)
    assert not signals["lost"].any() and np.abs(radius - 1.5).max() < 0.1, (
        "all four are at their places again"
    )


@pytest.mark.parametrize("keys", [KEYS, SPATIAL, LAWS_OF_TEAMS], ids=["plane", "space", "teams"])
def test_both_backends_drop_and_take_up_alike(keys: Any) -> None:
    def fault(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
        step = round(time / one.controller.timestep)
        if 5 <= step < 20:
            q[1] = np.nan
        if 10 <= step < 25:
            q[0] = np.nan

    unit = 0.02 if keys is KEYS else 0.002
    limits = Limits(age=5 * unit, rejoin=5 * unit)
    one, other = (Flight(limits, keys, backend=name) for name in ("native", "interpreted"))
    for flight in (one, other):
        flight.fly(40 * unit, fault)
    assert one.told == other.told and [told[2] for told in one.told] == ["out", "out", "back", "back"]
    np.testing.assert_allclose(one.forces, other.forces, rtol=0.0, atol=1e-8)


def lame(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
    stamps[1] -= 0.5


def fast(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
    v[1] = 3.1, 0.0


def leap(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
    q[1] += 4.0


def abroad(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
    q[1, 0] += 30.0


def stuck(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
    q[1], v[1] = (1.0, -3.0), (0.1, 0.0)


CASES = [
    ("age", Limits(), lame, "robot 2: its last usable measurement is 0.12 s old; allowed are 0.1 s"),
    ("speed", Limits(speed=3.0), fast, r"robot 2 moves at 3.1 m/s; allowed are 3 m/s \(speed\)"),
    ("jump", Limits(speed=3.0, jump=0.3), leap, r"robot 2 is 5.\d+ m from its last .* come 0.36 m \(jump\)"),
    (
        "area",
        Limits(area=STRICT["area"]),
        abroad,
        r"robot 2 is at \(\d+.*\) m, \d+.\d+ m outside of the area",
    ),
    ("frozen", Limits(frozen=0.2), stuck, r"robot 2: the same digits for over 0.2 s though it must move"),
]


@pytest.mark.parametrize(("cause", "limits", "fault", "words"), CASES, ids=[case[0] for case in CASES])
@pytest.mark.parametrize("action", ["error", "stop", "drop"])
def test_each_limit_with_each_action(
    cause: str, limits: Limits, fault: Fault, words: str, action: str
) -> None:
    limits = Limits(**{**vars(limits), f"on_{cause}": action})
    flight = Flight(limits).fly(1.0)
    if action == "error":
        with pytest.raises(UsageError, match=words):
            flight.fly(0.5, fault)
        assert flight.controller.events == [] and not flight.controller.stopped
        before = flight.controller.snapshot()
        with pytest.raises(UsageError, match=words):
            flight.fly(0.1, fault)
        assert same(before, flight.controller.snapshot())
        return
    flight.fly(1.0, fault)
    event = flight.controller.events[0]
    assert (event.cause, event.action) == (cause, {"stop": "stop", "drop": event.action}[action])
    assert re.search(words, event.message), event.message
    if action == "drop":
        assert event.robot == 2 and flight.controller.out.tolist() == [False, True, False, False]
        assert not flight.controller.stopped and np.abs(flight.forces[-1][0]).max() > 0.0
        assert flight.told[-1][2] == "out" and len(flight.told) <= 2
    else:
        assert re.search(words, flight.controller.stopped) and len(flight.told) == 1
        flight.fly(1.0)
        assert np.abs(flight.v).max() < 1e-3 and (flight.velocities[-1] == 0.0).all()
        assert len(flight.told) == 1, "a stop lasts"
        flight.controller.reset(flight.q)
        flight.fly(0.1)
        assert not flight.controller.stopped and flight.told[-1] == (0, "user", "reset")


@pytest.mark.parametrize(
    ("fault", "keys", "words"),
    [
        (lambda t, q, v, s: q.__imul__(1e3), KEYS,
        r"robot 1 is at \(2500, 1000\) m, .*are these millimeters\?"), (lambda t, q, v, s: v.__iadd__(500.0),
        KEYS, r"are these millimeters per second\?"), (lambda t, q, v, s: q.__imul__(9e-6) + q.__iadd__([48.1,
        11.5]), KEYS, r"are these degrees of latitude"),
    ],
    ids=["mm", "mm/s", "degrees"],
)  # fmt: skip
def test_other_units_stop_the_robots_before_they_move(fault: Any, keys: Any, words: str) -> None:
    flight = Flight(Limits(**STRICT), keys).fly(0.2, fault)
    assert not np.any(flight.forces) or words.endswith(r"second\?")
    assert len(flight.told) == 1
    assert re.search(words, flight.controller.stopped), flight.controller.stopped


def test_rows_that_are_exchanged_are_found_by_the_jump() -> None:
    flight = Flight(Limits(**STRICT)).fly(0.5)
    flight.fly(0.02, lambda t, q, v, s: q.__setitem__(slice(None), q[[0, 2, 1, 3]]))
    assert "robot 3 was there: are the robots exchanged?" in flight.controller.stopped
    turned = Flight(Limits(**STRICT), SQUARE).fly(0.5)
    turned.fly(0.02, lambda t, q, v, s: q.__setitem__(slice(None), q.T.copy()))
    assert turned.controller.stopped.endswith("are rows and columns exchanged?")


def test_a_measurement_that_comes_again_is_none() -> None:
    """A driver passes the last message, with its time, until another comes: no endless braking on it."""
    flight = Flight(Limits()).fly(0.5)
    q, v = flight.q[1].copy(), flight.v[1].copy()
    assert np.linalg.norm(v) > 0.1

    def again(time: float, places: np.ndarray, speeds: np.ndarray, stamps: np.ndarray) -> None:
        places[1], speeds[1], stamps[1] = q, v, 0.5

    flight.fly(1.5, again)
    assert flight.told == [(2, "age", "out")] and np.abs(flight.forces[-1][1]).max() < 1e-3
    assert np.linalg.norm(flight.v[1]) < 0.05
    flight.controller.stop()
    flight.fly(1.0, again)
    assert np.linalg.norm(flight.v[1]) < 0.05 and np.abs(flight.forces[-1][1]).max() < 1e-3


def test_a_glitch_is_ignored() -> None:
    flight = Flight(Limits(**STRICT, on_jump="drop")).fly(0.5).fly(0.04, leap).fly(1.0)
    assert flight.told == [(2, "jump", "ignored")] and not flight.controller.out.any()


def test_stamps_of_the_future_and_the_past_are_no_measurements() -> None:
    def ahead(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
        stamps[2] += 3600.0

    flight = Flight(Limits()).fly(0.5).fly(0.3, ahead)
    assert flight.told == [(3, "age", "ignored"), (3, "age", "out")]
    assert "3.6e+03 s ahead of the call" in flight.controller.events[0].message

    def outside(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
        q[1], stamps[1] = [30.0, 0.0], time + 3600.0

    flight = Flight(Limits(area=STRICT["area"], on_area="drop")).fly(0.5).fly(0.02, outside)
    assert (2, "area", "out") in flight.told and flight.controller.out.tolist() == [False, True, False, False]

    def late(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
        if round(time / 0.02) % 2:
            q[2], stamps[2] = (9.0, 9.0), time - 0.09

    flight = Flight(Limits()).fly(0.5).fly(0.5, late)
    assert flight.told == [] and (np.abs(flight.controller.signals["q"][2]) < 5.0).all(), (
        "out of order: not used"
    )


def test_without_a_call_the_driver_gets_the_stop() -> None:
    """The clock is given: nothing waits."""
    flight = Flight(Limits(silence=0.1)).fly(1.0)
    controller, last = flight.controller, flight.forces[-1]
    called, v = 0.98, flight.v
    assert np.linalg.norm(v) > 0.5
    for time in (called, called + 0.05, called + 0.1, called - 0.02):
        assert (controller.command(time) == last).all() and not controller.stopped
    for step in range(1, 100):
        force = controller.command(called + 0.1 + 0.02 * step)
        v = v + 0.02 * force / controller.mass[:, None]
        assert (np.abs(force) <= controller.force_limit[:, None]).all() and (controller.velocity == 0.0).all()
    assert controller.stopped == "no call for 0.12 s; allowed are 0.1 s (silence)"
    assert [event.action for event in controller.events] == ["stop"]
    assert np.abs(force).max() < 1e-6, "nobody pushes for ever on old velocities"
    back = controller(called + 3.0, flight.q, flight.v)
    assert (np.sign(back) == -np.sign(flight.v)).all() and controller.stopped, "a stop lasts until reset"


@pytest.mark.parametrize("jump", [3600.0, -3600.0, 0.12])
def test_clocks_that_jump_stop_the_robots(jump: float) -> None:
    flight = Flight(Limits()).fly(0.5)
    controller = flight.controller
    controller(0.48 + jump, flight.q, flight.v)
    assert "time: found" in controller.stopped
    refusing = Flight(Limits(on_silence="error")).fly(0.5)
    with pytest.raises(UsageError, match="time: found"):
        refusing.controller(0.48 + jump, refusing.q, refusing.v)
    assert not refusing.controller.stopped
    watching = Flight(Limits()).fly(0.5)
    watching.controller.command(0.48 + jump)
    assert watching.controller.stopped.startswith("no call for")


def test_a_stop_holds_robots_against_a_push() -> None:
    flight = Flight(Limits()).fly(1.0)
    controller = flight.controller
    controller.stop("the button")
    assert controller.stopped == "the button" and flight.told == [(0, "user", "stop")]
    flight.fly(1.0)
    places = flight.q.copy()
    for _ in range(200):
        time = flight.steps * 0.02
        force = controller(time, flight.q, flight.v)
        flight.v = flight.v + 0.02 * (force + 1.0) / controller.mass[:, None]
        flight.q = flight.q + 0.02 * flight.v
        flight.steps += 1
    assert np.abs(flight.q - places).max() < 0.1 and np.abs(flight.v).max() < 1e-3


def test_a_law_that_fails_stops_the_robots() -> None:
    gains = {"law": "pd", "proportional_gain": 1e308, "derivative_gain": 1e308}
    controller = Controller("main", {"robots.force_limit": None, "controller": gains}, limits=Limits())
    q = controller.start
    controller(0.0, q, np.zeros_like(q))
    with pytest.raises(EscortError, match="no finite force"):
        controller(0.002, q + 1e9, np.full_like(q, 1e9))
    assert "no finite force" in controller.stopped and controller.events[-1].cause == "law"
    assert np.isfinite(controller.command(0.004)).all()


def test_when_nobody_is_left_all_stop() -> None:
    def fault(time: float, q: np.ndarray, v: np.ndarray, stamps: np.ndarray) -> None:
        q[:] = np.nan

    flight = Flight(Limits()).fly(0.5).fly(2.0, fault)
    assert flight.controller.stopped == "no robot is left" and np.abs(flight.forces[-1]).max() < 1e-3
    alone = Flight(Limits()).fly(0.1, fault)
    assert alone.controller.stopped and not np.any(alone.forces)


def test_robots_that_are_there_from_the_beginning_begin() -> None:
    flight = Flight(Limits()).fly(2.0, without(4)).fly(4.0)
    assert flight.told == [(4, "age", "out"), (4, "age", "back")]
    assert "robot 4 has not been measured yet" in flight.controller.events[0].message
    controller = Controller(KEYS, limits=Limits())
    q = controller.start.copy()
    q[0] = np.nan
    controller.reset(q)
    controller(0.0, q, 0.0 * controller.start)
    assert controller.out.tolist() == [True, False, False, False] and np.isinf(controller.ages[0])


def test_a_saved_state_has_the_limits_in_it() -> None:
    flight = Flight(Limits()).fly(0.5).fly(0.5, without(2))
    saved, other = flight.controller.snapshot(), Flight(Limits())
    other.controller.restore(saved)
    other.q, other.v, other.steps = flight.q, flight.v, flight.steps
    for each in (flight, other):
        each.fly(1.0)
    assert np.array_equal(flight.forces[-50:], other.forces) and other.told == [(2, "age", "back")]
    flight.controller.stop()
    other.controller.restore(flight.controller.snapshot())
    assert other.controller.stopped == "stop was called"
    with pytest.raises(UsageError, match="of another mission, or of one that was set up otherwise"):
        Controller(KEYS).restore(saved)
    with pytest.raises(UsageError, match="of another mission, or of one that was set up otherwise"):
        Controller(KEYS, {"controller.slope": 3}, limits=Limits()).restore(saved)


def test_one_robot_counts_mates_out_that_it_does_not_hear() -> None:
    robot = Controller(KEYS, limits=Limits(silence=None)).robot(1)
    q, v = robot.team.start, np.zeros(2)
    for step in range(10):
        heard = {2: q[1], 3: q[2]} | ({4: q[3]} if step < 2 else {})
        robot(0.02 * step, q[0], v, heard)
    assert robot.out.tolist() == [False, False, False, True] and robot.events[0].robot == 4
    late = Controller(KEYS, limits=Limits()).robot(1)
    late(1.0, q[0], v, q, times={2: 0.85})
    assert late.out.tolist() == [False, True, False, False], "its position was 0.15 s old when it came"
    saved = robot.snapshot()
    robot.stop("off")
    assert robot.stopped == "off" and robot.command(0.2).shape == (2,)
    robot.restore(saved)
    assert not robot.stopped and robot.out.tolist() == [False, False, False, True]
    for wrong in (None, 3, {}, saved | {"known": saved["known"] * np.nan}, saved | {"heard_at": np.zeros(2)}):
        with pytest.raises(UsageError):
            robot.restore(wrong)


def test_a_driver_may_ask_from_another_thread() -> None:
    flight, done = Flight(Limits(silence=9.0), longest_gap=9.0), threading.Event()
    faults: list[BaseException] = []

    def ask() -> None:
        try:
            while not done.is_set():
                force = flight.controller.command(flight.steps * 0.02)
                assert np.isfinite(force).all()
        except BaseException as error:
            faults.append(error)

    thread = threading.Thread(target=ask)
    thread.start()
    flight.fly(4.0)
    done.set()
    thread.join()
    assert not faults and not flight.controller.stopped
    alone = Flight(Limits()).fly(4.0)
    assert np.array_equal(alone.forces, flight.forces)


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(
        st.tuples(st.sampled_from([1, 2, 3, 4]), st.integers(1, 60), st.booleans()), min_size=1, max_size=6
    )
)
def test_whoever_drops_out_and_comes_back(spells: list[tuple[int, int, bool]]) -> None:
    """Who is out follows from drawn spells without measurements; on a return, no command leaps."""
    flight = Flight(Limits(rejoin=0.2))
    unusable, since = np.zeros(4), np.full(4, np.inf)
    expected = np.zeros(4, dtype=bool)
    for robot, steps, missing in spells:
        for _ in range(steps):
            flight.fly(0.02, without(robot) if missing else None)
            gone = np.arange(4) == robot - 1 if missing else np.zeros(4, dtype=bool)
            unusable = np.where(gone, unusable + 1, 0)
            if flight.steps == 1:
                unusable[gone] = 1000  # never measured
            never = unusable >= 1000
            late = (unusable > 5) | never
            since = np.where(late, np.inf, np.where(gone, since, np.minimum(since, flight.steps)))
            back = expected & ~late & ~gone & (flight.steps - since >= 10)
            expected = (expected | late) & ~back
            if flight.controller.stopped:
                return
            assert flight.controller.out.tolist() == expected.tolist()
            for row in np.flatnonzero(back):
                before = flight.forces[-2][row] if len(flight.forces) > 1 else 0.0
                assert np.abs(flight.forces[-1][row] - before).max() < 1e-9, "it begins where it was"
    outs = sum(action == "out" for _, _, action in flight.told)
    backs = sum(action == "back" for _, _, action in flight.told)
    assert outs - backs == expected.sum()


class NoArray:
    """An argument that raises an error where NumPy asks for an array."""

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("no array")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Limits(age=0), "age: found 0; expected a number above 0 or None"),
        (lambda: Limits(age="1"), 'age: found "1"; expected'),
        (lambda: Limits(speed=np.nan), "speed: found NaN"),
        (lambda: Limits(speed=-1), "speed: found -1"),
        (lambda: Limits(jump=0.1), "jump: found a limit without speed"),
        (lambda: Limits(area=Area()), "area: found <.*; expected Area.box, Area.sphere or Area.polygon"),
        (lambda: Limits(area=3), "area: found 3; expected an Area or None"),
        (lambda: Limits(on_age="halt"), 'on_age: found "halt"; expected error, stop or drop'),
        (lambda: Limits(on_silence="drop"), 'on_silence: found "drop"; expected error or stop'),
        (lambda: Limits(age=None, speed=1, on_speed="drop"), 'on_speed: found "drop" without a limit on age'),
        (lambda: Limits(rejoin=-1), "rejoin: found -1"),
        (lambda: Limits(braking_time=np.inf), "braking_time: found infinity"),
        (lambda: Area.box([0, 0], [1]), r"high: found the shape \(1,\)"),
        (lambda: Area.box([[0], 0], [1, 1]), r"low: found a list of 2; expected least coordinates"),
        (lambda: Area.box([0, 0], NoArray()), r"high: found .*NoArray.*; expected largest coordinates"),
        (lambda: Area.box([0, 0], [1, 0]), r"high: found \[1.0, 0.0\]; expected coordinates above"),
        (lambda: Area.sphere([0, 0], 0), "radius: found 0; expected a length above 0"),
        (lambda: Area.sphere("x", 1), "center: found"),
        (lambda: Area.polygon([[0, 0], [1, 1]]),
        r"corners: found the shape \(2, 2\); expected at least three"), (lambda: Area.polygon(None),
        "corners: found None"), (lambda: Area.polygon([[0, 0], [1, 1], [1, 0]], low=2, high=1),
        "high: found 1; expected a height above low"), (lambda: Controller(KEYS, limits=3),
        "limits: found 3; expected a Limits or None"), (lambda: Controller(KEYS, limits=Limits(silence=1)),
        "limits.silence: found 1 s; allowed are at most 0.1 s"), (lambda: Controller(KEYS,
        limits=Limits(braking_time=0.05)), "limits.braking_time: found 0.05 s"), (lambda: Controller(KEYS,
        limits=Limits(area=Area.sphere([0, 0, 0], 1))), "limits.area: .* expected 2 axes"), (lambda:
        Controller(KEYS, limits=Limits(), simulate=True), "limits: found with simulate=True"), (lambda:
        Controller(KEYS).command(0.0), "command: this controller has no limits"), (lambda:
        Controller(KEYS).stop(), "stop: this controller has no limits"), (lambda: Controller(KEYS,
        limits=Limits()).command("now"), 'time: found "now"'), (lambda: Controller(KEYS,
        limits=Limits()).stop(3), "reason: found 3; expected a text"),
    ],
)  # fmt: skip
def test_limits_that_make_no_sense_are_refused(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        make()


@pytest.mark.parametrize(
    ("area", "inside", "outside"),
    [
        (Area.box([-1, -2], [3, 2]), [[0, 0], [3, 2]], [[3.1, 0], [0, -2.1]]),
        (Area.sphere([1, 1], 2), [[1, 1], [3, 1]], [[3.1, 1]]),
        (
            Area.polygon([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]]),
            [[0.5, 0.5], [3.5, 2.5]],
            [[2, 3], [-1, 0], [5, 5]],
        ),
        (Area.polygon([[0, 0], [0, 4], [4, 0]], 0, 2), [[1, 1, 1]], [[1, 1, 3], [1, 1, -1], [3, 3, 1]]),
    ],
)
def test_areas(area: Area, inside: list, outside: list) -> None:
    assert (area.beyond(np.array(inside, float)) <= 0.0).all() and (
        area.beyond(np.array(outside, float)) > 0.0
    ).all()
    assert (
        eval(repr(area), {"Area": Area}).beyond(np.array(inside, float)).tolist()
        == area.beyond(np.array(inside, float)).tolist()
    )
    assert repr(Limits(age=0.2)) == "Limits(age=0.2)"


@settings(max_examples=50)
@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=3, max_size=3),
    st.floats(-6, 6),
    st.floats(-6, 6),
)
def test_a_triangle_is_where_three_sides_agree(corners: list, x: float, y: float) -> None:
    """Against half planes."""
    points = np.array(corners)
    edges = np.roll(points, -1, axis=0) - points
    if abs(np.linalg.det(edges[:2])) < 1e-3:
        return
    to = np.array([x, y]) - points
    sides = edges[:, 0] * to[:, 1] - edges[:, 1] * to[:, 0]
    if np.abs(sides).min() < 1e-6:
        return
    inside = (sides > 0.0).all() or (sides < 0.0).all()
    assert (Area.polygon(points).beyond(np.array([[x, y]]))[0] <= 0.0) == inside


@pytest.mark.parametrize(
    "corners", [[[0, 0], [1, 1], [2, 2]], [[0, 0], [1, 1], [0, 1], [1, 0]], [[3, 3]] * 4]
)
def test_a_polygon_has_an_area(corners: list[list[float]]) -> None:
    with pytest.raises(EscortError, match="corners in order around an area"):
        Area.polygon(corners)
    Area.polygon([[100, 100], [101, 100], [100, 101]])
