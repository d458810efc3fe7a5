"""Commands that find things out without running anything: list, validate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from escort_mj.cli.app import BAD_INPUT, GOOD, Answer, app, command, shown_path
from escort_mj.cli.options import Overrides, Texts
from escort_mj.errors import EscortError, Fault, ScenarioError, UsageError
from escort_mj.recognize import scenario_names, scenarios_folder, study_names

if TYPE_CHECKING:
    from escort_mj.study.checked import Case

COMPONENTS = (
    *("laws", "behaviors", "outer-loops", "estimators", "radios", "sensors", "policies", "disturbances"),
    *("robots", "failures", "rules", "expectations"),
)
"""Kinds of components, each its `plural`, known here without their modules, which take long to import."""

Read = tuple[str, list[str]]
"""What a file holds, in words, and what to know of it."""


class Listed(NamedTuple):
    """One thing that can be named in a scenario, a study or a command.

    Attributes:
        name: Its name.
        unit: SI unit; empty where it has none.
        meaning: One sentence.
        window: Of a metric: the part of a run that it looks at.
        read: Of a metric: when it looks, at every physics step or at the samples.
        component: Of a value: the kind of component that can read it.
        form: Of a value: whether it is a number, a vector or an array.
    """

    name: str
    unit: str
    meaning: str
    window: str = ""
    read: str = ""
    component: str = ""
    form: str = ""

    def document(self) -> dict[str, str]:
        """Return what there is of it, for programs."""
        return {name: value for name, value in self._asdict().items() if value or name in self._fields[:3]}


def _lines(found: Mapping[str, list[Listed]], short: bool) -> Iterator[str]:
    """What was found, for a terminal; names alone where everything is listed."""
    for name, entries in found.items():
        if short:
            yield f"{name}: {', '.join(entry.name for entry in entries)}"
            continue
        width = max((len(entry.name) for entry in entries), default=0)
        for entry in entries:
            unit = f" [{entry.unit}]" if entry.unit else ""
            window = f"; {entry.window}, {entry.read}" if entry.window else ""
            of = f"{entry.component}: " if entry.component else ""
            yield f"  {entry.name:{width}}  {of}{entry.meaning}{unit}{window}"
    if short:
        yield f"escort-mj list {next(iter(found))} says what each is, and likewise for the others"


def _page(found: Mapping[str, list[Listed]]) -> Iterator[str]:
    """The same as Markdown."""
    from escort_mj.cli.handbook import TITLES, commands_page
    from escort_mj.record.tables import markdown

    for kind, entries in found.items():
        if kind == "commands":
            yield from commands_page()
            continue
        title, introduction = TITLES.get(kind, (kind.capitalize(), ""))
        yield from (f"# {title}\n", f"{introduction}\n")
        columns = ("component", "form", "unit", "window", "read")
        told = [name for name in columns if any(getattr(entry, name) for entry in entries)]
        rows = [
            [f"`{entry.name}`", *(getattr(entry, name) for name in told), _sentence(entry.meaning)]
            for entry in entries
        ]
        yield from markdown(["name", *told, "meaning"], rows)


def reference_pages() -> dict[str, str]:
    """Return the pages of the docs that are made from the code, by the names of their files."""
    from escort_mj.scenario.reader.handbook import handbook

    kinds = ("commands", "metrics", "signals", "values")
    made = {f"{kind}.md": "\n".join(_page({kind: [*LISTS[kind](())]})) for kind in kinds}
    return {"keys.md": handbook()} | made


def _sentence(text: str) -> str:
    return text if "_" in text.split(" ")[0] else text[:1].upper() + text[1:]


def _described(names: Callable[[Path], list[str]]) -> Callable[[Sequence[str]], Iterator[Listed]]:
    """List shipped files by their descriptions."""

    def entries(plugins: Sequence[str]) -> Iterator[Listed]:
        from escort_mj.scenario.reader.document import read_document

        folder = scenarios_folder()
        for name in names(folder):
            data = read_document((folder / f"{name}.yaml").read_text(encoding="utf-8"), name).data
            yield Listed(name, "", " ".join(str(data.get("description", "")).split()))

    return entries


def _components(plural: str) -> Callable[[Sequence[str]], Iterator[Listed]]:
    """List the components of a kind, sorted by the names that scenarios give them."""

    def entries(plugins: Sequence[str]) -> Iterator[Listed]:
        from escort_mj.scenario.kinds import TABLES, name_of
        from escort_mj.scenario.reader.catalog import catalog_of, scenario_type_with

        (base,) = (base for base in TABLES if base.plural == plural)
        for model in sorted(catalog_of(scenario_type_with(plugins)).of(base), key=name_of):
            yield Listed(name_of(model), "", _first(model.__doc__ or ""))

    return entries


def _metrics(plugins: Sequence[str]) -> Iterator[Listed]:
    from escort_mj.metrics.metric import Metric
    from escort_mj.scenario.reader.catalog import catalog_of, scenario_type_with

    for metric in catalog_of(scenario_type_with(plugins)).of(Metric):
        yield Listed(metric.name, metric.unit, metric.meaning, metric.span.words, metric.read)


def _signals(plugins: Sequence[str]) -> Iterator[Listed]:
    from escort_mj.signals import EPISODE, SIGNALS

    for signal in (*SIGNALS, *EPISODE):
        yield Listed(signal.name, signal.unit, signal.meaning)


def _figures(plugins: Sequence[str]) -> Iterator[Listed]:
    from escort_mj.report.figures.figures import PLOTS

    yield from dict.fromkeys(Listed(plot.name, "", plot.title.partition(",")[0]) for plot in PLOTS)


def _values(plugins: Sequence[str]) -> Iterator[Listed]:
    from escort_mj.cli.values import values_read

    for component, name, form, unit, meaning in values_read():
        yield Listed(name, unit, meaning, component=component, form=form)


def _commands(plugins: Sequence[str]) -> Iterator[Listed]:
    for each in app.registered_commands:
        yield Listed(str(each.name), "", _first(each.callback.__doc__ or ""))


def _first(text: str) -> str:
    """The first paragraph of a description."""
    return " ".join(text.split("\n\n")[0].split())


LISTS: dict[str, Callable[[Sequence[str]], Iterator[Listed]]] = {
    "scenarios": _described(scenario_names),
    "studies": _described(study_names),
    **{plural: _components(plural) for plural in COMPONENTS},
    "metrics": _metrics,
    "signals": _signals,
    "figures": _figures,
    "values": _values,
    "commands": _commands,
}


@command("list", flags={"kind": "kind"}, choices={"kind": LISTS})
def list_command(kind: str | None = None, markdown: bool = False, plugins: Texts = ()) -> Answer:
    """List available scenarios, studies, laws, behaviors, robots, metrics, signals and more.

    Example: escort-mj list

    Example: escort-mj list metrics

    Args:
        kind: Kind of items to list.
        markdown: Print a Markdown page.
    """
    found = {name: [*make(plugins)] for name, make in LISTS.items() if kind in (None, name)}
    if markdown:
        typer.echo("\n".join(_page(found)))
    told = {name: [entry.document() for entry in entries] for name, entries in found.items()}
    return Answer(() if markdown else _lines(found, kind is None), {"found": told})


@command("validate")
def validate_command(paths: Texts, overrides: Overrides = (), plugins: Texts = ()) -> Answer:
    """Validate scenarios and studies without running them. The exit code is 2 if any is invalid.

    All errors are reported together, except that a table with an invalid key is checked against other
    tables only once its own keys are valid.

    Example: escort-mj validate mine.yaml

    Example: escort-mj validate scenarios/ studies/minute

    Args:
        paths: Scenario or study files, folders of scenarios, or names of shipped scenarios and studies.
    """
    from escort_mj import api
    from escort_mj.study.checked import Case

    studies = [path for path in paths if _is_study(path)]
    if studies and (overrides or plugins):
        raise UsageError("--set and --plugin change scenarios; a study has its own keys set and plugins")
    cases = api.cases([path for path in paths if path not in studies])
    found = [_validated(case, partial(_scenario, case, overrides, plugins)) for case in cases]
    for study in studies:
        path = Path(api.study_path(study))
        found.append(_validated(Case(path, study), partial(_study, path)))
    faults = sum(len(one["faults"]) for one in found)
    return Answer(_verdicts(found), {"files": found}, BAD_INPUT if faults else GOOD)


def _is_study(path: str) -> bool:
    """Whether a path is a study's, by its name or the keys that only studies have."""
    if path in study_names(scenarios_folder()):
        return True
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8") if file.is_file() else ""
    except (OSError, ValueError):
        return False
    return any(line.startswith(("study:", "scenario:")) for line in text.splitlines())


