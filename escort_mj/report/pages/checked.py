"""What came of checked scenarios, written as a table, JUnit XML, JSON or GitHub annotations."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from escort_mj.errors import Fault, visible
from escort_mj.expect.verdicts import Verdict, mark
from escort_mj.study.checked import BAD_INPUT, BROKEN, GOOD, VERDICT_FAILED, Checked

STATUS = {GOOD: "pass", VERDICT_FAILED: "FAIL", BAD_INPUT: "BAD", BROKEN: "BROKE"}
_CONTROL = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # what XML cannot hold


def exit_code(results: Sequence[Checked]) -> int:
    """The gravest of all: 3 a run broke, 2 a file is wrong, 1 a verdict failed, 0 all is well."""
    return max((result.code for result in results), default=GOOD)


def checked_table(results: Sequence[Checked]) -> Iterator[str]:
    """The results for a terminal: a line per scenario, and below it what failed or nearly did."""
    width = max((len(result.label) for result in results), default=0)
    for result in results:
        status, summary = STATUS[result.code], _summary(result)
        yield f"  {status:5}  {result.label:{width}}  {summary:24}  {result.wall_time:6.1f} s"
        for line in _details(result):
            yield f"         {line}"
    count = {code: sum(result.code == code for result in results) for code in STATUS}
    names = {GOOD: "passed", VERDICT_FAILED: "failed", BAD_INPUT: "cannot run", BROKEN: "broke"}
    told = ", ".join(f"{count[code]} {names[code]}" for code in STATUS if count[code])
    yield f"{len(results)} scenario{'s' * (len(results) != 1)}: {told}"


def _summary(result: Checked) -> str:
    """How many verdicts held."""
    if result.faults:
        return f"{len(result.faults)} fault{'s' * (len(result.faults) > 1)}"
    if result.error:
        return "the program broke"
    known = sum(verdict.passed and bool(verdict.xfail) for verdict in result.verdicts)
    skipped = sum(bool(verdict.skip) for verdict in result.verdicts)
    words = f"{sum(verdict.passed for verdict in result.verdicts)} of {len(result.verdicts)} verdicts"
    return words + (f", {known} xfail" if known else "") + (f", {skipped} skipped" if skipped else "")


def _details(result: Checked) -> Iterator[str]:
    """What failed, what nearly failed, and where to look."""
    yield from map(str, result.faults)
    if result.error:
        yield result.error.splitlines()[-1]
    for verdict in result.verdicts:
        if not verdict.passed or verdict.near_miss or verdict.xfail or verdict.skip:
            word = mark(verdict) if not verdict.near_miss or not verdict.passed else "near"
            ending = f" ({result.message})" if verdict is result.verdicts[0] else ""
            yield f"{word}: {verdict.message}{ending}"
    if result.folder is not None and result.code != GOOD:
        yield f"kept: {_shown(result.clip or result.folder)}"
    if result.note:
        yield result.note


def junit(results: Sequence[Checked]) -> str:
    """JUnit XML as CI systems read it: a suite per scenario, a case per verdict."""
    root = ElementTree.Element("testsuites", name="escort-mj check")
    for result in results:
        suite = ElementTree.SubElement(root, "testsuite", name=_clean(result.label))
        for place, verdict in enumerate(result.verdicts):
            _case(suite, result, verdict, result.wall_time if place == 0 else 0.0)
        if not result.verdicts:
            case = _new_case(suite, result, "scenario", 1, result.wall_time)
            words = "\n".join(map(str, result.faults)) or result.error
            _add(case, "error", words.splitlines()[-1] if result.error else words.splitlines()[0], words)
        _count(suite, [suite])
        suite.set("time", f"{result.wall_time:.3f}")
    _count(root, list(root))
    root.set("time", f"{sum(result.wall_time for result in results):.3f}")
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _new_case(
    suite: ElementTree.Element, result: Checked, name: str, line: int, seconds: float
) -> ElementTree.Element:
    """A test case; many CI systems link it by file and line."""
    about = {"classname": _clean(result.label), "name": _clean(name), "time": f"{seconds:.3f}"}
    return ElementTree.SubElement(suite, "testcase", about | {"file": _shown(result.path), "line": str(line)})


def _case(suite: ElementTree.Element, result: Checked, verdict: Verdict, seconds: float) -> None:
    """A verdict as a test case; a run that broke is an error, all else that fails a failure."""
    name = f"{verdict.metric} {verdict.demanded}"
    case = _new_case(suite, result, name, result.line(verdict), seconds)
    if verdict.skip:
        _add(case, "skipped", verdict.message, "", "escort_mj.skip")
    elif verdict.passed and verdict.xfail:
        _add(case, "skipped", verdict.message, "", "escort_mj.xfail")
    elif not verdict.passed:
        kind = "error" if verdict is result.verdicts[0] else "failure"
        kept = result.clip or result.folder
        # As Jenkins and GitLab attach files to a case.
        _add(case, kind, verdict.message, f"[[ATTACHMENT|{_shown(kept)}]]" if kept else "")
    elif verdict.near_miss:
        ElementTree.SubElement(case, "system-out").text = _clean(verdict.message)


def _add(case: ElementTree.Element, kind: str, message: str, text: str, type_: str = "verdict") -> None:
    """What happened to a case."""
    ElementTree.SubElement(case, kind, message=_clean(message), type=type_).text = _clean(
        f"{message}\n{text}"
    )


def _count(element: ElementTree.Element, within: list[ElementTree.Element]) -> None:
    """Counts cases and what happened to them."""
    cases = [case for part in within for case in part.iter("testcase")]
    element.set("tests", str(len(cases)))
    for kind, plural in (("failure", "failures"), ("error", "errors"), ("skipped", "skipped")):
        element.set(plural, str(sum(case.find(kind) is not None for case in cases)))


def _clean(text: str) -> str:
    """Text that XML can hold."""
    return _CONTROL.sub("?", text)


def as_json(results: Sequence[Checked]) -> dict[str, Any]:
    """All of it, for programs."""
    return {
        "passed": exit_code(results) == GOOD,
        "exit_code": exit_code(results),
        "scenarios": [_as_json(result) for result in results],
    }


def _as_json(result: Checked) -> dict[str, Any]:
    """One scenario for programs."""
    known = asdict(result) | {"path": _shown(result.path), "exit_code": result.code}
    for name in ("folder", "clip"):
        known[name] = _shown(known[name]) if known[name] else None
    lines = [result.line(verdict) for verdict in result.verdicts]
    known["verdicts"] = [asdict(v) | {"line": line} for v, line in zip(result.verdicts, lines, strict=True)]
    del known["lines"]
    return known


def github(results: Sequence[Checked]) -> Iterator[str]:
    """GitHub's workflow commands: errors, and warnings of near misses, at the line of each expectation."""
    for result in results:
        for fault in result.faults:
            yield _annotation("error", result, fault.line or 1, "wrong scenario", _without_place(fault))
        if result.error:
            yield _annotation("error", result, 1, "the program broke", result.error.splitlines()[-1])
        for verdict in result.verdicts:
            if not verdict.passed:
                yield _annotation("error", result, result.line(verdict), verdict.metric, verdict.message)
            elif verdict.near_miss:
                yield _annotation("warning", result, result.line(verdict), verdict.metric, verdict.message)


def _without_place(fault: Fault) -> str:
    return ": ".join(part for part in (fault.key, fault.message) if part)


def _annotation(kind: str, result: Checked, line: int, title: str, message: str) -> str:
    """One workflow command; GitHub reads percent codes in it."""
    about = {"file": _shown(result.path), "line": str(line), "title": f"{result.label}: {title}"}
    words = ",".join(
        f"{key}={_escaped(value).replace(':', '%3A').replace(',', '%2C')}" for key, value in about.items()
    )
    return f"::{kind} {words}::{_escaped(message)}"


def _escaped(text: str) -> str:
    return "%0A".join(visible(line).replace("%", "%25") for line in re.split(r"\r\n?|\n", text))


def _shown(path: Path) -> str:
    """A path as short as it can be typed from here."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative
