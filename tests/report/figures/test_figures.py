import warnings

import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from escort_mj import palette
from escort_mj.errors import RenderError, RunFolderError
from escort_mj.files import MACHINE, PARTIAL
from escort_mj.record.folder import read_run
from escort_mj.record.outcome import Outcome
from escort_mj.report.figures import figures, paths
from escort_mj.report.figures.drawing import curves, style
from escort_mj.report.figures.drawing.look import look_of, looking
from escort_mj.report.figures.drawing.style import figure
from escort_mj.report.figures.figures import draw_figures, figure_of

ALWAYS = {"panels", "paths", "forces", "tasks"}


def draw(folder, formats=("png",)):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return draw_figures(folder, formats)


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB"))


def has_color(image, color, tolerance=2):
    wanted = np.round(255 * np.array(color))
    return bool((np.abs(image - wanted).max(axis=-1) <= tolerance).any())


NEAR = {"clearances", "obstacle_distances"}
MISSIONS = {
    "space": ({"count": 6, "axes": 3}, NEAR),
    "truth_once": ({"samples": 1, "count": 1, "obstacles": 0, "truth": "lyapunov"}, {"truth"}),
    "two_samples": ({"samples": 2, "axes": 3, "count": 1, "obstacles": 0}, set()),
    "many": ({"count": 50, "obstacles": 30}, NEAR),
    "truth": ({"obstacles": 0, "truth": "lyapunov"}, {"clearances", "truth"}),
    "free": ({"obstacles": 0}, {"clearances"}),
    "alone": ({"count": 1, "obstacles": 0}, set()),
    "two": ({"count": 2, "obstacles": 0}, {"clearances"}),
    "one_sample": ({"samples": 1}, NEAR),
    "thirteen": ({"count": 13, "axes": 3, "obstacles": 5}, NEAR),
    "other_law": ({"count": 13, "axes": 3, "obstacles": 0, "truth": "mass"}, {"clearances", "truth"}),
}


def test_a_mission_gets_its_figures_without_a_warning(drawn_run):
    assert_drawn([*(drawn_run / "figures").iterdir()], NEAR)


@pytest.mark.slow
@pytest.mark.parametrize("name", MISSIONS)
def test_so_does_every_other_mission(make_run, monkeypatch, name):
    monkeypatch.setattr(style, "DPI", 60)
    shape, more = MISSIONS[name]
    assert_drawn(draw(make_run(**shape)), more)


def assert_drawn(written, more):
    assert {path.stem for path in written} == ALWAYS | more
    for path in written:
        image = pixels(path)
        assert image.shape[1] == round(style.WIDTH * 60)
        assert 90 < image.shape[0] < 600
        assert image.std() > 5  # not blank
        assert (image[0] == 255).all() and (image[:, -1] == 255).all()  # nothing runs out of the picture


def test_a_diverged_run_draws_and_says_so(make_run, monkeypatch):
    monkeypatch.setattr(figures, "PLOTS", [plot for plot in figures.PLOTS if plot.name == "paths"])
    far = {"spread": lambda time: np.exp(12 * time), "outcome": Outcome.DIVERGED, "obstacles": 1}
    well, ill = draw(make_run(obstacles=1)), draw(make_run(**far))
    for good, bad in zip(well, ill, strict=True):
        assert not has_color(pixels(good), palette.from_hex("B00020"))
        assert has_color(pixels(bad)[:150], palette.from_hex("B00020"))


def test_a_folder_that_holds_nothing_to_draw_is_refused(make_run, tmp_path):
    with pytest.raises(RenderError, match="no sample"):
        draw_figures(make_run(samples=0))
    with pytest.raises(RunFolderError):
        draw_figures(tmp_path)


def test_what_a_killed_process_had_begun_to_draw_is_removed(make_run, monkeypatch):
    monkeypatch.setattr(figures, "PLOTS", ())
    left = make_run(samples=1) / "figures" / f"{PARTIAL}.{MACHINE}.999999999.1.paths.png"
    left.parent.mkdir()
    left.touch()
    assert draw_figures(left.parents[1]) == [] and not left.exists()


@pytest.mark.parametrize("count", [5, 20])
def test_each_robot_is_drawn_in_its_color_where_it_ended(make_run, tmp_path, count):
    trace = read_run(make_run(count=count)).trace
    kept: list[Figure] = []
    with figure(tmp_path / "plan.png", paths.plan_height(trace), "plan") as canvas:
        paths.plan_view(canvas, trace)
        kept.append(canvas)
    image = pixels(tmp_path / "plan.png")
    axes = kept[0].axes[0]
    for place, color in zip(trace["q"].values[-1], palette.robot_colors(count), strict=True):
        column, row = axes.transData.transform(place)
        drawn = image[image.shape[0] - 1 - round(row), round(column)]
        np.testing.assert_allclose(drawn, 255 * np.array(color), atol=3)


