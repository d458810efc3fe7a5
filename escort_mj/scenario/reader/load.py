"""Scenarios read from YAML: every fault of a file found at once, each with its place and what is allowed."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from copy import deepcopy
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from escort_mj import stopping
from escort_mj.components.parameters import STRICT
from escort_mj.errors import Fault, PluginError, ScenarioError, UsageError
from escort_mj.plugin_calls import Trespass, blamed, confined
from escort_mj.scenario.arguments import Overrides
from escort_mj.scenario.checks import whole as checks
from escort_mj.scenario.findings import Finding, Path, did_you_mean, key_path, nearest, shortened, shown
from escort_mj.scenario.reader import explain
from escort_mj.scenario.reader.catalog import catalog_of, resolve_plugins
from escort_mj.scenario.reader.document import Document, Place, line_and_column, read_document
from escort_mj.scenario.reader.dump import differing
from escort_mj.scenario.reader.files.robots import read_robots
from escort_mj.scenario.reader.files.roots import take_root
from escort_mj.scenario.reader.files.scenery import read_scenery
from escort_mj.scenario.reader.files.waypoints import read_tables
from escort_mj.scenario.reader.gains import with_gains, without_gains
from escort_mj.scenario.reader.late import judged_again, late, left_out
from escort_mj.scenario.reader.overrides import apply
from escort_mj.scenario.reader.plain import document_of, tuples
from escort_mj.scenario.reader.plugins import load_plugin, source_of
from escort_mj.scenario.schema.scenario import Scenario

MAX_BYTES = 1_000_000
COPIES = "plugins"  # in a run folder: the plugin files that took part
NO_DEMAND = {"sanity": "all"}  # an expectation that nothing can be wrong with stands in for a wrong one


def load_file(
    path: str | os.PathLike[str], overrides: Overrides = (), plugins: Sequence[str] = ()
) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: A YAML file.
        overrides: Texts `key.path=value` with values as YAML, or a mapping from key paths to values;
            they are set in this order before anything is checked.
        plugins: Plugins beside those that the file names: Python files or names of installed ones.

    Raises:
        UsageError: If there is no such file or it cannot be read.
        ScenarioError: With every fault found.
    """
    source = os.fspath(path)
    return parse_scenario(read_text(FilePath(source)), source, overrides, plugins)


def parse_scenario(
    text: str, source: str = "<text>", overrides: Overrides = (), plugins: Sequence[str] = ()
) -> Scenario:
    """Read and check a scenario given as YAML text.

    Args:
        text: The YAML.
        source: What to call it in messages; plugin files that it names are looked for in its folder.
        overrides: As for `load_scenario`.
        plugins: As for `load_scenario`.

    Raises:
        ScenarioError: With every fault found.
    """
    return Template(text, source).scenario(overrides, plugins)


def scenario_of(
    data: Mapping[str, Any] | Scenario,
    overrides: Overrides = (),
    plugins: Sequence[str] = (),
    kind: type[Scenario] | None = None,
) -> Scenario:
    """Check a scenario given as Python's own data; NumPy's arrays and scalars do for lists and numbers.

    Args:
        data: Keys and values as in a file, or a scenario to be changed; plugin files that it names are looked
            for from here.
        overrides: As for `load_scenario`.
        plugins: As for `load_scenario`.
        kind: The type of scenario where its plugins are loaded already; None to load those that it names.

    Raises:
        ScenarioError: With every fault found.
        PluginError: If one of the plugins given here cannot be loaded.
    """
    written = differing(data) if isinstance(data, Scenario) else data
    return _laid_over(document_of(written), overrides, plugins, "", kind)


def _laid_over(
    document: Document,
    overrides: Overrides,
    plugins: Sequence[str],
    source: str,
    kind: type[Scenario] | None = None,
) -> Scenario:
    """The checked scenario of a document, which is changed, with overrides and plugins."""
    named = deepcopy(document.data.get("plugins"))
    unset = apply(document, overrides)
    data = dict(document.data)
    if plugins:
        told = [load_plugin(source_of(each, FilePath())).source.model_dump() for each in plugins]
        data["plugins"] = [*(data.get("plugins") or ()), *told]
    loaded = kind if data.get("plugins") == named and not unset else None
    return _scenario(document, data, unset, source, loaded)


def stored_scenario(text: str, file: FilePath) -> Scenario:
    """The scenario of a run folder. Of plugin files the run's own copies are taken, whatever became of them.

    Args:
        text: Its content.
        file: The scenario's file in the run folder.

    Raises:
        ScenarioError: With every fault found.
    """
    template = Template(text, str(file))
    plugins = template.overridden().get("plugins")
    if not isinstance(plugins, list) or not all(isinstance(each, dict) for each in plugins):
        return template.scenario()  # none, or faults
    copies = [each | {"sha256": None} for each in plugins]
    for each in copies:
        if (
            isinstance(each.get("file"), str)
            and (copy_of := file.parent / COPIES / FilePath(each["file"]).name).is_file()
        ):
            each["file"] = str(copy_of.absolute())
    return template.scenario({"plugins": copies})


