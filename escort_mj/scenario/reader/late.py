"""What lies beyond the end of a run that an override made shorter: it is left out, or not judged."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import reduce
from operator import getitem
from typing import Any

from escort_mj.scenario.findings import Finding
from escort_mj.scenario.reader.document import Document

_NOTE = re.compile(r"its window (begins|ends) at \S+ s, the run ends at \S+ s")


def judged_again(document: Document, data: dict[str, Any]) -> None:
    """Takes back what `left_out` noted when the run was to end earlier; the duration was set again.

    Args:
        document: Where values come from.
        data: The scenario's; changed in place.
    """
    expected = data.get("expect")
    if not document.is_overridden(("duration",)) or not isinstance(expected, list):
        return
    for one in expected:
        if isinstance(one, dict) and isinstance(why := one.get("skip"), str) and _NOTE.fullmatch(why):
            del one["skip"]


def late(document: Document, found: Sequence[Finding]) -> list[Finding]:
    """The findings of what lies beyond the end of the run only because its duration was set, and not it."""
    if not document.is_overridden(("duration",)):
        return []
    return [finding for finding in found if finding.late and not document.is_overridden(finding.path)]


def left_out(data: dict[str, Any], found: Sequence[Finding]) -> None:
    """Marks expectations as not judged, and leaves out phases, failures and demands that come too late.

    Args:
        data: The scenario's; changed in place.
        found: From `late`.
    """
    gone: set[tuple[Any, ...]] = set()
    for finding in found:
        if finding.path[0] == "expect":
            data["expect"][finding.path[1]]["skip"] = (
                f"{finding.late}, the run ends at {data['duration']:g} s"
            )
        else:
            items = [depth for depth, key in enumerate(finding.path, 1) if isinstance(key, int)]
            gone.add(finding.path[: max(items, default=None)])
    for *table, place in sorted(gone, reverse=True):
        del reduce(getitem, table, data)[place]
