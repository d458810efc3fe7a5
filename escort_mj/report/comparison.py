"""Laws and outer loops side by side: tables and figures of a comparison, from the results of its study."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from escort_mj import palette
from escort_mj.files import write_json, write_text
from escort_mj.metrics.radius_error import radius_error
from escort_mj.record.folder import read_run
from escort_mj.record.tables import aligned, latex
from escort_mj.record.tables import markdown as markdown_rows
from escort_mj.report.figures.drawing.curves import draw_curves, log_scale, running_rms, timeline
from escort_mj.report.figures.drawing.scales import heading
from escort_mj.report.figures.drawing.style import FAILED, figure, rows_of_cells
from escort_mj.study.compare import LAW, LAWS, LOOP, title_of
from escort_mj.study.sweeps.quantities import COMPLETED, value_text
from escort_mj.study.sweeps.results import Results
from escort_mj.study.sweeps.statistics import LEVEL, Summary, counted

BRIEF = (
    "settling_time",
    "radius_error_mean",
    "true_error_rms",
    "true_error_max",
    "chattering",
    "obstacle_clearance_min",
)
DRAWN = (*BRIEF, "velocity_error_rms", "force_rms", "robot_clearance_min")
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)))
BAR = 0.19  # inches of height
MILLI = 1000.0


def spread_text(spread: Summary, unit: str, share: bool = False) -> str:
    """Mean, standard deviation, and how often never, for people; a share in percent."""
    never = f"never in {spread.never} of {spread.known}" if spread.never else ""
    if math.isnan(spread.mean):
        return "never" if spread.never else "-"
    small = unit in ("m", "m/s") and abs(spread.mean) < 1
    scale = 100.0 if share else MILLI if small else 1.0
    text = f"{100 * spread.mean:.3g} %" if share else value_text(spread.mean, unit)
    if spread.known - spread.never > 1:
        value, _, unit = text.partition(" ")
        decimals = len(value.partition(".")[2])
        text = f"{value} ± {scale * spread.deviation:.{decimals}f} {unit}".rstrip()
    return f"{text}, {never}" if never else text


class Comparison(NamedTuple):
    """A comparison as text.

    Attributes:
        results: Of its study.
        title: Of each combination: its law and its outer loop, in words.
        outcome: How the runs of each ended.
        columns: What each came to in each quantity; the best that tests tell is between `**`.
        marked: What is bold, and why nothing is where no test can tell.
    """

    results: Results
    title: list[tuple[str, str]]
    outcome: list[str]
    columns: dict[str, list[str]]
    marked: str

    @property
    def subject(self) -> str:
        """What is compared: laws, outer loops, or both."""
        factors = self.results.factors
        names = {LAW: "laws", LOOP: "outer loops"}
        return " and ".join(name for key, name in names.items() if len(factors[key].levels) > 1) or "laws"

    @property
    def labels(self) -> list[str]:
        """Of each combination: its law, and its outer loop where there are several."""
        lone = len(self.results.factors[LOOP].levels) == 1
        return [law if lone else f"{law} / {loop}" for law, loop in self.title]

    @property
    def about(self) -> str:
        """The scenario, and over how many seeds."""
        seeds = sorted({run.seed for run in self.results.runs})
        over = f"seed {seeds[0]}" if len(seeds) == 1 else f"mean ± standard deviation over {len(seeds)} seeds"
        end = max((row.simulated_time for row in self.results.rows.values()), default=0.0)
        return f"{self.results.name}, {end:g} s, {over}"


def comparison(results: Results) -> Comparison:
    """Put the results of a comparison's study into words."""
    names, cells = results.chosen, range(len(results.cells))
    told = results.told_best(names)
    columns = {}
    for name in names:
        unit, share = results.quantities[name].unit, name.startswith("saturated_share")
        texts = [spread_text(results.summary(name, index), unit, share) for index in cells]
        if name in told:
            texts[told[name][0]] = f"**{texts[told[name][0]]}**"
        columns[name] = texts
    labels = [results.labels(index) for index in cells]
    titles = [(title_of(one[LAW]), title_of(one[LOOP])) for one in labels]
    outcomes = [_outcomes(results, index) for index in cells]
    return Comparison(results, titles, outcomes, columns, _marked(results, bool(told)))


def _outcomes(results: Results, index: int) -> str:
    """How a combination's runs ended, in words."""
    ends = [row.outcome if row is not None else "not run" for row in results.rows_of(index)]
    if len(ends) == 1:
        return ends[0]
    return ", ".join(f"{end} {count} of {len(ends)}" for end, count in Counter(ends).items())


