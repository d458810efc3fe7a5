import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME, steps


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
