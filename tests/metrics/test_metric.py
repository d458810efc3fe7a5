import sys

import pytest

from escort_mj.errors import UsageError
from escort_mj.measuring import measure
from escort_mj.metrics import METRICS, radius_error
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import Metric, metric, metric_of, metrics_of
from tests.metrics.motions import TIME
from tests.synthetic import as_recording

READ = pytest.mark.parametrize("read", ["recording", "xarray"])


def as_read(trace, read):
    return as_recording(trace) if read == "recording" else trace


class TestWhatItIsShown:
    @READ
    @pytest.mark.parametrize("name", ["q", "time", "robot_mass"])
    def test_no_array_can_be_written_to(self, make_trace, read, name):
        def writes(trace):
            """Writes."""
            trace[name].values[:] = 77.0

        trace = as_read(make_trace(TIME, robots=2), read)
        for after in (0.0, 5.0):
            found = measure(Metric("writes", "m", "writes", function=writes), trace, after)
            assert found.broken and __file__ in found.reason and "read-only" in found.reason
        assert not (trace[name].values == 77.0).any()

    @READ
    @pytest.mark.parametrize(
        "change",
        [
            lambda trace: trace.attrs.update(timestep=77.0),
            lambda trace: trace.data_vars.pop("q"),
            lambda trace: trace.coords.pop("time"),
            lambda trace: setattr(trace["q"], "values", 77.0),
            lambda trace: trace["q"][0].fill(77.0),
        ],
    )
    def test_nor_can_anything_be_put_in_its_place(self, make_trace, read, change):
        trace = as_read(make_trace(TIME, robots=2), read)
        assert Metric("changes", "m", "changes", change).of(trace).broken
        assert trace.attrs["timestep"] == 0.002 and not trace["q"].values.any() and len(trace["time"].values)

    def test_units_are_a_copy(self, make_trace):
        trace = as_recording(make_trace(TIME))
        trace["q"].attrs["units"] = "km"
        assert "units" not in trace["q"].attrs

    def test_a_trace_made_of_a_recording_can_be_written_to(self, make_trace):
        trace = make_trace(TIME)
        trace["q"].values[:] = 1.0
        assert (trace["q"].values == 1.0).all()


class TestValues:
    @pytest.mark.parametrize(("found", "value"), [(2, 2.0), (True, 1.0)])
    def test_a_number_is_a_measure(self, make_trace, found, value):
        assert Metric("plain", "1", "plain", lambda trace: found).of(make_trace(TIME)) == Measure(value)

    def test_none_says_nothing(self, make_trace):
        found = Metric("silent", "1", "silent", lambda trace: None).of(make_trace(TIME))
        assert (found.value, found.reason, found.broken) == (None, "silent says nothing of this run", False)

    def test_an_error_is_a_measure_that_says_where(self, make_trace):
        found = Metric("fails", "1", "fails", lambda trace: 1 / 0).of(make_trace(TIME))
        assert found.value is None and found.broken
        assert f"{__file__}:" in found.reason and "ZeroDivisionError" in found.reason

    def test_so_it_is_of_one_that_ships(self, make_trace):
        trace = make_trace(TIME).drop_vars("e")
        found = measure("tracking_error_rms", trace)
        assert found.broken and "reading.py" not in found.reason and "tracking.py:" in found.reason


class TestFound:
    @pytest.mark.parametrize(
        ("doc", "meaning"),
        [
            ("Widest gap\n    between two.\n\n    More.", "widest gap between two"),
            ("MuJoCo's energy.", "MuJoCo's energy"),
            ("V1 at the end.", "V1 at the end"),
            ("A share.", "a share"),
        ],
    )
    def test_the_docstring_is_the_meaning(self, doc, meaning):
        def some(trace):
            return 0.0

        some.__doc__ = doc
        found = metric_of(metric(unit="m")(some))
        assert (found.name, found.unit, found.meaning, found.function) == ("some", "m", meaning, some)

    def test_all_are_in_the_order_of_their_ranks(self):
        ranks = [one.rank for one in METRICS]
        assert ranks == sorted(ranks)

    def test_what_a_module_imports_is_not_its_own(self):
        brought = metrics_of(radius_error, radius_error.__name__)
        assert [one.name for one in brought] == ["radius_error_mean", "radius_error_max", "settling_time"]
        assert metrics_of(radius_error, "escort_mj.metrics") == brought
        assert metrics_of(radius_error, __name__) == metrics_of(sys.modules[__name__], "escort_mj") == []


class TestWhatItLooksAt:
    @pytest.mark.parametrize("old", [True, False])
    def test_the_argument_of_earlier_versions_says_what_to_write(self, old):
        with pytest.raises(UsageError, match='write over="tail" for the last fifth'):
            metric(unit="m", tail=old)

    def test_a_part_of_a_run_that_there_is_not(self):
        with pytest.raises(UsageError, match="'tial'.*'whole' and 'tail'"):
            metric(unit="m", over="tial")

    @pytest.mark.parametrize(
        ("name", "title"),
        [
            ("radius_error_mean", "radius error, mean"),
            ("settling_time", "settling time"),
            ("rms", "rms"),
            ("my_own", "my own"),
        ],
    )
    def test_its_title(self, name, title):
        assert Metric(name, "1", "meaning", len).title == title
