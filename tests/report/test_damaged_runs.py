"""Run folders that were damaged: they are read, or refused with a message."""

import gc
import json
import random
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from escort_mj import api
from escort_mj.errors import EscortError, RunFolderError, ScenarioError
from escort_mj.measuring import measures_of
from escort_mj.record import stored
from escort_mj.record.export import dataframe_of
from escort_mj.record.intact import check_trace
from escort_mj.record.stored import StoredRun, read_run
from escort_mj.record.trace import load_recording
from escort_mj.report.exports import export_run
from escort_mj.report.pages.html import page
from escort_mj.report.pages.run_page import _parts
from escort_mj.report.pages.signals_data import signals_data
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario.reader.load import stored_scenario
from escort_mj.view.tape import Stored

MISSION = """
name: whole
duration: 0.2
robots: {count: 3}
mission: {radius: 2}
obstacles: [{position: [6, 2], radius: 0.4}, {position: [-6, 2], shape: box, size: [0.4, 0.3]}]
recording: {truth: true}
expect: [{metric: energy, at_most: 1000}, {contacts: none}]
"""
JSON = ("outcome.json", "metrics.json", "verdicts.json")
GARBLED = (
    None,
    True,
    -1,
    1e300,
    10**400,
    "x",
    "\x1b[2J\n::error::",
    [],
    {},
    [1],
    {"a": 1},
    [[None]],
    float("nan"),
)
QUICK, THOROUGH = 20, 400


@pytest.fixture(scope="module")
def whole(compiled, tmp_path_factory) -> StoredRun:
    """A run folder in order."""
    path = tmp_path_factory.mktemp("runs") / "whole"
    (path.parent / "whole.yaml").write_text(MISSION)
    api.run(path.parent / "whole.yaml", path, figures=False, video=False)
    return read_run(path)


@pytest.fixture(params=[QUICK, pytest.param(THOROUGH, marks=pytest.mark.slow)])
def draws(request) -> list[random.Random]:
    """Sources of random numbers, a fixed one for each damage."""
    return [random.Random(seed) for seed in range(request.param)]


def refused_or(read: Callable[[], Any]) -> bool:
    """Reads; whether that was refused, with a message."""
    try:
        read()
    except EscortError as error:
        assert error.exit_code in (2, 3) and str(error)
        return True
    return False


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in JSON's data."""
    for key in value if isinstance(value, dict) else range(len(value) if isinstance(value, list) else 0):
        yield (*path, key)
        yield from places(value[key], (*path, key))


def damaged_bytes(content: bytes, draw: random.Random) -> bytes:
    """A file cut off, or with some bytes changed."""
    if draw.random() < 0.3:
        return content[: draw.randrange(len(content))]
    changed = bytearray(content)
    for _ in range(draw.choice([1, 3, 30])):
        changed[draw.randrange(len(changed))] = draw.randrange(256)
    return bytes(changed)


def damaged_json(content: bytes, draw: random.Random) -> bytes:
    """A file with bytes changed, or with an entry that is gone or another."""
    if draw.random() < 0.2:
        return damaged_bytes(content, draw)
    data = json.loads(content)
    *way, last = draw.choice([*places(data)])
    holder = data
    for key in way:
        holder = holder[key]
    if draw.random() < 0.4:
        del holder[last]
    else:
        holder[last] = draw.choice(GARBLED)
    return json.dumps(data).encode()


@pytest.fixture
def copy(whole, tmp_path) -> Path:
    """A run folder to be damaged."""
    return Path(shutil.copytree(whole.path, tmp_path / "whole"))


@pytest.mark.slow_cases("outcome.json")
@pytest.mark.parametrize("name", JSON)
def test_json(whole, copy, draws, name, monkeypatch) -> None:
    monkeypatch.setattr(stored, "load_recording", lambda path: whole.recording)
    file, refused = copy / name, 0
    before = file.read_bytes()
    for draw in draws:
        file.write_bytes(damaged_json(before, draw))
        refused += refused_or(lambda: (page("run.html", _parts(read_run(copy))), Stored(copy)))
    file.unlink()
    assert refused_or(lambda: read_run(copy)) == (name == "outcome.json")
    file.write_text("[]")
    with pytest.raises(RunFolderError, match=f"{name}: is damaged: it is '"):
        read_run(copy)
    assert refused > len(draws) // 4


