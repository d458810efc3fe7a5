"""Whatever a file holds: a scenario, or faults in words; never a traceback, a hang or a flood of memory."""

from __future__ import annotations

import os
import random
import resource
import signal
from pathlib import Path
from types import FrameType

import pytest

from escort_mj.api import scenarios_folder
from escort_mj.errors import ScenarioError
from escort_mj.recognize import scenarios_in
from escort_mj.scenario.reader.load import parse_scenario
from tests.fuzz.mutations import broken

PATIENCE = 20  # s, on a machine that does other work, too
ROOM = 1 << 30  # bytes beyond what the process has already
SHIPPED = [path.read_text() for path in scenarios_in(scenarios_folder())]


class Hang(BaseException):
    """What cannot be caught by accident."""


def ring(number: int, frame: FrameType | None) -> None:
    raise Hang


def try_one(seed: int) -> str | None:
    """Reads a broken scenario; returns what a user should not see, or None."""
    dice = random.Random(seed)
    text = broken(dice.choice(SHIPPED), dice)
    signal.alarm(PATIENCE)
    try:
        parse_scenario(text, "fuzz.yaml")
    except ScenarioError as error:
        signal.alarm(0)
        if not error.faults or any(not fault.message for fault in error.faults):
            return f"{seed}: an error without words"
        if len(str(error)) > 100_000:
            return f"{seed}: an error of {len(str(error))} characters"
    except Hang:
        return f"{seed}: no answer within {PATIENCE} s"
    except BaseException as error:
        return f"{seed}: {type(error).__name__}: {error}"
    finally:
        signal.alarm(0)
    return None


def tried(first: int, count: int) -> list[str]:
    """What went wrong with so many broken scenarios."""
    before = signal.signal(signal.SIGALRM, ring)
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, hard))
    try:
        return [fault for seed in range(first, first + count) if (fault := try_one(seed))]
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize(("first", "count"), [(0, 60), pytest.param(60, 140, marks=pytest.mark.slow)])
def test_some_broken_scenarios(first: int, count: int) -> None:
    assert not tried(first, count)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("block", range(20))
def test_ten_thousand_broken_scenarios(block: int) -> None:
    assert not tried(1000 + 500 * block, 500)