def sizes_of_marks(trace, width):
    """Sizes of the marks of a plan and of its legend, and of the dots of a crowd [points]."""
    with looking(look_of(width)):
        canvas = figure_of(trace, "paths")
    lines = [*canvas.axes[0].lines, *canvas.legends[0].findobj(Line2D)]
    dots = [part.get_sizes()[0] for part in canvas.axes[0].collections if isinstance(part, PathCollection)]
    return np.array([line.get_markersize() for line in lines if line.get_marker() in ("o", "x")]), dots


@pytest.mark.parametrize(("count", "crowd"), [(5, False), (61, True)])
def test_marks_of_narrow_figures_are_smaller_by_area(make_run, count, crowd):
    trace = read_run(make_run(count=count)).trace
    (page, dots), (column, fewer) = sizes_of_marks(trace, "page"), sizes_of_marks(trace, "column")
    assert page.max() == pytest.approx(7.15 if not crowd else 7.0) and bool(dots) == crowd
    np.testing.assert_allclose(column, page * np.sqrt(3.5 / 7.2))
    np.testing.assert_allclose(fewer, np.array(dots) * 3.5 / 7.2)
    np.testing.assert_allclose(sizes_of_marks(trace, 12.0)[0], page)


def test_the_plan_is_to_scale(make_run, tmp_path):
    trace = read_run(make_run()).trace
    with figure(tmp_path / "plan.png", paths.plan_height(trace), "plan") as canvas:
        paths.plan_view(canvas, trace)
    transform = canvas.axes[0].transData
    origin, right, up = transform.transform([[0, 0], [1, 0], [0, 1]])
    assert np.linalg.norm(right - origin) == pytest.approx(np.linalg.norm(up - origin))


def test_thinning_keeps_both_ends_and_every_peak():
    time = np.linspace(0, 1, 200_000)
    values = np.zeros_like(time)
    values[[777, 150_123]] = 5.0, -3.0
    x, y = curves.thin(time, values)
    assert len(x) < 3 * curves.BINS
    assert (y.max(), y.min(), x[0], x[-1]) == (5.0, -3.0, 0.0, 1.0)
    assert (np.diff(x) > 0).all()


def test_running_rms_of_a_sine():
    time = np.linspace(0, 60, 60_001)
    rms = curves.running_rms(time, np.sin(2 * np.pi * 10 * time))
    assert rms[5000:-5000] == pytest.approx(np.sqrt(0.5), rel=2e-3)


@pytest.mark.parametrize(
    "name", ["panels", "paths", *(pytest.param(name, marks=pytest.mark.slow) for name in ("tasks", "forces"))]
)
def test_narrow_figures_hold_all_their_words(make_run, name):
    with looking(look_of("column", font_size=6.5)):
        canvas = figure_of(read_run(make_run()).trace, name)
    assert canvas.get_figwidth() == 3.5
    assert_words_inside(canvas)


@pytest.mark.parametrize("width", ["column", "page"])
def test_paths_in_space_hold_all_their_words_and_numbers(make_run, width):
    """Numbers along z once were drawn as the commands of their typesetting."""
    trace = read_run(make_run(count=6, axes=3)).trace
    way = np.linspace(0.0, 40.0, trace.sizes["time"])  # far along x, as missions go
    trace["q"][:, :, 0] += way[:, None]
    trace["target_position"][:, 0] += way
    with looking(look_of(width)):
        canvas = figure_of(trace, "paths")
    assert_words_inside(canvas)
    (axes,) = canvas.axes
    ticks = [axes.xaxis, axes.yaxis, axes.zaxis]
    assert all(label.get_parse_math() for axis in ticks for label in axis.get_ticklabels())


def test_labels_in_space_lie_beside_the_color_bar_and_above_the_legend(make_run):
    with looking(look_of("page")):
        canvas = figure_of(read_run(make_run(count=30, axes=3)).trace, "paths")
    canvas.draw_without_rendering()
    axes, bar = (one.get_tightbbox() for one in canvas.axes)
    assert axes.x1 < bar.x0 and axes.y0 > canvas.legends[0].get_window_extent().y1


def test_panels_of_the_truth_that_share_no_width_have_their_own_times(make_run):
    canvas = figure_of(read_run(make_run(obstacles=0, truth="lyapunov")).trace, "truth")
    labels = [axes.get_xlabel() for axes in canvas.axes]
    assert labels == ["time [s]", "time [s]", "", "time [s]"]


def assert_words_inside(canvas):
    canvas.draw_without_rendering()
    renderer, (_, _, right, top) = canvas.canvas.get_renderer(), canvas.bbox.extents
    for part in [*canvas.axes, *canvas.texts, *canvas.legends]:
        box = part.get_tightbbox(renderer)
        assert box.x0 > -1 and box.y0 > -1 and box.x1 < right + 1 and box.y1 < top + 1, part
