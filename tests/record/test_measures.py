import math

import numpy as np
import pytest

from escort_mj.record.metrics import measure, measures_of, summarize
from escort_mj.record.outcome import Outcome
from escort_mj.signals import CAUSES
from tests.record.motions import RADIUS, TIME, ring, steps


class TestRadius:
    def test_a_circle_with_an_offset(self, make_trace):
        trace = make_trace(TIME, robots=4, q=ring(4, RADIUS + 0.25, (3.0, -1.0)), target_position=(3.0, -1.0))
        assert measure("radius_error_mean", trace).value == pytest.approx(0.25, abs=1e-12)
        assert measure("radius_error_max", trace).value == pytest.approx(0.25, abs=1e-12)

    def test_inside_counts_as_much_as_outside(self, make_trace):
        radii = RADIUS + np.array([-0.3, 0.1])
        trace = make_trace(TIME, robots=2, q=ring(2, radii))
        assert measure("radius_error_mean", trace).value == pytest.approx(0.2)
        found = measure("radius_error_max", trace)
        assert (found.value, found.who) == (pytest.approx(0.3), "robot 1")

    def test_the_target_may_move_and_the_true_position_counts(self, make_trace):
        target = np.stack([TIME, np.sin(TIME)], axis=1)
        trace = make_trace(
            TIME, robots=3, q=ring(3) + target[:, None], q_measured=1e6, target_position=target
        )
        assert measure("radius_error_max", trace).value < 1e-12

    def test_the_largest_has_a_moment_and_a_robot(self, make_trace):
        radii = np.full((501, 3), RADIUS)
        radii[123, 2] += 0.7
        found = measure("radius_error_max", make_trace(TIME, robots=3, q=ring(3, radii)))
        assert found.value == pytest.approx(0.7)
        assert (found.time, found.who) == (TIME[123], "robot 3")

    def test_in_space(self, make_trace):
        trace = make_trace([0.0, 1.0], axes=3, q=(6.0 / math.sqrt(3.0),) * 3)
        assert measure("radius_error_max", trace).value == pytest.approx(1.0)


class TestSettling:
    @pytest.mark.parametrize("decay", [0.5, 1.0, 2.0])
    def test_a_decaying_sine(self, make_trace, decay):
        time = np.linspace(0.0, 20.0, 20001)
        error = 2.0 * np.exp(-decay * time) * np.sin(7.0 * time)
        trace = make_trace(time, q=ring(1, RADIUS + error[:, None], time=time))
        found = measure("settling_time", trace)
        outside = np.abs(error) > 0.05 * RADIUS
        assert found.value == pytest.approx(time[outside][-1] + 1e-3, abs=1e-9)
        assert found.value <= math.log(2.0 / 0.25) / decay + 2e-3  # the sine's envelope
        assert found.who == "robot 1"

    def test_the_last_robot_decides(self, make_trace):
        error = np.stack([steps(TIME, 2.0, -1.0) + 1.0, steps(TIME, 6.0, -1.0) + 1.0], axis=1)
        found = measure("settling_time", make_trace(TIME, robots=2, q=ring(2, RADIUS + error)))
        assert (found.value, found.who) == (pytest.approx(6.0), "robot 2")

    def test_a_late_excursion_counts(self, make_trace):
        error = np.where(np.abs(TIME - 8.0) < 0.09, 0.3, 0.0)
        found = measure("settling_time", make_trace(TIME, q=ring(1, RADIUS + error[:, None])))
        assert found.value == pytest.approx(8.1)

    def test_settled_from_the_start(self, make_trace):
        assert measure("settling_time", make_trace(TIME, q=ring(1, 1.049 * RADIUS))).value == 0.0

    def test_never(self, make_trace):
        trace = make_trace(TIME, q=ring(1, 1.051 * RADIUS))
        found = measure("settling_time", trace)
        assert found.value == math.inf
        assert found.reason == "never settles"
        summary = summarize(measures_of(trace), trace, Outcome.COMPLETED, 1, 1.0)["settling_time"]
        assert summary["value"] is None
        assert summary["reason"] == "never settles"


