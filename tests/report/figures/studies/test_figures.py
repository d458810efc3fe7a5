"""Figures of studies: there for what a study has, with all their text inside."""

import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from PIL import Image

from escort_mj.report.figures.drawing import scales
from escort_mj.report.figures.studies import curves, heat_maps, tradeoff
from escort_mj.report.figures.studies.figures import draw_study
from escort_mj.study.sweeps.quantities import EFFORT, PASSED, PRECISION, QUANTITIES, SAFETY
from tests.study.planted import STUDY, plant, results

HEAD = "study: drawn\nscenario: main\nset: {expect: []}\n"
SHAPES = {
    "three_factors": STUDY,
    "laws_and_masses": HEAD
    + "vary: {controller: [apd_smc, pd], robots.mass: [0.2, 0.5, 1, 2, 5]}\nseeds: 3\n",
    "uneven_masses": HEAD
    + "vary: {controller: [apd_smc, pd], robots.mass: {low: 0.2, high: 5, count: 7, scale: log}}\nseeds: 3\n",
    "cases": HEAD
    + "cases: {calm: {}, heavy: {robots.mass: 5}, a long name of a case: {robots.mass: 2}}\nseeds: 3\n",
    "drawn": HEAD
    + "vary: {controller: [apd_smc, pd]}\n"
    + "sample: {count: 40, over: {robots.mass: {low: 0.2, high: 5, scale: log}}}\n",
    "one_cell": HEAD + "seeds: 4\n",
    "many_laws": HEAD
    + "vary:\n  controller: [apd_smc, asmc, pd_smc, pd, computed_torque, super_twisting]\n"
    + "  robots.mass: [1, 2]\n",
}
MAPS = {f"map_{name}_robots_mass_controller" for name in (PASSED, PRECISION, SAFETY, EFFORT)}
EXPECTED = {
    "three_factors": {"curves_robots_mass", "curves_robots_force_limit", "tradeoff"}
    | {f"map_{name}_robots_mass_robots_force_limit" for name in (PASSED, PRECISION, SAFETY, EFFORT)},
    "laws_and_masses": {"curves_robots_mass", "tradeoff"} | MAPS,
    "uneven_masses": {"curves_robots_mass", "tradeoff"} | MAPS,
    "cases": {"intervals", "tradeoff"},
    "drawn": {"curves_robots_mass", "tradeoff"},
    "one_cell": {"intervals", "tradeoff"},
    "many_laws": {"curves_robots_mass", "tradeoff"} | MAPS,
}


