"""Whether the simulation can be trusted: each check finds its own trouble, and no other."""

import numpy as np
import pytest

from escort_mj.expect.verdicts import judge_one
from escort_mj.expectations.sanity import SanityExpectation
from escort_mj.record.outcome import Outcome
from tests.expectations.traces import episode, watched

TIME = np.linspace(0.0, 10.0, 11)


def sanity(trace, *checks, outcome=Outcome.COMPLETED, **window):
    return judge_one(SanityExpectation(sanity=checks or "all", **window), trace, outcome)


def flown(speed, force=1.0, work=None):
    """Robot 1 (1 kg) at these speeds, its motor having done that work."""
    speeds = np.zeros((11, 2))
    speeds[:, 0] = speed
    work = 0.5 * speeds**2 if work is None else work
    return watched(speed_max=speeds, work=work, force=force)


def test_rest_is_sound():
    found = sanity(watched())
    assert found.held and found.demanded == "warnings, finite, energy, tunneling"
    assert "no warning; all numbers finite; kinetic energy 0 J" in found.found


def test_warnings_are_an_unstable_outcome():
    found = sanity(watched(), outcome=Outcome.UNSTABLE)
    assert not found.held and found.found == "MuJoCo warned"
    assert sanity(watched(), "finite", outcome=Outcome.UNSTABLE).held


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_none(value):
    trace = watched()
    trace["force"][4, 1, 0] = value
    found = sanity(trace, "finite")
    assert (found.held, found.time) == (False, 4.0)
    assert found.found == "force is no finite number at 4.00 s"
    assert sanity(trace, "finite", after=5.0).held
    assert sanity(trace, "warnings", "tunneling").held


def test_nothing_to_be_clear_of_is_no_trouble_but_not_a_number_is():
    trace = watched()
    trace["clearance"][:], trace["target_clearance"][:] = np.inf, np.inf
    assert sanity(trace, "finite").held
    trace["clearance"][2, 0, 0] = np.nan
    assert not sanity(trace, "finite").held
    assert not sanity(watched(), "finite", outcome=Outcome.DIVERGED).held


class TestEnergy:
    def test_what_the_motor_gave(self):
        found = sanity(flown(TIME), "energy")
        assert found.held and found.unit == "J"

    def test_out_of_nothing(self):
        speed = np.where(TIME > 6.5, 3.0, 0.0)
        found = sanity(flown(speed, work=np.zeros((11, 2))), "energy")
        assert (found.held, found.time, found.bodies) == (False, 7.0, ("robot_1",))
        assert found.value == pytest.approx(4.5)
        assert found.margin < 0.0

    def test_a_step_from_rest_is_no_creation(self):
        # Sampled at every step: after the first the robot moves, and no work is booked before the second.
        trace = watched(end=0.02, speed_max=0.0, force=1.0)
        trace["force"][:, :, 1] = 0.0
        trace["speed_max"][1:, 0] = 0.002 * np.arange(1, 11)
        trace["work"][1:, 0] = np.cumsum(0.002 * 0.002 * np.arange(10))
        assert sanity(trace, "energy").held

    @pytest.mark.parametrize("what", ["disturbance", "gravity", "wind", "touch"])
    def test_others_may_push_too(self, what):
        speed = np.where(TIME > 4.5, 3.0, 0.0)
        trace = flown(speed, force=0.0, work=np.zeros((11, 2)))
        assert not sanity(trace, "energy").held
        if what == "disturbance":
            trace["disturbance"][:] = 5.0
        elif what == "touch":
            touch = episode("robot_1", "rock", 4.5, force=30.0, closing=3.0)
            trace = watched(touch, speed_max=trace["speed_max"].values)
        else:
            trace.attrs[what] = 9.81
        assert sanity(trace, "energy").held

    def test_a_touch_explains_nothing_that_came_before_it(self):
        speed = np.where(TIME > 4.5, 3.0, 0.0)
        touch = episode("robot_1", "rock", 7.0, force=30.0, closing=3.0)
        speeds = np.stack([speed, 0.0 * speed], axis=1)
        trace = watched(touch, speed_max=speeds)
        assert (sanity(trace, "energy").held, sanity(trace, "energy").time) == (False, 5.0)

    def test_a_touch_of_bodies_that_come_apart_takes_no_energy_from_the_bound(self):
        touch = episode("robot_1", "rock", 4.5, force=30.0, closing=-50.0)
        found = sanity(watched(touch, speed_max=0.0), "energy")
        assert found.held and found.value + found.margin >= 0.0


class TestTunneling:
    @pytest.mark.parametrize(("speed", "possible"), [(90.0, False), (110.0, True)])
    def test_closing_speed_against_the_thinnest_body(self, speed, possible):
        speeds = np.zeros((11, 2))
        speeds[3] = [speed, speed]  # 2 x 100 m/s x 2 ms = 0.4 m, a robot's diameter
        found = sanity(watched(speed_max=speeds), "tunneling")
        assert found.held != possible
        assert (found.value, found.time) == (pytest.approx(0.01 * speed), 3.0)
        assert found.margin == pytest.approx(1.0 - 0.01 * speed)

    def test_a_thin_rock(self):
        trace = watched(target_speed_max=9.0)
        trace["body_thickness"][3] = 0.02
        assert sanity(trace, "tunneling").held
        trace["target_speed_max"][:] = 11.0
        found = sanity(trace, "tunneling")
        assert not found.held and found.bodies == ("target", "rock")


def test_the_worst_of_several_checks_speaks():
    found = sanity(watched(target_speed_max=210.0))
    assert (found.held, found.value) == (False, pytest.approx(1.05))
    words = (
        "bodies come nearer by up to 1.05 of the thinnest's thickness a step (target and robot 1 at 0.00 s)"
    )
    assert found.found == f"{words}; at samples of 1 s"  # which the energy is judged at