class Template:
    """A scenario's text read once, from which scenarios with different overrides are made.

    Attributes:
        text: The YAML.
        source: What to call it in messages.
    """

    def __init__(self, text: str, source: str = "<text>") -> None:
        """Read the text.

        Args:
            text: The YAML.
            source: What to call it in messages.

        Raises:
            ScenarioError: If it is no table in YAML.
        """
        if len(text) > MAX_BYTES:
            raise _too_long(source)
        self.text, self.source = text, source
        self._document = read_document(text, source)
        if isinstance(self._document.data, dict):
            return
        found = "nothing" if self._document.data is None else shown(self._document.data)
        place = self._document.place(()) if self._document.values else Place(source, 1, 1)
        raise ScenarioError(
            [_fault(f"found {found}; a scenario is a table of keys such as duration: 30", "", place)]
        )

    def overridden(self, overrides: Overrides = ()) -> dict[str, Any]:
        """The plain data with overrides, not checked any further.

        Raises:
            ScenarioError: If a key cannot be set.
        """
        document = self._document.copy()
        if faults := apply(document, overrides):
            raise ScenarioError(faults)
        data, roots, _ = take_root(document.data, FilePath(self.source).parent)
        return read_tables(data, roots)[0]

    def scenario(self, overrides: Overrides = (), plugins: Sequence[str] = ()) -> Scenario:
        """The checked scenario with overrides and plugins, as `load_scenario`.

        Raises:
            ScenarioError: With every fault found.
            PluginError: If one of the plugins given here cannot be loaded.
        """
        document = self._document.copy() if overrides else self._document
        return _laid_over(document, overrides, plugins, self.source)


def _scenario(
    document: Document,
    data: dict[str, Any],
    unset: list[Fault],
    source: str,
    kind: type[Scenario] | None = None,
) -> Scenario:
    """Check a document together with its overrides."""
    findings: list[Finding] = []
    data, roots, rootless = take_root(data, FilePath(source).parent)
    data, wrong = read_tables(data, roots)
    data, origins, unread = read_scenery(data, roots)
    wrong += unread
    if kind is None:
        kind, findings = resolve_plugins(data, FilePath(source).parent)
    data, unknown_robots = (data, rootless) if rootless else read_robots(data, roots)
    data, auto, unknown = without_gains(data)
    known = not findings
    findings += unknown_robots
    scenario = None
    if not findings:
        judged_again(document, data)
        scenario, findings = _checked(data, kind)
        tables = [finding.path for finding in wrong]
        findings = [finding for finding in findings if finding.path not in tables] + wrong
        if beyond := late(document, findings):
            findings = [finding for finding in findings if finding not in beyond]
            left_out(data, beyond)
            scenario, again = _checked(data, kind)
            findings = findings or again
        if auto and scenario is not None and not findings:
            data, no_rule = with_gains(data, scenario, auto)
            unknown += no_rule
            scenario, findings = _checked(data, kind)
        findings = findings + unknown
    elif not rootless:
        findings += wrong
        findings += _by_themselves(data, kind, findings, known)
    findings = [_of_scenery(finding, data, origins) for finding in findings]
    faults = [
        _fault(finding.message, key_path(finding.path), _place(document, finding))
        for finding in sorted(findings, key=lambda finding: _order(document, finding, source))
    ]
    faults += unset
    if faults or scenario is None:
        raise ScenarioError(faults)
    return scenario


def _of_scenery(finding: Finding, data: dict[str, Any], origins: dict[Path, Path]) -> Finding:
    """A finding of surroundings where the scenario has them, of an obstacle where its file is named."""
    path = finding.path

    def written(found: re.Match[str]) -> str:
        place: Path = ("obstacles", int(found[1]))
        return key_path(origins.get(place, place))

    finding = finding._replace(message=re.sub(r"obstacles\[(\d+)\]", written, finding.message))
    if (origin := origins.get(path[:2])) is None:
        return finding
    if path[0] == origin[0]:
        return finding._replace(path=(*origin, *path[2:]))
    keys = key_path(path[2:])
    words = f"{data['obstacles'][int(path[1])]['name']}: " + (f"{keys}: " if keys else "")
    return finding._replace(path=origin, message=words + finding.message, at_key=False)


def read_text(path: FilePath) -> str:
    """Text of a YAML file.

    Raises:
        UsageError: If there is no such file or it cannot be read.
        ScenarioError: If it is too large or no text.
    """
    return _decoded(_content(path), os.fspath(path))