@pytest.fixture
def unreadable(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What sticks out of a figure that is saved, and labels of one kind that lie on each other."""
    found: list[str] = []
    save = FigureCanvasAgg.print_png

    def look(canvas: FigureCanvasAgg, *arguments, **options) -> None:
        save(canvas, *arguments, **options)
        figure = canvas.figure
        renderer, (_, _, right, top) = canvas.get_renderer(), figure.bbox.extents
        shown = [axes for axes in figure.axes if axes.get_visible()]
        for part in [*shown, *figure.texts, *figure.legends]:
            box = part.get_tightbbox(renderer)
            if box.x0 < -1 or box.y0 < -1 or box.x1 > right + 1 or box.y1 > top + 1:
                found.append(f"{part} sticks out")
        words = {axes.get_title("left") for axes in shown} - {""}
        titles = [text for axes in shown for text in axes.findobj(Text) if text.get_text() in words]
        found.extend(_on_each_other(titles, renderer))
        for axes in shown:
            low, high = sorted(axes.get_xlim())
            labels = [label for label in axes.get_xticklabels() if low <= label.get_position()[0] <= high]
            found.extend(_on_each_other(labels, renderer))

    monkeypatch.setattr(FigureCanvasAgg, "print_png", look)
    return found


def _on_each_other(texts: list[Text], renderer) -> list[str]:
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts]
    return [f"{a} on {b}" for (a, one), (b, other) in combinations(boxes, 2) if one.overlaps(other)]


SLOW = [
    pytest.param(shape, marks=pytest.mark.slow) for shape in ("three_factors", "laws_and_masses", "many_laws")
]


@pytest.mark.slow_cases("drawn")
@pytest.mark.parametrize("shape", ["cases", "drawn", "one_cell", "uneven_masses", *SLOW])
def test_every_figure_that_a_study_has_data_for(shape: str, tmp_path: Path, unreadable: list[str]) -> None:
    drawn = draw_study(results(tmp_path, SHAPES[shape]), tmp_path, formats=("png",))
    assert {one.path.stem for one in drawn} == EXPECTED[shape]
    assert unreadable == []
    for one in drawn:
        assert one.words.endswith(".") and np.asarray(Image.open(one.path).convert("L")).std() > 5


def test_figures_of_what_never_settles_or_has_no_clearance(tmp_path: Path, unreadable: list[str]) -> None:
    def planter(cell, seed):
        return {"radius_error_mean": math.inf if cell.labels["robots.mass"] == 5 else 0.1, "energy": 0.0}

    found = results(tmp_path, SHAPES["laws_and_masses"], planter)
    drawn = draw_study(found, tmp_path, formats=("png",))
    assert not any(SAFETY in one.path.stem or one.path.stem == "tradeoff" for one in drawn)
    assert unreadable == []


def test_figures_of_runs_that_all_broke(tmp_path: Path) -> None:
    found = results(tmp_path, SHAPES["laws_and_masses"], lambda cell, seed: "broke")
    drawn = draw_study(found, tmp_path, formats=("svg", "png"))
    assert {one.path.name for one in drawn} == {
        "curves_robots_mass.svg",
        f"map_{PASSED}_robots_mass_controller.svg",
    }
    assert all(one.path.with_suffix(".png").is_file() for one in drawn)


def test_names_of_files_have_no_dots_and_are_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "figures").mkdir()
    for module, name in ((heat_maps, "draw_map"), (tradeoff, "draw_tradeoff"), (curves, "draw_study_curves")):
        monkeypatch.setattr(module, name, lambda path, *_: path.touch())  # how they look is tested above
    text = "study: drawn\nscenario: main\nparameters: {robots_mass: 1}\n"
    text += "set: {expect: [], 'robots.overrides[0]': {robot: 1}, duration: '{robots_mass}'}\n"
    text += "vary: {robots.mass: [1, 2], robots_mass: [3, 4], 'robots.overrides[0].mass': [1, 2]}\n"
    drawn = draw_study(results(tmp_path, text), tmp_path)
    stems = [one.path.stem for one in drawn if one.path.stem.startswith("curves")]
    assert stems == ["curves_robots_mass", "curves_robots_mass_", "curves_robots_overrides_0_mass"]
    assert all(one.path.is_file() and "." not in one.path.stem for one in drawn)


@pytest.mark.slow
def test_another_factor_may_be_told_apart(tmp_path: Path) -> None:
    drawn = draw_study(results(tmp_path), tmp_path, compare="robots.mass", formats=("png",))
    assert {"curves_robots_force_limit", "tradeoff"} < {one.path.stem for one in drawn}


@pytest.mark.slow
def test_the_same_study_gives_the_same_files(tmp_path: Path) -> None:
    found = results(tmp_path, SHAPES["one_cell"], plant)
    first = [one.path.read_bytes() for one in draw_study(found, tmp_path)]
    assert first == [one.path.read_bytes() for one in draw_study(found, tmp_path)]


def test_scales() -> None:
    small = scales.scale_of(QUANTITIES[PRECISION], np.array([0.001, 0.2, math.nan, math.inf]))
    assert (small.factor, small.unit, small.log) == (1000.0, "mm", True)
    # Clearance may be negative.
    assert scales.scale_of(QUANTITIES[SAFETY], np.array([0.001, 2.0])).log is False
    assert scales.scale_of(QUANTITIES[PASSED], np.array([0.5]))[:2] == (100.0, "%")
    nothing = scales.scale_of(QUANTITIES[EFFORT], np.array([math.nan]))
    assert nothing.low < nothing.high
    said = [scales.readable(x) for x in (math.nan, math.inf, 1234.5, 0.01234)]
    assert said == ["-", "never", "1234", "0.0123"]
