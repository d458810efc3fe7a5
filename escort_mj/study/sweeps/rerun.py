"""A stored run made again, and whether it comes to the same: to the bit, or else in its metrics."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from escort_mj.errors import UsageError
from escort_mj.measuring import measures_of
from escort_mj.mission import Flight, Progress, fly
from escort_mj.record.folder import RunFolder, StoredRun, read_run
from escort_mj.record.outcome import FINAL, Outcome
from escort_mj.record.recording import is_log
from escort_mj.record.stored import PLUGINS
from escort_mj.scenario.reader.document import read_document
from escort_mj.scenario.reader.load import stored_scenario

if TYPE_CHECKING:
    import xarray

TOLERANCE = 1e-3  # relative
NEGLIGIBLE = 1e-9  # in a metric's unit: nothing smaller is told from zero


@dataclass(frozen=True)
class Agreement:
    """How a run made again compares to the stored one.

    Attributes:
        run: The run as it came out now.
        until: Time up to which the two are compared, as far as the stored one goes [s].
        outcomes: How the stored run ended, and how it ended now.
        versions: What took part in other versions: name, then and now; empty text for nothing.
        signals: How many recorded signals both have.
        differing: Signals whose bits differ, and the first time at which they do [s].
        missing: Signals that the stored run has and this one has not.
        metrics: Relative difference of each metric that both have; infinite where only one has a number.
        verdicts: Verdicts that turned out differently, by what they demand.
        tolerance: Relative difference up to which metrics agree.
        plugins: What became of plugin files since.
    """

    run: Flight
    until: float
    outcomes: tuple[str, str]
    versions: dict[str, tuple[str, str]]
    signals: int
    differing: dict[str, float]
    missing: list[str]
    metrics: dict[str, float]
    verdicts: list[str]
    tolerance: float
    plugins: tuple[str, ...] = ()

    @property
    def same_bits(self) -> bool:
        """Whether every stored signal came out with the same bits, and the run ended alike."""
        return not (self.differing or self.missing) and self.outcomes[0] == self.outcomes[1]

    @property
    def apart(self) -> dict[str, float]:
        """Metrics that differ by more than the tolerance."""
        return {name: gap for name, gap in self.metrics.items() if not gap <= self.tolerance}

    @property
    def good(self) -> bool:
        """Whether the run was repeated: the same bits, or else the same end, metrics and verdicts."""
        alike = self.outcomes[0] == self.outcomes[1] and not (self.apart or self.verdicts)
        return self.same_bits or alike


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
    scenario = stored_scenario(stored.scenario_yaml, path)
    if out is None:
        run = fly(scenario, None, progress)
    else:
        with RunFolder.create(out) as folder:
            run = fly(scenario, folder, progress)
    return replace(compare_runs(stored, run, tolerance), plugins=_changed_plugins(stored))


def _changed_plugins(stored: StoredRun) -> tuple[str, ...]:
    """What became of the plugin files that a run was made with, where they are not what they were."""
    data = read_document(stored.scenario_yaml, str(stored.path)).data
    said = []
    for each in data.get("plugins") or ():
        if not each.get("file"):
            continue
        file, copy = Path(each["file"]), stored.path / PLUGINS / Path(each["file"]).name
        own = "the run's own copy took part" if copy.is_file() else "there is no copy of what it was"
        if not file.is_file():
            said.append(f"{file.name}: is no longer at {file}; {own}")
        elif (now := hashlib.sha256(file.read_bytes()).hexdigest()) != (then := str(each.get("sha256"))):
            said.append(f"{file.name}: has changed since, from {then[:12]} to {now[:12]}; {own}")
    return tuple(said)


def compare_runs(stored: StoredRun, run: Flight, tolerance: float = TOLERANCE) -> Agreement:
    """Compare a stored run with one made of the same scenario."""
    then, now = stored.trace, run.trace
    ended = stored.outcome["outcome"] in FINAL
    if not ended:  # it was stopped: as far as it came
        now = now.isel(time=slice(0, then.sizes["time"]))
    outcomes = (stored.outcome["outcome"], run.outcome.value) if ended else ("stopped", "stopped")
    names = [str(name) for name in then.variables if ended or "time" in then[name].dims]
    passed = {(v["metric"], v["demanded"]): v["passed"] for v in stored.verdicts}
    return Agreement(
        run=run,
        until=float(then["time"][-1]),
        outcomes=outcomes,
        versions=dict(_versions(then.attrs, now.attrs)),
        signals=sum(name in now.variables for name in names),
        differing={
            name: since
            for name in names
            if name in now.variables and (since := _differ(then[name], now[name])) is not None
        },
        missing=[name for name in names if name not in now.variables],
        metrics=_gaps(then, now) if run.outcome is not Outcome.FAILED else {},
        verdicts=[
            v.message
            for v in run.verdicts
            if ended and passed.get((v.metric, v.demanded), v.passed) != v.passed
        ],
        tolerance=tolerance,
    )


def _versions(then: dict[str, Any], now: dict[str, Any]) -> Iterator[tuple[str, tuple[str, str]]]:
    """What took part in two versions, by name."""
    prefix = "version_"
    for key in sorted({*then, *now}, key=str):
        before, after = str(then.get(key, "")), str(now.get(key, ""))
        if str(key).startswith(prefix) and before != after:
            yield str(key).removeprefix(prefix), (before, after)


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


def _gaps(then: xarray.Dataset, now: xarray.Dataset) -> dict[str, float]:
    """Relative difference of each metric that either trace has."""
    before, after = measures_of(then), measures_of(now)
    gaps = {}
    for name in before:
        a, b = before[name].value, after[name].value
        if a is None and b is None:
            continue
        if a is None or b is None or not math.isfinite(a) or not math.isfinite(b):
            gaps[name] = 0.0 if a == b else math.inf
        else:
            gaps[name] = abs(a - b) / max(abs(a), abs(b)) if abs(a - b) > NEGLIGIBLE else 0.0
    return gaps


def rerun_lines(found: Agreement) -> list[str]:
    """What is to be said of the comparison, for a terminal."""
    said = [f"  other version  {name}: {a or 'none'} then, {b or 'none'} now"
            for name, (a, b) in found.versions.items()]  # fmt: skip
    said += [f"  plugin  {words}" for words in found.plugins]
    if found.outcomes[0] != found.outcomes[1]:
        said.append(f"  ended otherwise: {found.outcomes[0]} then, {found.outcomes[1]} now")
    if found.same_bits:
        return [*said, f"same bits: {found.signals} signals up to {found.until:g} s"]
    if found.missing:
        said.append(f"  no longer recorded: {', '.join(found.missing)}")
    if found.differing:
        name = min(found.differing, key=lambda name: found.differing[name])
        said.append(
            f"  other bits in {len(found.differing)} of {found.signals} signals, first in {name}"
            f" at {found.differing[name]:g} s"
        )
    said += [f"  other verdict  {message}" for message in found.verdicts]
    said += [f"  differs        {name}: by {_percent(gap)}" for name, gap in found.apart.items()]
    agreeing = [gap for gap in found.metrics.values() if gap <= found.tolerance]
    within = f", the others within {_percent(max(agreeing))}" if agreeing else ""
    if found.apart:
        said.append(f"other metrics: {len(found.apart)} of {len(found.metrics)} differ{within}")
    else:
        most = _percent(max(agreeing, default=0.0))
        said.append(f"other bits, same metrics: all {len(found.metrics)} within {most}")
    return said


def _percent(gap: float) -> str:
    return (
        "a value where there was none, or none where there was one"
        if math.isinf(gap)
        else f"{100 * gap:.2g} %"
    )