class TestSpacing:
    @pytest.mark.parametrize("robots", [3, 5, 8])
    def test_an_even_ring_has_none(self, make_trace, robots):
        pairs = [[i + 1, (i + 1) % robots + 1] for i in range(robots)]
        edge = 2.0 * RADIUS * math.sin(math.pi / robots)
        about = {"neighbors": pairs, "spacing": edge}
        trace = make_trace(TIME, robots=robots, q=ring(robots), about=about)
        assert measure("spacing_error_max", trace).value < 1e-12

    def test_a_displaced_robot(self, make_trace):
        q = np.zeros((501, 3, 2))
        q[:, :, 0] = [0.0, 2.0, 4.0]
        q[77, 1, 0] = 2.5  # 0.5 too far from robot 1 and too near to robot 3
        q[:, 2, 0] += 0.1  # always a little too far
        trace = make_trace(TIME, robots=3, q=q, about={"neighbors": [[1, 2], [2, 3]], "spacing": 2.0})
        found = measure("spacing_error_max", trace)
        assert found.value == pytest.approx(0.5)
        assert (found.time, found.who) == (TIME[77], "robots 1 and 2")
        assert measure("spacing_error_mean", trace, after=2.0).value == pytest.approx(0.05)

    def test_without_a_formation(self, make_trace):
        trace = make_trace(TIME, robots=3, about={"neighbors": []})
        for name in ("spacing_error_mean", "spacing_error_max"):
            found = measure(name, trace)
            assert (found.value, found.reason) == (None, "the mission has no formation")


def test_errors_are_root_mean_squares_of_vectors(make_trace):
    e = np.zeros((501, 2, 2))
    e[:, 0] = (3.0, 4.0)  # |e| is 5 for one robot of two
    trace = make_trace(TIME, robots=2, e=e, e_dot=2.0 * e)
    assert measure("tracking_error_rms", trace).value == pytest.approx(5.0 / math.sqrt(2.0))
    assert measure("velocity_error_rms", trace).value == pytest.approx(10.0 / math.sqrt(2.0))


class TestTotals:
    """Running totals, written at every physics step, are differenced over the window."""

    def test_a_sine_force_between_samples(self, make_trace):
        # 2 sin(w t) N at 1000 steps a second, sampled once a second: the samples alone would miss it all.
        dt, w = 1e-3, 2.0 * math.pi
        fine = np.arange(0.0, 10.0 + dt / 2.0, dt)
        force = 2.0 * np.sin(w * fine)
        keep = slice(None, None, 1000)
        effort = (dt * np.cumsum(force**2))[keep, None]
        variation = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(force)))])[keep, None]
        trace = make_trace(fine[keep], effort=effort, force_variation=variation)
        assert measure("force_rms", trace).value == pytest.approx(math.sqrt(2.0), rel=1e-9)
        assert measure("chattering", trace).value == pytest.approx(8.0, rel=1e-4)  # 4 amplitudes a period
        assert measure("force_rms", trace, after=3.0, before=5.0).value == pytest.approx(math.sqrt(2.0))

    def test_a_window_counts_what_was_gained_in_it(self, make_trace):
        ramp = np.stack([TIME, 3.0 * TIME], axis=1)
        trace = make_trace(TIME, robots=2, work=ramp, saturated_time=ramp / 4.0, effort=ramp)
        assert measure("energy", trace).value == pytest.approx(40.0)
        assert measure("energy", trace, after=4.0, before=6.0).value == pytest.approx(8.0)
        assert measure("saturated_share", trace, after=4.0).value == pytest.approx(0.5)
        assert measure("force_rms", trace, before=5.0).value == pytest.approx(math.sqrt(2.0))

    @pytest.mark.parametrize("name", ["force_rms", "chattering", "energy", "saturated_share"])
    def test_one_sample_spans_no_time(self, make_trace, name):
        found = measure(name, make_trace([0.0]))
        assert (found.value, found.reason) == (None, "the window holds a single sample")

    def test_windows_add_up(self, make_trace):
        total = np.cumsum(np.random.default_rng(1).random((501, 2)), axis=0)
        trace = make_trace(TIME, robots=2, work=total)
        parts = [measure("energy", trace, a, b).value for a, b in ((0.0, 3.0), (3.0, 7.5), (7.5, None))]
        assert sum(parts) == pytest.approx(measure("energy", trace).value, rel=1e-12)


