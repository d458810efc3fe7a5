"""Two runs compared, to the bit or in metrics and verdicts; the second may be the first, made again."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from escort_mj.errors import EscortError, UsageError
from escort_mj.measuring import measures_of
from escort_mj.metrics import METRICS
from escort_mj.mission import Progress, fly
from escort_mj.recognize import OUTCOME, RESOLVED, SCENARIO
from escort_mj.record.folder import RERUN, RunFolder, StoredRun, read_run
from escort_mj.record.outcome import FINAL, Outcome, Verdict
from escort_mj.record.recording import is_log, versions_of
from escort_mj.record.stored import PLUGINS, TRACE
from escort_mj.scenario import Scenario
from escort_mj.scenario.reader.changes import changes_between
from escort_mj.scenario.reader.document import read_document
from escort_mj.scenario.reader.load import stored_scenario
from escort_mj.study.sweeps.statistics import counted

if TYPE_CHECKING:
    import xarray

TOLERANCE = 1e-3  # relative
MOST_NOTES = 3  # interventions, and keys, that are listed
NEGLIGIBLE = 1e-9  # in a metric's unit: nothing smaller is told from zero


@dataclass(frozen=True)
class Agreement:
    """How one run compares to another: a run made again to the stored one, or two stored ones.

    Attributes:
        until: Time up to which the two are compared, as far as both go [s].
        outcomes: How the first run ended, and the second.
        versions: What took part in other versions: name, in the first and the second; empty text for nothing.
        signals: How many recorded signals both have.
        differing: Signals whose bits differ, and the first time at which they do [s].
        missing: Signals that the first run has and the second has not.
        metrics: Value of each metric in both, and its unit; None where it has none.
        verdicts: What was demanded and turned out differently, with the verdicts' messages in both.
        tolerance: Relative difference up to which metrics agree.
        notes: What else tells why they may differ, or what was compared.
    """

    until: float
    outcomes: tuple[str, str]
    versions: dict[str, tuple[str, str]]
    signals: int
    differing: dict[str, float]
    missing: list[str]
    metrics: dict[str, tuple[float | None, float | None, str]]
    verdicts: list[tuple[str, str]]
    tolerance: float
    notes: tuple[str, ...] = ()

    @property
    def same_bits(self) -> bool:
        """Whether every signal of the first run has the same bits in the second, and they ended alike."""
        return not (self.differing or self.missing) and self.outcomes[0] == self.outcomes[1]

    @property
    def gaps(self) -> dict[str, float]:
        """Relative difference of each metric; infinite where only one has a number."""
        return {name: _gap(before, after) for name, (before, after, _) in self.metrics.items()}

    @property
    def apart(self) -> dict[str, float]:
        """Metrics that differ by more than the tolerance."""
        return {name: gap for name, gap in self.gaps.items() if not gap <= self.tolerance}

    @property
    def first(self) -> str:
        """The signal that differs first; empty where none does."""
        return min(self.differing, key=lambda name: self.differing[name], default="")

    @property
    def good(self) -> bool:
        """Whether they agree: the same bits, or else the same end, metrics and verdicts."""
        alike = self.outcomes[0] == self.outcomes[1] and not (self.apart or self.verdicts)
        return self.same_bits or alike


class Side(NamedTuple):
    """One of two runs that are compared.

    Attributes:
        trace: What it recorded.
        outcome: How it ended.
        verdicts: As in verdicts.json.
        versions: Of what took part.
    """

    trace: xarray.Dataset
    outcome: str
    verdicts: list[Verdict]
    versions: dict[str, str]

    @classmethod
    def stored(cls, run: StoredRun) -> Side:
        """Return what a run folder holds."""
        return cls(run.trace, run.outcome["outcome"], run.verdicts, versions_of(run.trace.attrs))

    @property
    def ended(self) -> bool:
        """Whether it ended by itself."""
        return self.outcome in FINAL


def rerun_folder(
    path: Path, out: Path | None = None, tolerance: float = TOLERANCE, progress: Progress | None = None
) -> Agreement:
    """Make the run of a run folder again.

    Args:
        path: The run folder. Of a run that was stopped, what it recorded is compared.
        out: Run folder for the new run; None keeps none.
        tolerance: Relative difference up to which metrics agree.
        progress: Called now and then.

    Raises:
        RunFolderError: If it is no run folder, or holds no run to repeat.
        ScenarioError: If its scenario is none to this version of the program.
        UsageError: If the new run would replace the stored one.
    """
    if out is not None and out.resolve() == path.resolve():
        raise UsageError(f"--out {out}: is the run folder that is compared; choose another")
    stored = read_run(path)
    if not stored.scenario_yaml or not stored.trace.sizes["time"]:
        raise UsageError(f"{path}: the run recorded nothing, so there is nothing to repeat")
    if is_log(stored.trace):
        raise UsageError(f"{path}: is a log of real robots, which cannot be repeated")
    scenario = stored_scenario(stored.scenario_yaml, stored.scenario_file)
    if out is None:
        run = fly(scenario, None, progress)
    else:
        with RunFolder.create(out, RERUN) as folder:
            run = fly(scenario, folder, progress)
    now = Side(run.trace, run.outcome.value, run.verdicts, versions_of(run.trace.attrs))
    reran = f"{stored.scenario_file}: {scenario.name}, seed {scenario.seed}, {scenario.duration:g} s"
    notes = (f"reran  {reran}", *_interventions(stored), *_edits(stored, scenario), *_changed_plugins(stored))
    return replace(compare_runs(Side.stored(stored), now, tolerance), notes=notes)


def diff_folders(first: Path, second: Path, tolerance: float = TOLERANCE) -> Agreement:
    """Compare two run folders: scenarios, versions, signals, metrics and verdicts.

    Args:
        first: A run folder; of a run that was stopped, what it recorded is compared.
        second: Another one.
        tolerance: Relative difference up to which metrics agree.

    Raises:
        RunFolderError: If one is no run folder.
    """
    runs = [read_run(first), read_run(second)]
    found = compare_runs(Side.stored(runs[0]), Side.stored(runs[1]), tolerance)
    changes = [f"scenario  {words}" for words in _scenario_changes(*runs)]
    held_up = [f"{words} ({run.path})" for run in runs for words in _interventions(run)]
    return replace(found, notes=(*changes, *held_up))


def _scenario_changes(first: StoredRun, second: StoredRun) -> list[str]:
    """In which keys the scenarios of two runs differ, in words."""
    if first.scenario_yaml == second.scenario_yaml:
        return []
    try:
        both = [stored_scenario(run.scenario_yaml, run.scenario_file) for run in (first, second)]
    except EscortError as error:
        return [f"differs, but cannot be read: {error}"]
    return [str(change) for change in changes_between(*both)]


def _interventions(stored: StoredRun) -> tuple[str, ...]:
    """What moved a run beside its scenario: that is in no file, so nothing repeats it."""
    told = str(stored.trace.attrs.get("interventions", "")).splitlines()
    said = []
    if told:
        shown = "; ".join(told[:MOST_NOTES]) + f"; and {len(told) - MOST_NOTES} more" * (
            len(told) > MOST_NOTES
        )
        count = counted(len(told), "intervention")
        said.append(f"not in the scenario  {count} from outside, which a rerun does not repeat: {shown}")
    if commanded := stored.trace.attrs.get("commanded"):
        said.append(f"not in the scenario  each robot's {commanded} was commanded from outside")
    return tuple(said)


def _edits(stored: StoredRun, scenario: Scenario) -> list[str]:
    """What became of the scenario's files since the run."""
    said = []
    then = stored.outcome.get("scenario_sha256")
    if then and then != hashlib.sha256(stored.scenario_yaml.encode()).hexdigest():
        said.append(f"edited  {RESOLVED} is not what ran: it was changed after the run")
    recorded = versions_of(stored.trace.attrs)
    for name, version in stored.outcome.get("versions", {}).items():
        if str(version) != recorded.get(name):
            said.append(
                f"edited  {OUTCOME} says {name} {version}, {TRACE} says {recorded.get(name, 'nothing')}"
            )
    short = stored.path / SCENARIO
    if not short.is_file() or not (stored.path / RESOLVED).is_file():
        return said
    try:
        changes = changes_between(scenario, stored_scenario(short.read_text(encoding="utf-8"), short))
    except (EscortError, OSError, ValueError) as error:
        return [*said, f"edited  {SCENARIO} does not take part and cannot be read any more: {error}"]
    if changes:
        words = "; ".join(map(str, changes[:MOST_NOTES])) + "; ..." * (len(changes) > MOST_NOTES)
        said.append(
            f"edited  {SCENARIO} does not take part, and differs from {RESOLVED}, which does: {words}"
        )
    return said


