"""The page of a study: complete, whole in one file, and right in a real browser."""

import math
import re
from pathlib import Path
from urllib.parse import unquote

import pytest
from typer.testing import CliRunner

from escort_mj.cli import app
from escort_mj.errors import UsageError
from escort_mj.report.figures.studies import curves, heat_maps
from escort_mj.report.pages.html import Table, Text, templates
from escort_mj.report.pages.study_page import write_study_page
from escort_mj.scenario import parse_scenario
from escort_mj.study.engine.store import Store
from escort_mj.study.sweeps.results import open_results, record_of
from escort_mj.study.sweeps.worst import failed_runs, write_scenario
from tests.plugged import METRIC
from tests.report.browser import Page, look, needs_browser
from tests.study.planted import design, study_folder

PROBE = """
document.querySelector("table.sortable th:nth-child(3) button").click();
tell({
  widths: [...document.images].map(image => image.naturalWidth),
  order: [...document.querySelector("table.sortable tbody").rows].map(row => row.cells[2].textContent),
});"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Most of its pictures are empty: how they look is tested where they are drawn."""
    out = study_folder(tmp_path_factory.mktemp("page"))
    (out / "figures").mkdir()
    empty = '<svg xmlns="http://www.w3.org/2000/svg" width="500" height="300"/>'
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((heat_maps, "draw_map"), (curves, "draw_study_curves")):
            patch.setattr(module, name, lambda path, *_: path.write_text(empty))
        write_study_page(out)
    return out


@pytest.fixture
def few(tmp_path: Path) -> Path:
    """A study of few figures, without its page."""
    return study_folder(tmp_path, "study: few\nscenario: main\nset: {expect: []}\nseeds: 4\n")


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    return (folder / "report.html").read_text()


def test_the_page_holds_everything_itself(text: str) -> None:
    page = Page(text)
    assert not page.open
    sources = [a["src"] for tag in ("img", "script") for a in page.all(tag) if "src" in a]
    assert len(sources) == 7 and all(source.startswith("data:image/svg+xml;base64,") for source in sources)
    assert all(a["alt"] for a in page.all("img"))
    assert [a["href"] for a in page.all("link")] == ["data:,"]
    assert "url(" not in text and "@import" not in text


def test_every_link_leads_somewhere(folder: Path, text: str) -> None:
    targets = [unquote(a["href"]) for a in Page(text).all("a")]
    assert {"study.yaml", "runs.csv", "cells.csv", "runs/kept/"} > {*targets} - {"study.yaml"}
    assert targets and all((folder / target).exists() for target in targets)


def test_a_page_elsewhere_links_back(few: Path, tmp_path: Path) -> None:
    path = write_study_page(few, tmp_path / "study.html")
    targets = [unquote(a["href"]) for a in Page(path.read_text()).all("a")]
    assert targets and all((path.parent / target).exists() for target in targets)


def test_tables_are_marked_up(text: str) -> None:
    page = Page(text)
    tables = len(page.all("table"))
    assert tables >= 6 and len(page.all("caption")) == tables
    assert all(head.get("scope") in ("row", "col") for head in page.all("th"))


def test_what_users_wrote_is_text(text: str) -> None:
    assert "mass &amp; force limit, &lt;planted&gt;." in text
    assert "robot 3 left the mission &amp; is &lt;gone&gt;" in text and "<gone>" not in text


def test_failures_are_rows_with_their_messages(text: str) -> None:
    section = text.partition("<h2>Failures</h2>")[2].partition("<h2>")[0]
    assert section.count("<tr>") == 1 + 3 + 9 + 12  # head, broken ASMC, the rest of heavy ASMC, heavy PD
    assert section.count("robot 3 left") == 3 and "radius_error_mean at most 0.1 m: 0.10" in section


def test_the_worst_runs_have_a_command_each(folder: Path, text: str) -> None:
    section = text.partition("<h2>Worst runs</h2>")[2]
    commands = re.findall(r"<code>escort-mj run (\S+) --out (\S+)</code>", section)
    assert len(commands) >= 15 and all(Path(scenario).is_file() for scenario, _ in commands)
    never = section.index("settling time, whole run")
    assert ">never<" in section[never : never + 200]


def test_a_broken_run_that_left_no_scenario_gets_it_back(tmp_path: Path) -> None:
    out = study_folder(tmp_path, planter=lambda cell, seed: "broke" if seed == 2 else {"energy": 1.0})
    results = open_results(out)
    run = failed_runs(results)[0]
    path = write_scenario(results, run, out)
    assert path is not None and run.seed == 2
    scenario = parse_scenario(path.read_text())
    assert scenario == design(tmp_path).scenario(results.cells[run.cell], 2)