def _scenario(case: Case, overrides: Overrides, plugins: Texts) -> Read:
    from escort_mj import api
    from escort_mj.scenario import robot_count
    from escort_mj.scenario.checks.expectations import notes

    if case.fault:
        raise ScenarioError([Fault(case.fault)])
    read = api.load_scenario(case.path, overrides, plugins)
    expected = len(read.expect)
    summary = (
        f"{robot_count(read)} robots, {read.axes} axes, {read.duration:g} s, "
        f"{expected} expectation{'s' * (expected != 1)}"
    )
    return summary, notes(read)


def _study(path: Path) -> Read:
    from escort_mj import api
    from escort_mj.study.sweeps.definition import load_study
    from escort_mj.study.sweeps.design import Design

    design = Design(load_study(path), api.scenarios_folder())
    return f"{len(design.cells)} cells, {len(design.seeds)} seeds: {len(design)} runs", []


def _validated(case: Case, read: Callable[[], Read]) -> dict[str, Any]:
    """One file: what it holds, or its faults."""
    summary, told = "", list[str]()
    faults: Sequence[Fault] = ()
    try:
        summary, told = read()
    except ScenarioError as error:
        faults = error.faults
    except EscortError as error:
        faults = [Fault(str(error))]
    return {
        "path": shown_path(case.path),
        "label": case.label,
        "summary": summary,
        "notes": told,
        "faults": [{**vars(fault), "text": str(fault)} for fault in faults],
    }


def _verdicts(found: list[dict[str, Any]]) -> Iterator[str]:
    width = max((len(one["label"]) for one in found), default=0)
    for one in found:
        count = len(one["faults"])
        words = f"{count} fault{'s' * (count > 1)}" if count else one["summary"]
        yield f"  {'BAD' if count else 'ok':3}  {one['label']:{width}}  {words}"
        for fault in one["faults"]:
            yield f"       {fault['text']}"
        for note in one["notes"]:
            yield f"       note: {note}"