def _changed_plugins(stored: StoredRun) -> tuple[str, ...]:
    """What became of the plugin files that a run was made with, where they are not what they were."""
    data = read_document(stored.scenario_yaml, str(stored.scenario_file)).data
    said = []
    for each in data.get("plugins") or ():
        if not each.get("file"):
            continue
        file, copy = Path(each["file"]), stored.path / PLUGINS / Path(each["file"]).name
        own = "the run's own copy took part" if copy.is_file() else "there is no copy of what it was"
        if not file.is_file():
            said.append(f"plugin  {file.name}: is no longer at {file}; {own}")
        elif (now := hashlib.sha256(file.read_bytes()).hexdigest()) != (then := str(each.get("sha256"))):
            said.append(f"plugin  {file.name}: has changed since, from {then[:12]} to {now[:12]}; {own}")
    return tuple(said)


def compare_runs(first: Side, second: Side, tolerance: float = TOLERANCE) -> Agreement:
    """Compare two runs; one that was stopped as far as it came."""
    then, now = first.trace, second.trace
    ended = first.ended and second.ended
    if not ended:
        rows = min(then.sizes["time"], now.sizes["time"])
        then, now = then.isel(time=slice(0, rows)), now.isel(time=slice(0, rows))
    names = [str(name) for name in then.variables if ended or "time" in then[name].dims]
    differing = {name: _differ(then[name], now[name]) for name in names if name in now.variables}
    told = {v.title: v for v in first.verdicts}
    pairs = [(told.get(v.title, v), v) for v in second.verdicts if ended]
    known = sorted({*first.versions, *second.versions})
    versions = {name: (first.versions.get(name, ""), second.versions.get(name, "")) for name in known}
    return Agreement(
        until=float(min(then["time"][-1], now["time"][-1]))
        if then.sizes["time"] and now.sizes["time"]
        else 0.0,
        outcomes=(first.outcome, second.outcome) if ended else ("stopped", "stopped"),
        versions={name: pair for name, pair in versions.items() if pair[0] != pair[1]},
        signals=len(differing),
        differing={name: since for name, since in differing.items() if since is not None},
        missing=[name for name in names if name not in now.variables],
        metrics=_metrics(then, now) if Outcome.FAILED.value not in (first.outcome, second.outcome) else {},
        verdicts=[(a.message, b.message) for a, b in pairs if a.passed != b.passed],
        tolerance=tolerance,
    )