def _marked(results: Results, told: bool) -> str:
    """What is bold, and why nothing is where no test can tell."""
    rivals, seeds = len(results.cells) - 1, len(results.runs) // len(results.cells)
    if rivals < 1 or 2.0 ** (1 - seeds) * rivals >= 1.0 - LEVEL:
        words = f"{len(results.cells)} with {counted(seeds, 'seed')}"
        return f"Nothing is bold: by Wilcoxon's signed-rank test, none can be told the best of {words}."
    test = (
        f"better than each other controller that completed every run, by Wilcoxon's signed-rank test over "
        f"{counted(seeds, 'seed')}: p below {1.0 - LEVEL:.2g}, corrected for {counted(rivals, 'other')} "
        "(Bonferroni) and all quantities of the table (Holm)."
    )
    return f"**Bold**: {test}" if told else f"Nothing is bold: none is {test}"


def markdown(found: Comparison) -> list[str]:
    """The table for people, with the runs that did not complete."""
    results = found.results
    heads = [results.quantities[name].heading for name in found.columns]
    rows = [
        [*found.title[index], found.outcome[index], *(texts[index] for texts in found.columns.values())]
        for index in range(len(found.title))
    ]
    return [
        *markdown_rows(["law", "outer loop", "outcome", *heads], rows),
        "",
        f"`{results.name}`, {found.about.partition(', ')[2]}. {found.marked}",
        "",
        *(f"- {words}" for words in lost_of(results)),
    ]


def lost_of(results: Results) -> list[str]:
    """Runs that did not complete, a line each."""
    return [
        f"{results.title(run.cell)}, seed {run.seed}: {row.outcome}: {row.message}"
        for run in results.runs
        if (row := results.rows.get(run.key)) and row.outcome != COMPLETED
    ]


def page_of(found: Comparison) -> str:
    """The table as a page of its own, with what its columns mean."""
    shown = [found.results.quantities[name] for name in found.columns]
    head = [f"# {found.subject[0].upper()}{found.subject[1:]} compared: {found.results.name}", ""]
    return "\n".join([*head, *markdown(found), "", *(f"- {one.head}: {one.about}" for one in shown)]) + "\n"


def latex_of(found: Comparison) -> str:
    """Return the table for LaTeX, one quantity per row."""
    lines = [["outcome", *found.outcome]]
    lines += [[found.results.quantities[name].heading, *texts] for name, texts in found.columns.items()]
    return latex(["", *found.labels], lines, f"{found.about}. {found.marked.replace('**', '')}", "comparison")


def summary_of(found: Comparison) -> list[str]:
    """The table for a terminal: the quantities that tell most, one line per combination."""
    columns = [["", "", *(f"{law} / {loop}" for law, loop in found.title)]]
    for name, texts in found.columns.items():
        one = found.results.quantities[name]
        if name.startswith(BRIEF):
            columns.append([one.title, one.window, *(text.replace("**", "*") for text in texts)])
    columns.append(["outcome", "", *found.outcome])
    return [
        *aligned(zip(*columns, strict=True)),
        found.marked.replace("**", "").replace("Bold:", "*:"),
    ]


def document_of(found: Comparison) -> dict[str, Any]:
    """Everything that was measured, as JSON can hold it."""
    results = found.results
    labels = [results.labels(index) for index in range(len(results.cells))]
    named = [{"law": one[LAW], "outer": one[LOOP]} for one in labels]
    return {
        "scenario": results.name,
        "quantities": {name: results.quantities[name]._asdict() for name in found.columns},
        "best": {name: named[k] | {"p": p} for name, (k, p) in results.told_best(found.columns).items()},
        "combinations": [
            about
            | {"completed": int(results.of_cell(COMPLETED, index).sum())}
            | {"of": len(results.of_cell(COMPLETED, index))}
            | {"values": {name: _plain(results.summary(name, index)) for name in found.columns}}
            for index, about in enumerate(named)
        ],
        "runs": [
            named[run.cell]
            | {"seed": run.seed, "outcome": row.outcome, "message": row.message, "folder": row.folder}
            | {"values": {name: row.metrics.get(name) for name in found.columns}}
            for run in results.runs
            if (row := results.rows.get(run.key))
        ],
    }


def _plain(found: Summary) -> dict[str, Any]:
    mean = None if math.isnan(found.mean) else found.mean
    return {"mean": mean, "deviation": found.deviation, "never": found.never, "known": found.known}


def write_comparison(results: Results, folder: Path) -> tuple[list[str], list[str]]:
    """Write the tables and figures of a comparison.

    Args:
        results: Of its study.
        folder: Of the study.

    Returns:
        What to tell the user, and the files.
    """
    found = comparison(results)
    lost = [f"  {words}" for words in lost_of(results)]
    write_json(folder / "table.json", document_of(found))
    write_text(folder / "table.md", page_of(found))
    write_text(folder / "table.tex", latex_of(found))
    files = draw_comparison(folder, found)
    return lost + summary_of(found), ["table.md", "table.tex", "table.json", f"figures/ ({len(files)})"]


def draw_comparison(folder: Path, found: Comparison) -> list[Path]:
    """Draw the figures of a comparison into `figures/` of its folder and return their files.

    Raises:
        RunFolderError: If a run that completed is missing.
    """
    files = [draw_bars(folder / "figures" / "comparison.png", found)]
    if (found.results.values(COMPLETED) == 1.0).any():
        files.append(draw_curves_of(folder, found))
    return files