def test_cells_as_numbers_for_other_programs(folder: Path) -> None:
    head, *lines = (folder / "cells.csv").read_text().splitlines()
    assert len(lines) == 27 and head.startswith(
        "cell,controller,robots.mass [kg],robots.force_limit [N],runs,failed,passed_times"
    )
    first = dict(zip(head.split(","), lines[0].split(","), strict=True))
    assert float(first["radius_error_mean_mean [m]"]) == pytest.approx(0.0045)
    assert float(first["passed_low"]) == pytest.approx(0.025**0.25)
    last = dict(zip(head.split(","), lines[-1].split(","), strict=True))
    assert float(last["settling_time_median [s]"]) == math.inf and last["settling_time_mean [s]"] == ""


def test_cells_as_tables_for_papers(folder: Path) -> None:
    """They say which expectations failed, and of levels compared the probabilities of error."""
    for name, mark in (("cells.md", "| cell | controller | robots.mass [kg] |"), ("cells.tex", r"\toprule")):
        words = (folder / name).read_text()
        assert mark in words and "at most 0.1 m (" in words and "Wilcoxon" not in words
        assert "Levels of controller against apd" in words and "settling" in words
    last = (folder / "cells.csv").read_text().splitlines()[-1]
    assert "radius_error_mean at most 0.1 m (" in last


def test_metrics_of_plugins_are_in_the_tables(tmp_path: Path) -> None:
    """With their unit, and without the plugin: a report needs nothing but the folder."""
    plugin = tmp_path / "own_metric.py"
    plugin.write_text(METRIC)
    text = (
        "study: own\nscenario: main\n"
        "set: {plugins: [own_metric.py], expect: [{metric: farthest, at_most: 9}]}\n"
        "vary: {controller: [apd_smc, pd]}\nseeds: 2\n"
    )
    out = study_folder(tmp_path, text, lambda cell, seed: {"farthest": 3.0 + seed, "contacts": 0.0})
    plugin.unlink()
    results = open_results(out)
    assert results.metrics["farthest"].unit == "m" and "farthest" in results.known(results.metrics)
    write_study_page(out)
    head, first, *_ = (out / "cells.csv").read_text().splitlines()
    assert dict(zip(head.split(","), first.split(","), strict=True))["farthest_mean [m]"] == "4.5"
    assert "Also in" in (page := (out / "report.html").read_text()) and "farthest" in page


@pytest.mark.slow
def test_the_same_results_give_the_same_page(few: Path) -> None:
    assert write_study_page(few).read_text() == write_study_page(few).read_text()


@pytest.mark.slow
def test_the_command_writes_figures_for_papers_too(few: Path) -> None:
    looks = ["--figure-format", "pdf", "--width", "88mm", "--font-size", "7", "--no-title"]
    done = CliRunner().invoke(app, ["report", str(few), *looks])
    assert done.exit_code == 0, done.output
    figures = few / "figures"
    for picture in figures.glob("*.svg"):
        width = float(re.search(r'<svg [^>]*width="([\d.]+)pt"', picture.read_text())[1])
        assert width == pytest.approx(88 / 25.4 * 72, abs=0.01)
        assert picture.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
    assert {path.suffix for path in figures.iterdir()} == {".svg", ".pdf"}


def test_tables_show_chosen_quantities(few: Path) -> None:
    chosen = ("--quantity", "force_rms", "--quantity", "energy")
    done = CliRunner().invoke(app, ["report", str(few), *chosen])
    assert done.exit_code == 0, done.output
    head = next(line for line in (few / "cells.tex").read_text().splitlines() if "[N]" in line)
    assert head.index("[N]") < head.index("[J]") and "radius" not in head
    with pytest.raises(UsageError, match='found energie, which is no metric .* did you mean "energy"'):
        write_study_page(few, quantities=["energie"])


def test_a_study_without_runs_has_a_page(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with Store(out):
        record_of(design(tmp_path)).write(out)
    assert "108 of 108 runs have not been made yet" in write_study_page(out).read_text()


def test_cells_of_tables_are_escaped_and_sorted_by_value() -> None:
    cells = Table("a <b>", [("x", 'a "b"')], [[Text("<1>", math.nan)], [Text("never", math.inf)]])
    made = templates().get_template("parts.html").module.table(cells)
    assert "&lt;1&gt;" in made and made.count('data-value="Infinity"') == 2 and "<b>" not in made
    assert Page(made).all("th")[0] == {"scope": "col", "title": 'a "b"'}


@needs_browser
def test_a_browser_shows_all_and_complains_of_nothing(folder: Path, tmp_path: Path) -> None:
    found, errors = look(folder / "report.html", tmp_path, PROBE)
    assert errors == []
    assert len(found["widths"]) == 7 and min(found["widths"]) > 300
    assert found["order"] == sorted(found["order"], key=float) and found["order"][0] == "0.2"


@needs_browser
def test_the_browser_would_have_complained(folder: Path, text: str, tmp_path: Path) -> None:
    spoiled = folder / "spoiled.html"
    spoiled.write_text(text.replace("</body>", "<img src='missing.png'><script>nothing()</script></body>"))
    found, errors = look(spoiled, tmp_path, PROBE)
    assert any("nothing is not defined" in line for line in errors)
    assert found["widths"][-1] == 0
