"""A run in a notebook: how it ended, its verdicts, and its paths in small."""

from __future__ import annotations

import base64
from collections.abc import Sequence

from markupsafe import Markup

from escort_mj.expect.verdicts import mark
from escort_mj.record.outcome import Verdict

COLORS = {"pass": "#1b7a3d", "xfail": "#1b7a3d", "skip": "#777777"}
FAILED = "#b00020"


def run_in_html(
    name: str, words: str, passed: bool, verdicts: Sequence[Verdict], picture: bytes | None = None
) -> str:
    """A run as HTML of a cell.

    Args:
        name: Of the run.
        words: How it ended.
        passed: Whether every verdict holds.
        verdicts: What was expected.
        picture: A PNG; None for none.
    """
    cell = Markup('<td style="text-align:left;color:{}">{}</td>')
    rows = []
    for one in verdicts:
        color = COLORS.get(mark(one), FAILED)
        cells = [cell.format(color, mark(one))]
        cells += [cell.format("inherit", words) for words in (one.metric, one.demanded, one.found)]
        rows.append(Markup("<tr>{}</tr>").format(Markup("").join(cells)))
    color = COLORS["pass"] if passed else FAILED
    head = Markup('<b>{}</b>: <span style="color:{}">{}</span>').format(name, color, words)
    table = Markup("<table>{}</table>").format(Markup("").join(rows))
    parts = [Markup("<div>{}</div>").format(head), table]
    if picture is not None:
        data = base64.b64encode(picture).decode()
        parts.append(Markup('<img alt="paths" src="data:image/png;base64,{}">').format(data))
    return str(Markup("").join(parts))
