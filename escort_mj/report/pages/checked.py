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
from escort_mj.expect.verdicts import mark
from escort_mj.record.outcome import Verdict
from escort_mj.study.checked import BAD_INPUT, BROKEN, GOOD, VERDICT_FAILED, Checked, SeedCount, seed_counts
from escort_mj.study.sweeps.statistics import counted

STATUS = {GOOD: "pass", VERDICT_FAILED: "FAIL", BAD_INPUT: "BAD", BROKEN: "BROKE"}
MOST_SEEDS = 12  # that are listed
_CONTROL = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # what XML cannot hold


def exit_code(results: Sequence[Checked]) -> int:
    """The gravest of all: 3 a run broke, 2 a file is wrong, 1 a verdict failed, 0 all is well."""
    return max((result.code for result in results), default=GOOD)


def checked_table(results: Sequence[Checked]) -> Iterator[str]:
    """The results for a terminal.

    A line per run and what failed in it; then, for each scenario with several seeds, how many of them pass
    and which do not; last the total. What nearly failed stands once for all seeds of a scenario.
    """
    width = max((len(result.label) for result in results), default=0)
    counts = seed_counts(results)
    for count in counts:
        for result in count.results:
            status, summary = STATUS[result.code], _summary(result)
            yield f"  {status:5}  {result.label:{width}}  {summary:24}  {result.wall_time:6.1f} s"
            for line in _details(result, alone=len(count.results) == 1):
                yield f"         {line}"
    for count in counts:
        if len(count.results) > 1:
            yield from _of_seeds(count)
    number = {code: sum(result.code == code for result in results) for code in STATUS}
    names = {GOOD: "passed", VERDICT_FAILED: "failed", BAD_INPUT: "cannot run", BROKEN: "broke"}
    told = ", ".join(f"{number[code]} {names[code]}" for code in STATUS if number[code])
    runs = f", {counted(len(results), 'run')}" if len(results) > len(counts) else ""
    yield f"{counted(len(counts), 'scenario')}{runs}: {told}"


def _of_seeds(count: SeedCount) -> Iterator[str]:
    """How many seeds of a scenario pass, in which of them an expectation fails, and what nearly does."""
    yield f"{count.label}: {count.passed} of {len(count.results)} seeds pass"
    for words, told in (("cannot run", lambda one: one.faults), ("breaks", lambda one: one.error)):
        if wrong := [result for result in count.results if told(result)]:
            yield f"  {words} with {_seeds(wrong)}"
    for verdicts in count.verdicts:
        if verdicts.failed:
            runs, (first, *_) = zip(*verdicts.failed, strict=True)
            yield f"  fails with {_seeds(runs)}: {first.metric} {first.demanded}"
        if verdicts.near:
            runs, (nearest, *_) = zip(*verdicts.near, strict=True)
            yield f"  near with {_seeds(runs)}; with seed {runs[0].seed} {nearest.message}"


def _seeds(runs: Sequence[Checked]) -> str:
    """The seeds of some runs, in order."""
    seeds = sorted(result.seed for result in runs if result.seed is not None)
    told = ", ".join(map(str, seeds[:MOST_SEEDS]))
    more = f" and {len(seeds) - MOST_SEEDS} more" if len(seeds) > MOST_SEEDS else ""
    return f"seed{'s' * (len(seeds) != 1)} {told}{more}"


def _summary(result: Checked) -> str:
    """How many verdicts held."""
    if result.faults:
        return counted(len(result.faults), "fault")
    if result.error:
        return "the program broke"
    known = sum(verdict.passed and bool(verdict.xfail) for verdict in result.verdicts)
    skipped = sum(bool(verdict.skip) for verdict in result.verdicts)
    words = f"{sum(verdict.passed for verdict in result.verdicts)} of {len(result.verdicts)} verdicts"
    return words + (f", {known} xfail" if known else "") + (f", {skipped} skipped" if skipped else "")


def _details(result: Checked, alone: bool) -> Iterator[str]:
    """What failed and where to look; of a scenario with one seed, what nearly failed, too."""
    yield from map(str, result.faults)
    if result.error:
        yield result.error.splitlines()[-1]
    for verdict in result.verdicts:
        if not verdict.passed or (alone and verdict.near_miss) or verdict.xfail or verdict.skip:
            word = mark(verdict) if not verdict.near_miss or not verdict.passed else "near"
            ending = f" ({result.message})" if verdict is result.verdicts[0] else ""
            yield f"{word}: {verdict.message}{ending}"
    if result.folder is not None and result.code != GOOD:
        yield f"kept: {_shown(result.clip or result.folder)}"
    if result.case.seed is not None and result.code != GOOD:
        yield f"again: {result.case.command}"
    if result.note:
        yield result.note


def junit(results: Sequence[Checked]) -> str:
    """JUnit XML as CI systems read it: a suite per scenario, a case per verdict."""
    root = ElementTree.Element("testsuites", name="escort-mj check")
    for result in results:
        suite = ElementTree.SubElement(root, "testsuite", name=_clean(result.label))
        if result.seed is not None:
            properties = ElementTree.SubElement(suite, "properties")
            ElementTree.SubElement(properties, "property", name="seed", value=str(result.seed))
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
        attached = f"\n[[ATTACHMENT|{_shown(kept)}]]" if kept else ""
        _add(case, kind, verdict.message, f"again: {result.case.command}{attached}")
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
        "seeds": [
            {
                "scenario": count.label,
                "runs": len(count.results),
                "passed": count.passed,
                "failed": count.failed,
            }
            for count in seed_counts(results)
        ],
    }


def _as_json(result: Checked) -> dict[str, Any]:
    """One run for programs."""
    about = {"path": _shown(result.path), "label": result.label, "scenario": result.case.label}
    known = about | asdict(result) | {"exit_code": result.code}
    for name in ("folder", "clip"):
        known[name] = _shown(known[name]) if known[name] else None
    lines = [result.line(verdict) for verdict in result.verdicts]
    known["verdicts"] = [asdict(v) | {"line": line} for v, line in zip(result.verdicts, lines, strict=True)]
    del known["lines"], known["case"]
    return known


def github(results: Sequence[Checked]) -> Iterator[str]:
    """GitHub's workflow commands: errors, and warnings of near misses, at the line of each expectation.

    An expectation that fails with several seeds of a scenario is one error, as is one warning what nearly
    fails with several: GitHub shows ten of each kind.
    """
    for count in seed_counts(results):
        for result in count.results:
            for fault in result.faults:
                yield _annotation("error", result, fault.line or 1, "wrong scenario", _without_place(fault))
            if result.error:
                yield _annotation("error", result, 1, "the program broke", result.error.splitlines()[-1])
        for verdicts in count.verdicts:
            for kind, found in (("error", verdicts.failed), ("warning", verdicts.near)):
                if found:
                    runs, (verdict, *_) = zip(*found, strict=True)
                    several = len(count.results) > 1
                    of = f"; {len(runs)} of {len(count.results)} seeds, {_seeds(runs)}" if several else ""
                    words = verdict.message + of
                    yield _annotation(kind, runs[0], runs[0].line(verdict), verdict.metric, words)


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
