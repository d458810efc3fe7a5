import json

import numpy as np
import pytest
from PIL import Image

import escort_mj
from escort_mj.api import load_scenario

SHORT = {"duration": 1.0, "expect": []}


def compared(scenario, laws, outer=(), seeds=1, out=None, **more):
    return escort_mj.compare(scenario, laws, outer, seeds, out, workers=1, progress=False, **more)


@pytest.fixture(scope="module")
def whole(compiled, tmp_path_factory):
    out = tmp_path_factory.mktemp("comparison")
    return out, compared(load_scenario("main", SHORT), "pd,super_twisting", (), 2, out)


def test_runs_table_and_figures_are_there(whole):
    out, result = whole
    assert result.passed and result.lines[0] == "4 runs: 4 new, 0 from earlier"
    assert {path.parent.name.rpartition("-")[0] for path in out.glob("runs/*/outcome.json")} == {
        f"{law}-set_based-seed{seed}" for law in ("pd", "super_twisting") for seed in (1, 2)
    }
    runs = json.loads((out / "table.json").read_text())["runs"]
    assert len(runs) == 4 and all((out / run["folder"]).is_dir() for run in runs)
    assert result.table["controller"].tolist() == ["pd", "super_twisting"] * 2
    assert "PD, gravity compensated" in (out / "table.md").read_text()
    assert r" & PD, gravity compensated & " in (out / "table.tex").read_text()
    for name in ("comparison", "curves"):
        assert np.asarray(Image.open(out / "figures" / f"{name}.png").convert("L")).std() > 5


def test_a_second_time_nothing_runs_unless_asked(whole, undrawn):
    out, _ = whole
    before = (out / "table.md").read_text()
    again = compared(load_scenario("main", SHORT), ["pd", "super_twisting"], (), 2, out)
    assert again.lines[0] == "4 runs: 0 new, 4 from earlier"
    assert (out / "table.md").read_text() == before
    again = compared(load_scenario("main", SHORT), "pd", (), 1, out, again=True)
    assert again.lines[0] == "1 runs: 1 new, 0 from earlier"


def test_a_comparison_is_a_study_with_its_report(whole, undrawn):
    out, result = whole
    assert "radius error" in result.report(out / "page.html").path.read_text()


def test_outer_loops_stand_beside_each_other(tmp_path, compiled, undrawn):
    result = compared(
        load_scenario("main", SHORT), "pd", ["nsb", "barrier_filter,potential_field"], 1, tmp_path
    )
    assert result.passed and len(result.lines) == 7
    table = (tmp_path / "table.md").read_text()
    assert table.startswith("# Outer loops compared: main") and "barrier filter" in table
    (folder,) = tmp_path.glob("runs/pd-potential_field-seed1-*")
    assert "potential_field" in (folder / "scenario.yaml").read_text()


def test_what_diverges_is_a_row_and_is_drawn(tmp_path, compiled):
    runaway = load_scenario("paper/case1_3d", {"controller.anti_windup": False, "expect": [], "duration": 20})
    result = compared(runaway, "apd_smc", (), 1, tmp_path)
    assert result.passed and any("diverged" in line for line in result.lines)
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["comparison.png"]