class TestDistances:
    def test_the_nearest_of_robots_and_obstacles(self, make_trace):
        distance = np.full((501, 2, 3), 9.0)
        distance[40, 1, 2] = 1.25
        clearance, body = np.full((501, 2, 4), 4.0), np.full((501, 2, 4), 3)
        clearance[41, 0, 2], body[41, 0, 2] = -0.01, 4
        trace = make_trace(
            TIME,
            robots=2,
            obstacles=3,
            obstacle_distance=distance,
            clearance=clearance,
            clearance_body=body,
        )
        found = measure("obstacle_distance_min", trace)
        assert (found.value, found.time, found.who) == (1.25, TIME[40], "robot 2 and rock 3")
        found = measure("obstacle_clearance_min", trace)
        assert (found.value, found.time, found.who) == (-0.01, TIME[41], "robot 1 and rock 2")

    def test_the_nearest_two_robots(self, make_trace):
        distance = np.full((501, 2), 3.0)
        distance[7] = 0.9
        clearance = np.repeat((distance - 0.4)[:, :, None], 4, axis=2)
        trace = make_trace(TIME, robots=2, robot_distance_min=distance, clearance=clearance)
        assert measure("robot_distance_min", trace)[:3] == (0.9, TIME[7], ("robot_1",))
        assert measure("robot_clearance_min", trace).value == pytest.approx(0.5)

    def test_a_least_of_zero_is_plain_zero(self, make_trace):
        value = measure("robot_clearance_min", make_trace(TIME, robots=2)).value
        assert str(value) == "0.0"

    def test_alone_in_an_empty_world(self, make_trace):
        trace = make_trace(TIME)
        for name, reason in {
            "obstacle_distance_min": "there are no obstacles",
            "obstacle_clearance_min": "there are no obstacles",
            "robot_distance_min": "there is one robot",
            "robot_clearance_min": "there is one robot",
        }.items():
            found = measure(name, trace)
            assert (found.value, found.reason) == (None, reason)


class TestContacts:
    def planted(self, make_trace):
        """Robots touch at 2 s for 10 ms, and both touch rock 1 from 6 to 7 s; one is on the floor."""
        rows = [
            [0, 1, 2.0, 2.01, 0.01, 30.0, 2.002, 0.2, 1e-3, 0.5],
            [0, 3, 6.0, 7.0, 1.0, 50.0, 6.1, 9.0, 1e-3, 0.5],
            [1, 3, 6.0, 7.0, 1.0, 80.0, 6.2, 9.0, 1e-3, 0.5],
            [1, 4, 0.0, 10.0, 10.0, 900.0, 0.5, 99.0, 1e-3, 0.0],
        ]
        return make_trace(TIME, robots=2, obstacles=1, episodes=rows)

    @pytest.mark.parametrize(
        "after, before, count, first, peak",
        [
            (0.0, None, 3, 2.0, 80.0),
            (0.0, 1.9, 0, None, 0.0),
            (0.0, 4.0, 1, 2.0, 30.0),
            (3.0, None, 2, 6.0, 80.0),
            (6.5, None, 2, 6.5, 80.0),  # under way when the window begins; their peak was before
            (8.0, None, 0, None, 0.0),
        ],
    )
    def test_touches_and_peak_force(self, make_trace, after, before, count, first, peak):
        trace = self.planted(make_trace)
        found = measure("contacts", trace, after, before)
        assert found.value == count
        assert found.time == (None if first is None else pytest.approx(first))
        found = measure("contact_force_max", trace, after, before)
        assert found.value == peak
        assert (found.time is None) == (peak == 0.0)

    def test_who_touched(self, make_trace):
        trace = self.planted(make_trace)
        assert measure("contacts", trace).who == "robots 1 and 2"
        assert measure("contact_force_max", trace)[1:3] == (6.2, ("robot_2", "rock 1"))

    def test_contacts_that_the_log_had_no_room_for(self, make_trace):
        trace = make_trace(TIME, contacts_untold=steps(TIME, 6.0, 2.0))
        assert measure("contacts_untold", trace).value == 2.0
        assert measure("contacts_untold", trace, before=5.0).value == 0.0