def expectation_lines(path: FilePath) -> list[int]:
    """The line of each expectation of a scenario file, from 1; empty where they cannot be told."""
    try:
        document = read_document(read_text(path), str(path))
    except (UsageError, ScenarioError):
        return []
    data = document.data.get("expect") if isinstance(document.data, dict) else None
    items = data if isinstance(data, list) else []
    return [document.place(("expect", place)).line for place in range(len(items))]


def _content(path: FilePath) -> bytes:
    if not os.path.exists(path):  # False, too, for a name that no file can have
        folder = path.parent
        names = [entry.name for entry in folder.glob("*.y*ml")] if os.path.isdir(folder) else []
        raise UsageError(f"{shortened(path)}: there is no such file{did_you_mean(path.name, names, 0.75)}")
    if not path.is_file():
        raise UsageError(f"{path}: this is not a file; expected a scenario in YAML")
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from None
    return content


def _too_long(source: str) -> ScenarioError:
    return ScenarioError(
        [Fault(f"found more than {MAX_BYTES // 1000} kB; a scenario is smaller", source=source)]
    )


def _decoded(content: bytes, source: str) -> str:
    if len(content) > MAX_BYTES:
        raise _too_long(source)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, column = line_and_column(content[: error.start].decode("utf-8", "replace"), error.start)
        message = f"found the byte 0x{content[error.start]:02x}; a scenario is text in UTF-8"
        raise ScenarioError([Fault(message, "", line, column, source)]) from None


def _checked(data: dict[str, Any], kind: type[Scenario]) -> tuple[Scenario | None, list[Finding]]:
    """The scenario in plain data, and everything wrong with it.

    Parts that are wrong by themselves are left out, so that what is wrong between the others is found too.
    """
    try:
        scenario = _validated(data, kind)
    except ValidationError as error:
        found = explain.findings_of(error, data, kind)
    else:
        return scenario, checks.findings_between_keys(scenario)
    paths = {finding.path for finding in found}
    if explain.VERSION in paths:
        return None, found
    rest = {key: value for key, value in data.items() if (key,) not in paths}
    wrong = {str(finding.path[0]) for finding in found}
    wrong |= {nearest(key, kind.model_fields) for key in wrong - kind.model_fields.keys()}  # what was meant
    if "scenery" in wrong:
        wrong.add("obstacles")  # some of them are not known
    if isinstance(rest.get("expect"), list):  # expectations do not depend on each other
        bad = {finding.path[1] for finding in found if finding.path[0] == "expect"}
        rest["expect"] = [NO_DEMAND if i in bad else one for i, one in enumerate(rest["expect"])]
        wrong.discard("expect")
    rest = {key: value for key, value in rest.items() if key not in wrong}
    return None, found + checks.findings_between_keys(_validated(rest, kind), wrong)


def _by_themselves(
    data: dict[str, Any], kind: type[Scenario], unread: list[Finding], known: bool
) -> list[Finding]:
    """What is wrong with single values, where others depend on files that could not be read.

    Args:
        data: The plain data.
        kind: The type of scenario, as far as it is known.
        unread: What is wrong with these files.
        known: Whether all components are known: where a plugin is missing, none can be called unknown.
    """
    try:
        _validated(data, kind)
    except ValidationError as error:
        found = explain.findings_of(error, data, kind, known)
        return [each for each in found if not any(each.path[: len(one.path)] == one.path for one in unread)]
    return []


def _validated(data: dict[str, Any], kind: type[Scenario]) -> Scenario:
    """The scenario in plain data.

    Raises:
        ValidationError: With what is wrong by itself.
        PluginError: If a validator of a plugin raises anything else than that a value is wrong, or does what
            a plugin may not do.
    """
    files = ", ".join(str(one.source.file or one.source.package) for one in catalog_of(kind).plugins)
    try:
        with confined(files) if files else nullcontext():
            return kind.model_validate(tuples(data), strict=True, context=STRICT)
    except ValidationError:
        raise
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and stopping.is_users():
            raise
        at = blamed(error) or (f"{files}: {error}" if isinstance(error, Trespass) else "")
        if not at:
            raise
        raise PluginError(at) from error


def _place(document: Document, finding: Finding) -> Place:
    paths = (finding.path, *finding.related)
    written = next((path for path in paths if path in document.values), finding.path)
    return document.place(written, finding.at_key)


def _order(document: Document, finding: Finding, source: str) -> tuple[bool, int, int]:
    place = _place(document, finding)
    return place.source != source, place.line, place.column


def _fault(message: str, key: str, place: Place) -> Fault:
    return Fault(message, key, place.line, place.column, place.source)


Scenario.checked = scenario_of
