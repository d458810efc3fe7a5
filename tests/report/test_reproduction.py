import numpy as np
import pytest
from PIL import Image

from escort_mj.api import scenarios_folder
from escort_mj.errors import RunFolderError, UsageError
from escort_mj.record.folder import open_run
from escort_mj.report import reproduction
from escort_mj.report.reproduction import Drawing, differ, draw, reproduce
from escort_mj.scenario import load_scenario
from escort_mj.study.reproduction import chosen


@pytest.fixture(scope="module")
def shortened():
    """Makes every simulation so short that all of them run in seconds."""
    patch = pytest.MonkeyPatch()
    original = reproduction.scenario_of

    def short(simulation, scenarios):
        return original(simulation, scenarios).model_copy(update={"duration": 1.0})

    patch.setattr(reproduction, "scenario_of", short)
    yield
    patch.undo()


@pytest.fixture(scope="module")
def whole(shortened, compiled, tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduction")
    steps = []
    result = reproduce(
        scenarios_folder(), out, workers=1, docs=out / "docs.md", progress=lambda *at: steps.append(at)
    )
    return out, result, steps


def test_every_figure_is_drawn_under_its_number_and_the_table_written(whole):
    out, result, steps = whole
    names = {path.name for path in (out / "figures").iterdir()}
    assert names == {f"fig{number:02d}.png" for number in range(5, 18)} | {"laws.png"}
    for path in (out / "figures").iterdir():
        assert np.asarray(Image.open(path).convert("L")).std() > 5
    assert result.stated
    assert len([path for path in out.iterdir() if path.is_dir()]) == 63 + 1
    assert (out / "docs.md").read_text() == (out / "table.md").read_text()
    assert "not run" not in (out / "table.md").read_text()
    assert steps[-1] == (77, 77)
    assert [done for done, _ in steps] == sorted(done for done, _ in steps)


def test_a_second_time_nothing_runs_and_the_table_keeps_everything(whole):
    out, _, _ = whole
    before = (out / "table.md").read_text()
    result = reproduce(scenarios_folder(), out, only=["6"], workers=1)
    assert result.lines[0] == "2 simulations: 0 run now, 2 had run before"
    assert (out / "table.md").read_text() == before


def test_readings_that_look_alike_are_drawn_once(whole):
    out, _, _ = whole
    one = open_run(out / "case1_2d-asmc-anti_windup").trace
    other = open_run(out / "case1_2d-asmc-unlimited").trace
    assert not differ(one, one, "panels")
    assert differ(one, other, "panels")
    assert differ(one, other.isel(time=slice(0, 10)), "paths")


def test_what_cannot_be_done_is_said_at_once(shortened, tmp_path):
    with pytest.raises(UsageError, match="5 to 17"):
        reproduce(scenarios_folder(), tmp_path / "out", only=["18"])
    with pytest.raises(UsageError, match="whole table"):
        reproduce(scenarios_folder(), tmp_path / "out", only=["5"], docs=tmp_path / "docs.md")
    assert not (tmp_path / "out").exists()
    with pytest.raises(RunFolderError):
        draw(Drawing(chosen(["5"])[0], tmp_path))


def test_the_shipped_cases_are_those_of_the_figures():
    for figure in chosen([]):
        if figure.case:
            load_scenario(scenarios_folder() / "paper" / f"{figure.case}.yaml")
