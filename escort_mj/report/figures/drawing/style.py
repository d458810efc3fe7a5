"""One style for every figure: figures as objects, never matplotlib's global state."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.files import make_folder, replaced
from escort_mj.report.figures.drawing.fonts import FONT, finish_texts
from escort_mj.report.figures.drawing.look import NARROW, USUAL, WIDTH, Look, present

DPI = 200
COMPRESSION = 3  # of PNG: half the time of 6, the usual one, for files 10 % larger
SHOWN_DPI = 110  # in notebooks
LEGEND_LETTERS = 104  # that fit side by side in a legend
EDGE = 0.04  # kept free beside labels of axes in space [inches]
TITLE = 10.0
FAILED = palette.from_hex("B00020")

Key = tuple[str, Any]
"""A legend entry: its words, and an artist, or artists drawn on each other."""

_STYLE: Any = {
    "font.family": FONT,
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "grid.color": "#E3E5E8",
    "grid.linewidth": 0.6,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelcolor": "#222222",
    "ytick.labelcolor": "#222222",
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "lines.linewidth": 1.1,
    "lines.solid_capstyle": "round",
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.4,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.constrained_layout.use": True,
    "agg.path.chunksize": 20000,
    "path.simplify_threshold": 0.3,  # pixels
    "svg.hashsalt": "escort_mj",  # the same figure, the same file
    "pdf.fonttype": 42,  # TrueType: publishers refuse type 3
}


def _style(look: Look) -> Any:
    """The style in this look."""
    if look[1:] == USUAL[1:]:
        return _STYLE
    larger = look.size / USUAL.size
    sizes = {key: larger * _STYLE[key] for key in _STYLE if key.endswith((".size", "labelsize", "titlesize"))}
    sizes["legend.fontsize"] = larger * _STYLE["legend.fontsize"]
    return _STYLE | sizes | {"font.family": [look.font, FONT]}


class Canvas(Figure):
    """A figure that notebooks show, whatever backend matplotlib has there."""

    def _repr_png_(self) -> bytes:
        return png_of(self, SHOWN_DPI)


def png_of(figure: Figure, dpi: float) -> bytes:
    """A figure as PNG.

    Args:
        figure: The figure.
        dpi: Pixels per inch.
    """
    buffer = io.BytesIO()
    with matplotlib.rc_context(_STYLE):
        figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


@contextmanager
def canvas_of(height: float, title: str, note: str = "", width: float = WIDTH) -> Iterator[Canvas]:
    """A figure in this project's style and the present look, complete when the block ends.

    Args:
        height: In inches.
        title: Name of the scenario and what is shown.
        note: What a reader must know of the run, such as that it diverged; drawn in red.
        width: In inches, where the look leaves it to the figure.
    """
    look = present()
    with matplotlib.rc_context(_style(look)):
        canvas = Canvas(figsize=(look.width or width, height), dpi=DPI)
        FigureCanvasAgg(canvas)
        size = TITLE * look.size / USUAL.size
        line, lines = 1.5 * size / 72 / height, 0.0
        if look.title:
            canvas.text(0.01, 1.0 - 0.4 * line, title, va="top", fontsize=size, fontweight="bold")
            lines = 1.4
        if note:
            place = 1.0 - (lines - 0.1) * line if lines else 1.0 - 0.4 * line
            canvas.text(0.01, place, note, va="top", fontsize="medium", color=FAILED, fontweight="bold")
            lines += 0.9 if lines else 1.4
        canvas.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 1.0 - lines * line))
        yield canvas
        if narrow(canvas):
            _wrap_titles(canvas, 0.9 * width_of(canvas))
        finish_texts(canvas)


def _wrap_titles(canvas: Figure, width: float) -> None:
    """Break titles of panels that are wider than this [inches]."""
    letters = int(width * 72 / (0.62 * matplotlib.rcParams["axes.titlesize"]))
    for axes in canvas.axes:
        axes.set_title("\n".join(textwrap.wrap(axes.get_title("left"), letters)), loc="left")


@contextmanager
def figure(path: Path, height: float, title: str, note: str = "", width: float = WIDTH) -> Iterator[Figure]:
    """A figure in this project's style and the present look, saved when the block ends.

    Args:
        path: Where to save it; the suffix chooses the format.
        height: As of `canvas_of`.
        title: As of `canvas_of`.
        note: As of `canvas_of`.
        width: As of `canvas_of`.

    Raises:
        WriteError: If it cannot be saved; an earlier file of that name stays.
    """
    with matplotlib.rc_context(_style(present())):
        with canvas_of(height, title, note, width) as canvas:
            yield canvas
        make_folder(path.parent)
        kind = path.suffix.removeprefix(".")
        with replaced(path) as temporary:
            if kind == "png":
                agg: Any = canvas.canvas
                # `savefig` would draw it twice, once only to lay it out.
                agg.print_png(temporary, pil_kwargs={"compress_level": COMPRESSION})
            else:
                canvas.savefig(temporary, format=kind, metadata={"Date": None} if kind == "svg" else None)


def panels(canvas: Figure, count: int, across: int, **shared: Any) -> tuple[NDArray[Any], list[Axes]]:
    """Lay out panels row by row; the last of each column names its ticks.

    Args:
        canvas: Where to draw.
        count: How many there are.
        across: How many stand beside each other.
        shared: `sharex` and `sharey`, as for `Figure.subplots`.

    Returns:
        The grid, shape (rows, across), whose places beyond the last panel are empty; and the panels.
    """
    grid = canvas.subplots(-(-count // across), across, squeeze=False, **shared)
    for axes in grid.ravel()[count:]:
        axes.set_visible(False)
    shown = list(grid.ravel()[:count])
    for axes in shown[-across:]:
        axes.tick_params(labelbottom=True)
    return grid, shown


def rows_of_cells(canvas: Figure, count: int, across: int, labels: Sequence[str]) -> list[Axes]:
    """Lay out panels that have a row for each cell of a study, named beside the first column."""
    grid, shown = panels(canvas, count, across, sharey=True)
    for axes in grid[:, 0]:
        axes.set_yticks(range(len(labels)), labels, fontsize=7.5)
    for axes in shown:
        axes.grid(axis="y", visible=False)
    shown[0].set_ylim(len(labels) - 0.4, -0.6)
    return shown


def name_robots(
    figure: Figure, axes: Iterable[Axes], count: int, others: Sequence[Key] = (), one_by_one: bool = False
) -> None:
    """Says which color is which robot, outside of every panel: entries, or a color bar for a large team.

    Args:
        figure: The figure.
        axes: Its panels, beside which a color bar may stand.
        count: Number of robots.
        others: Further legend entries: words, and one artist or several on top of each other.
        one_by_one: Whether robots have their colors in a crowd, too.
    """
    keys, colors = list(others), palette.robot_colors(count)
    if count <= palette.MOST_DISTINCT:
        lines = [Line2D([], [], color=color, linewidth=2.0) for color in colors]
        keys = [*((f"robot {number}", line) for number, line in enumerate(lines, 1)), *keys]
    elif count <= palette.MOST_LINES or one_by_one:
        ramp = ScalarMappable(Normalize(0.5, count + 0.5), ListedColormap(colors))
        bar = figure.colorbar(ramp, ax=list(axes), fraction=0.025, pad=0.01, aspect=40)
        bar.set_label("robot")
        bar.outline.set_visible(False)
    legend(figure, keys)


def narrow(figure: Figure) -> bool:
    """Return whether panels of a figure, or of a part of one, stand below each other."""
    return width_of(figure) <= NARROW


def width_of(figure: Figure) -> float:
    """Return the width of a figure, or of a part of one [inches]."""
    return float(figure.bbox.width / figure.dpi)


def fit_marks(figure: Figure) -> None:
    """Make the marks of a figure that is narrower than a page smaller, in its panels and its legend.

    Areas shrink with the width. If diameters did, dots on a path would be as narrow as its line.
    """
    scale = min(float(np.sqrt(width_of(figure) / WIDTH)), 1.0)
    lines = [line for axes in figure.axes for line in axes.lines]
    for line in lines + [line for one in figure.legends for line in one.findobj(Line2D)]:
        line.set_markersize(scale * line.get_markersize())
    for dots in (dots for axes in figure.axes for dots in axes.collections):
        if isinstance(dots, PathCollection):
            dots.set_sizes(scale**2 * dots.get_sizes())


def legend(figure: Figure, keys: Sequence[Key]) -> None:
    """A legend below every panel, in rows that fit the figure's width."""
    if keys:
        words, handles = zip(*keys, strict=True)
        figure.legend(
            handles, words, loc="outside lower center", ncols=_columns(words, figure), columnspacing=1.3
        )


def _columns(words: Sequence[str], figure: Figure) -> int:
    """Columns of a legend that fits the figure's width, in rows as even as can be."""
    widest = max(len(word) for word in words) + 5.0
    room = LEGEND_LETTERS * width_of(figure) / WIDTH * USUAL.size / matplotlib.rcParams["font.size"]
    rows = -(-len(words) // max(int(room / widest), 1))
    return -(-len(words) // rows)


def room_in_space(figure: Figure, axes: Any) -> float:
    """By how much 3-D axes are to shrink for their labels to lie on nothing else; 1 if they do."""
    root = figure.get_figure(root=True)
    root.draw_without_rendering()
    drawn, box, edge = axes.get_tightbbox(), axes.bbox, EDGE * root.dpi
    x, y = (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2
    beside = [one.bbox.x0 for one in figure.axes if one is not axes]  # color bars
    right = min([figure.bbox.x1, *(left for left in beside if left > x)]) - edge
    bottom = max([figure.bbox.y0, *(one.get_window_extent().y1 for one in figure.legends)]) + edge
    ways = max(drawn.x1 - x, x - drawn.x0) / min(right - x, x - figure.bbox.x0 - edge)
    return float(1.0 / max(1.0, ways, (y - drawn.y0) / (y - bottom)))
