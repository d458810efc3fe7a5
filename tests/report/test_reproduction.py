import json
import math
import warnings

import numpy as np
import pytest
from PIL import Image

from escort_mj.api import scenarios_folder
from escort_mj.errors import RunFolderError, UsageError
from escort_mj.record.folder import read_run
from escort_mj.report.reproduction import differ, draw_reproduction
from escort_mj.study.compare import reproduce as reproduction
from escort_mj.study.compare.measured import QUANTITIES, Measured
from escort_mj.study.compare.reproduce import reproduce_paper
from escort_mj.study.compare.reproduction import chosen_figures, needed, simulations

SHOWN = ["5", "10", "16"]  # one of each kind, the plane and space


@pytest.fixture(scope="module")
def shortened():
    """Makes every simulation short, and only those of some figures exist."""
    patch = pytest.MonkeyPatch()
    original = reproduction.paper_scenario

    def short(simulation, scenarios):
        return original(simulation, scenarios).model_copy(update={"duration": 1.0})

    patch.setattr(reproduction, "paper_scenario", short)
    patch.setattr(reproduction, "simulations", lambda: needed(chosen_figures(SHOWN)))
    patch.setattr(reproduction, "chosen_figures", lambda only: chosen_figures(only or SHOWN))
    yield
    patch.undo()


@pytest.fixture(scope="module")
def whole(shortened, compiled, tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduction")
    steps = []
    result = reproduce_paper(
        scenarios_folder(),
        out,
        draw_reproduction,
        workers=1,
        progress=lambda *at: steps.append(at),
    )
    return out, result, steps


def test_figures_are_drawn_under_their_numbers_and_the_table_written(whole):
    out, result, steps = whole
    assert {path.name for path in (out / "figures").iterdir()} == {"fig05.png", "fig10.png", "fig16.png"}
    for path in (out / "figures").iterdir():
        assert np.asarray(Image.open(path).convert("L")).std() > 5
    assert result.stated
    assert len(list(out.glob("*-*-*/outcome.json"))) == 6
    assert len(json.loads((out / "table.json").read_text())["runs"]) == 6
    assert steps[-1] == (9, 9)
    assert [done for done, _ in steps] == sorted(done for done, _ in steps)


def test_a_second_time_nothing_runs_and_the_table_keeps_everything(whole):
    out, _, _ = whole
    before = (out / "table.md").read_text()
    drawn = []
    draw = lambda out, runs, figure: drawn.append(figure.key)  # noqa: E731
    result = reproduce_paper(scenarios_folder(), out, draw, only=["5"], workers=1)
    assert drawn == ["5"]
    assert result.lines[0] == "2 simulations: 0 new, 2 from earlier"
    assert (out / "table.md").read_text() == before


def test_the_laws_are_compared_even_where_nothing_settles(tmp_path):
    values = dict.fromkeys(QUANTITIES, 1.0) | {"settling_time": math.inf, "tracking_time": 0.0}
    runs = [Measured(simulation, "completed", "", values, []) for simulation in simulations()[:-1]]
    runs.append(Measured(simulations()[-1], "diverged", "", dict.fromkeys(QUANTITIES), []))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = draw_reproduction(tmp_path, runs, chosen_figures(["laws"])[0])
    assert path.name == "laws.png"
    assert np.asarray(Image.open(path).convert("L")).std() > 5


def test_readings_that_look_alike_are_drawn_once(whole):
    out, _, _ = whole
    one = read_run(out / "case1_2d-apd_smc-anti_windup").trace
    other = read_run(out / "case1_2d-apd_smc-unlimited").trace
    assert not differ(one, one, "panels")
    assert differ(one, other, "panels")
    assert differ(one, other.isel(time=slice(0, 10)), "paths")


def test_what_cannot_be_done_is_said_at_once(shortened, tmp_path):
    with pytest.raises(UsageError, match="5 to 17"):
        reproduce_paper(scenarios_folder(), tmp_path / "out", draw_reproduction, only=["18"])
    assert not (tmp_path / "out").exists()
    with pytest.raises(RunFolderError):
        draw_reproduction(tmp_path, (), chosen_figures(["5"])[0])