def damaged_trace(trace: Any, draw: random.Random) -> Any:
    """A trace with a variable, an attribute or part of a dimension that is gone or another."""
    trace, name = trace.copy(deep=True), draw.choice([str(name) for name in trace.variables])
    match draw.randrange(7):
        case 0:
            return trace.drop_vars(name)
        case 1:
            del trace.attrs[draw.choice([*trace.attrs])]
        case 2:
            trace.attrs[draw.choice([*trace.attrs])] = draw.choice(["x", -1, 0, [1, 2, 3], 1e300, np.nan])
        case 3:
            kind = draw.choice(["U", "int8", "float32", "bool"])
            with np.errstate(invalid="ignore"):
                trace[name] = trace[name].astype(kind) if trace[name].dtype.kind != "U" else trace[name] + "x"
        case 4:
            dim = draw.choice([str(dim) for dim in trace.sizes])
            return trace.isel({dim: slice(0, draw.randrange(2))})
        case 5:
            number = trace[name].dtype.kind in "fi"
            trace[name] = trace[name].astype(float) * np.nan if number else trace[name].astype(str) + "\n"
        case 6:
            kind = trace[name].dtype.kind
            wide = trace[name].astype({"i": "int64", "f": "float64"}.get(kind, "S"))
            trace[name] = wide * 0 + draw.choice([99999, -7]) if kind in "fi" else wide
    return trace


@pytest.mark.slow
def test_traces(whole, draws) -> None:
    def read(trace: Any) -> None:
        check_trace(trace, Path("trace.nc"))
        (
            measures_of(trace),
            dataframe_of(trace),
            replay_of(trace),
            json.dumps(signals_data(trace), allow_nan=False),
        )

    read(whole.trace)
    refused = 0
    for draw in draws:
        damaged = damaged_trace(whole.trace, draw)
        refused += refused_or(lambda damaged=damaged: read(damaged))
    assert refused > len(draws) // 4


def test_bytes_of_a_trace(whole, draws, tmp_path, capfd, monkeypatch) -> None:
    lost: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lost.append)
    content, file = (whole.path / "trace.nc").read_bytes(), tmp_path / "trace.nc"
    refused = 0
    for draw, _ in zip(draws, range(15), strict=False):
        file.write_bytes(damaged_bytes(content, draw))
        refused += refused_or(lambda: load_recording(file).to_dataset())
    gc.collect()
    assert refused > 3 and not lost and capfd.readouterr() == ("", "")


def test_scenario_and_model(whole, copy, draws) -> None:
    text, file = (copy / "scenario.yaml").read_bytes(), copy / "scenario.yaml"
    refused = 0
    for draw in draws:
        changed = damaged_bytes(text, draw).decode("utf-8", "replace")
        refused += refused_or(lambda changed=changed: stored_scenario(changed, file))
    assert refused > len(draws) // 4
    for garbled in ("3", "[3]", "[{file: 3}]", "[{file: [x]}]", "{a: 1}"):
        assert refused_or(lambda garbled=garbled: stored_scenario(f"plugins: {garbled}", file)), garbled
    (copy / "resolved.yaml").write_text("[]")
    with pytest.raises(ScenarioError, match=r"whole/resolved\.yaml:1:1: found an empty list"):
        api.open_run(copy).scenario  # noqa: B018
    file = copy / "model.xml"
    for wrong in (b"", file.read_bytes()[:500], b"<mujoco/>", b"\xff\xfe"):
        file.write_bytes(wrong)
        assert refused_or(lambda: Stored(copy))
        with pytest.raises(RunFolderError, match=r"model\.xml: "):
            export_run(replace(whole, path=copy), copy / "world.xml")