def _colors(results: Results) -> dict[str, palette.Color]:
    """A color for each law: those that come with the package, and the plugins' after them."""
    names = list(dict.fromkeys([*LAWS, *results.factors[LAW].levels]))
    return dict(zip(names, palette.robot_colors(len(names)), strict=True))


def draw_bars(path: Path, found: Comparison) -> Path:
    """One panel per quantity, a bar per combination, a dot per seed."""
    results = found.results
    names = [name for name in found.columns if name.startswith(DRAWN) and results.known([name])]
    height = -(-max(len(names), 1) // 3) * (0.76 + BAR * len(found.title)) + 0.4
    with figure(path, height, f"{results.name}: {found.subject} compared", width=9.6) as canvas:
        shown = rows_of_cells(canvas, len(names), 3, found.labels) if names else []
        for axes, name in zip(shown, names, strict=True):
            _bars(axes, name, found)
            axes.set_title(heading(results.quantities[name], "\n"))
    return path


def _bars(axes: Axes, name: str, found: Comparison) -> None:
    """One quantity; what has no value says why."""
    results, colors = found.results, _colors(found.results)
    unit = results.quantities[name].unit
    spreads = [results.summary(name, index) for index in range(len(found.title))]
    sizes = [abs(spread.mean) for spread in spreads if not math.isnan(spread.mean)]
    small = unit in ("m", "m/s") and max(sizes, default=1.0) < 1.0
    scale = MILLI if small else 1.0
    axes.set_xlabel(("m" if small else "") + unit, labelpad=1.0)
    axes.axvline(0.0, color="#555555", linewidth=0.7)
    axes.xaxis.set_major_locator(MaxNLocator(5))

    def note(words: str, x: float, place: int) -> None:
        how: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 7.0}
        axes.annotate(words, (x, place), (3, 0), color=FAILED, **how)

    for place, spread in enumerate(spreads):
        if math.isnan(spread.mean):
            completed = (results.of_cell(COMPLETED, place) == 1.0).any()
            note("never" if spread.never else "-" if completed else found.outcome[place], 0.0, place)
            continue
        color = colors[results.labels(place)[LAW]]
        axes.barh(place, scale * spread.mean, 0.72, color=color, alpha=0.55)
        values = results.of_cell(name, place)
        dots = scale * values[np.isfinite(values)]
        if len(dots) > 1:
            axes.plot(dots, [place] * len(dots), "o", color=color, markersize=2.6, clip_on=False)
        if spread.never:
            note(f"never in {spread.never}", scale * spread.mean, place)


def draw_curves_of(folder: Path, found: Comparison) -> Path:
    """Error of the worst robot's radius, and tracking error without noise, over time.

    Shown is the first seed with which a run completed.
    """
    results = found.results
    completed = results.values(COMPLETED) == 1.0
    seed, colors = results.runs[int(np.argmax(completed))].seed, _colors(results)
    flown: dict[str, None] = {}
    path = folder / "figures" / "curves.png"
    with figure(path, 5.6, f"{results.name}: {found.subject} over time, seed {seed}") as canvas:
        upper, lower = canvas.subplots(2, 1, sharex=True)
        time = np.zeros(1)
        for run in (one for one in results.runs if one.seed == seed):
            row, labels = results.rows.get(run.key), results.labels(run.cell)
            if row is None or row.outcome != COMPLETED or row.folder is None:
                continue
            trace = read_run(folder / row.folder).trace
            time = trace["time"].values
            radius = np.nanmax(np.abs(radius_error(trace)), axis=1)
            error = np.linalg.norm(trace["q_d"].values - trace["q"].values, axis=2).max(axis=1)
            flown[labels[LAW]] = None
            dash = DASHES[results.factors[LOOP].levels.index(labels[LOOP]) % len(DASHES)]
            for axes, curve in ((upper, radius), (lower, running_rms(time, error))):
                before = len(axes.lines)
                draw_curves(axes, time, curve[:, None], [colors[labels[LAW]]])
                for line in axes.lines[before:]:
                    line.set_linestyle(dash)
        upper.set(title="Largest error of the radius, any robot", ylabel="| |q - c| - R | [m]")
        title = "Largest tracking error without noise, any robot, running rms"
        lower.set(title=title, ylabel="|q_d - q| [m]")
        for axes in (upper, lower):
            log_scale(axes)
        timeline([upper, lower], time)
        keys = [(title_of(law), Line2D([], [], color=colors[law], linewidth=2.0)) for law in flown]
        loops = results.factors[LOOP].levels
        if len(loops) > 1:
            keys += [
                (title_of(loop), Line2D([], [], color="#555555", linestyle=DASHES[index % len(DASHES)]))
                for index, loop in enumerate(loops)
            ]
        words, handles = zip(*keys, strict=True)
        canvas.legend(handles, words, loc="outside lower center", ncols=3, columnspacing=1.3)
    return path