def _differ(then: xarray.DataArray, now: xarray.DataArray) -> float | None:
    """First time at which the bits of a signal differ [s], 0 where it has no time; None if nowhere."""
    a, b = then.values, now.values
    if a.dtype.kind in "OUS" or b.dtype.kind in "OUS":
        return None if a.astype(str).tolist() == b.astype(str).tolist() else 0.0
    if a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes():
        return None
    if not then.dims or then.dims[0] != "time" or a.shape[1:] != b.shape[1:]:
        return 0.0
    rows = min(len(a), len(b))
    same = np.array([a[k].tobytes() == b[k].astype(a.dtype).tobytes() for k in range(rows)], dtype=bool)
    first = rows if same.all() else int(np.argmin(same))
    return float((then if len(a) > first else now)["time"][min(first, max(len(a), len(b)) - 1)])


def _metrics(then: xarray.Dataset, now: xarray.Dataset) -> dict[str, tuple[float | None, float | None, str]]:
    """The value of each metric of the first trace in both, and its unit."""
    before, after = measures_of(then), measures_of(now)
    units = {metric.name: metric.unit for metric in METRICS}
    return {
        name: (one.value, after[name].value, units[name.rpartition(".")[2]])
        for name, one in before.items()
        if name in after and (one.value is not None or after[name].value is not None)
    }


def _gap(a: float | None, b: float | None) -> float:
    """Relative difference of two values; infinite where only one is a finite number."""
    if a is None or b is None or not math.isfinite(a) or not math.isfinite(b):
        return 0.0 if a == b else math.inf
    return abs(a - b) / max(abs(a), abs(b)) if abs(a - b) > NEGLIGIBLE else 0.0


def agreement_lines(found: Agreement, one: str = "then", other: str = "now") -> list[str]:
    """What is to be said of two runs, which are called so, for a terminal."""
    said = [f"  {words}" for words in found.notes]
    said += [f"  other version  {name}: {a or 'none'} {one}, {b or 'none'} {other}"
             for name, (a, b) in found.versions.items()]  # fmt: skip
    if found.outcomes[0] != found.outcomes[1]:
        said.append(f"  ended otherwise: {found.outcomes[0]} {one}, {found.outcomes[1]} {other}")
    if found.same_bits:
        return [*said, f"same bits: {found.signals} signals up to {found.until:g} s"]
    if found.missing:
        said.append(f"  not recorded {other}: {', '.join(found.missing)}")
    if found.differing:
        said.append(
            f"  other bits in {len(found.differing)} of {found.signals} signals, first in {found.first}"
            f" at {found.differing[found.first]:g} s"
        )
    said += [f"  other verdict  {one}: {a}; {other}: {b}" for a, b in found.verdicts]
    for name, gap in found.apart.items():
        before, after, unit = found.metrics[name]
        said.append(f"  differs        {name}: {_value(before, unit)} {one}, {_value(after, unit)} {other}"
                    f"{'' if math.isinf(gap) else f' ({_percent(gap)})'}")  # fmt: skip
    agreeing = [gap for gap in found.gaps.values() if gap <= found.tolerance]
    within = f", the others within {_percent(max(agreeing))}" if agreeing else ""
    if found.apart:
        said.append(f"other metrics: {len(found.apart)} of {len(found.metrics)} differ{within}")
    else:
        most = _percent(max(agreeing, default=0.0))
        said.append(f"other bits, same metrics: all {len(found.metrics)} within {most}")
    return said


def _value(value: float | None, unit: str) -> str:
    """A value of a metric in words."""
    if value is None:
        return "none"
    return "never" if value == math.inf else f"{value:.6g}{'' if unit == '1' else f' {unit}'}"


def _percent(gap: float) -> str:
    return f"{100 * gap:.3g} %"