class TestPhysics:
    def test_tunneling_is_the_sum_of_the_two_largest_speeds(self, make_trace):
        """Robots of 0.4 m; 100 and 60 m/s in one sample, the target at 80: 180 m/s times 2 ms over 0.4 m."""
        speed, target = np.ones((501, 2)), np.zeros(501)
        speed[40] = 60.0, 100.0
        target[40] = 80.0
        found = measure("tunneling", make_trace(TIME, robots=2, speed_max=speed, target_speed_max=target))
        assert found[:3] == (pytest.approx(0.9), TIME[40], ("robot_2", "robot_1"))

    def test_a_moving_obstacle_can_be_the_fastest(self, make_trace):
        speed = np.zeros((501, 1))
        speed[41] = 100.0
        found = measure("tunneling", make_trace(TIME, robots=1, obstacles=1, obstacle_speed_max=speed))
        assert found[:3] == (pytest.approx(100.0 * 0.002 / 0.4), TIME[41], ("rock 1", "robot_1"))

    def test_the_largest_kinetic_energy(self, make_trace):
        found = measure("kinetic_energy_max", make_trace(TIME, kinetic_energy=steps(TIME, 3.0)))
        assert found[:2] == (1.0, pytest.approx(3.0))


class TestTruth:
    def test_bounds_of_the_mass_matrix(self, make_trace):
        mass = np.broadcast_to(np.diag([2.0, 3.0]), (501, 2, 2, 2)).copy()
        mass[200, 1] = [[2.0, 1.0], [1.0, 2.0]]  # eigenvalues 1 and 3
        mass[300, 0] = np.diag([7.0, 2.5])
        trace = make_trace(TIME, robots=2, mass_matrix=mass)
        least, largest = (measure(f"mass_eigenvalue_{which}", trace) for which in ("min", "max"))
        assert (least.value, least.time, least.who) == (pytest.approx(1.0), TIME[200], "robot 2")
        assert (largest.value, largest.time, largest.who) == (pytest.approx(7.0), TIME[300], "robot 1")

    @pytest.mark.parametrize("name", ["skew_residual", "coriolis_residual"])
    def test_residuals(self, make_trace, name):
        values = np.zeros((501, 3))
        values[[50, 400], [0, 2]] = 0.5, 0.75
        found = measure(name, make_trace(TIME, robots=3, **{name: values}))
        assert (found.value, found.time, found.who) == (0.75, TIME[400], "robot 3")
        assert measure(name, make_trace(TIME, robots=3, **{name: values}), before=5.0).value == 0.5

    def test_a_rise_of_the_lyapunov_function_counts_from_its_least(self, make_trace):
        """V1 falls to 2, rises to 2.8 for no known reason and by 5 more with the reference, and falls."""
        value = np.full((501, 1), 10.0)
        value[100:] = 2.0
        value[200:] = 2.8
        change = np.zeros((501, 1, 7))
        change[300:, 0, CAUSES.index("reference")] = 5.0
        value[300:] += 5.0
        found = measure("lyapunov_rise", make_trace(TIME, lyapunov=value, lyapunov_change=change))
        assert (found.value, found.who) == (pytest.approx(0.8), "robot 1")
        assert found.time == pytest.approx(4.0)
        unbooked = measure("lyapunov_rise", make_trace(TIME, lyapunov=value))
        assert unbooked.value == pytest.approx(5.8)

    def test_what_is_unexplained_does_not_cancel(self, make_trace):
        change = np.zeros((501, 2, 7))
        change[:, 0, CAUSES.index("unexplained")] = 0.3 * np.sin(np.pi * TIME / 5.0)  # up, down, back: 1.2
        change[:, 1, CAUSES.index("dissipation")] = -TIME
        trace = make_trace(TIME, robots=2, lyapunov_change=change)
        assert measure("lyapunov_unexplained", trace).value == pytest.approx(1.2, abs=1e-3)
        assert measure("lyapunov_unexplained", trace, 2.5, 7.5).value == pytest.approx(0.6, abs=1e-3)

    def test_what_was_not_recorded_is_said(self, make_trace):
        names = ("mass_eigenvalue_min", "mass_eigenvalue_max", "skew_residual", "coriolis_residual")
        blind = make_trace(TIME, truth=False)
        for name in (*names, "lyapunov_rise", "lyapunov_unexplained"):
            found = measure(name, blind)
            assert found.value is None and "recording.truth" in found.reason
        other_law = make_trace(TIME).drop_vars(["lyapunov", "lyapunov_change"])
        for name in ("lyapunov_rise", "lyapunov_unexplained"):
            assert "sliding-mode" in measure(name, other_law).reason
