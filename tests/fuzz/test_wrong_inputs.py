"""Wrong scenarios and robot files are refused with their place; none breaks the program."""

import json
import random
import re
import signal
import warnings
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest

import escort_mj
from escort_mj.errors import EscortError
from escort_mj.scenario.reader.load import parse_scenario
from tests.fuzz.nonsense import FAULTS, PLAIN, with_all
from tests.fuzz.robot_files import GOOD, mission_of, robot_file
from tests.fuzz.test_loader import PATIENCE, ring

PLACE = re.compile(r"s\.yaml:\d+:\d+: ")


@pytest.fixture(autouse=True)
def patient() -> Iterator[None]:
    """What takes long is broken off; NumPy's warnings, which a user would see, are errors."""
    before = signal.signal(signal.SIGALRM, ring)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def refused(scenario: dict[str, object]) -> str:
    """Why a scenario is refused."""
    signal.alarm(PATIENCE)
    with pytest.raises(EscortError) as error:
        parse_scenario(json.dumps(scenario, indent=1), "s.yaml")
    return str(error.value)


def test_what_is_plain_is_accepted() -> None:
    parse_scenario(json.dumps(PLAIN), "s.yaml")


@pytest.mark.parametrize("fault", FAULTS)
def test_nonsense_is_refused_with_its_place(fault: str) -> None:
    for way in FAULTS[fault]:
        assert PLACE.match(refused(with_all(way))), way


@pytest.mark.slow
@pytest.mark.parametrize("block", range(8))
def test_two_faults_at_once(block: int) -> None:
    pairs = [pair for pair in combinations(FAULTS, 2) if pair != ("a waypoint of one axis", "a path twice")]
    for pair in pairs[block::48]:  # of the pair left out, the second mends the first
        assert PLACE.match(refused(with_all(*(FAULTS[fault][-1] for fault in pair)))), pair


@pytest.mark.parametrize(
    ("first", "count", "far"),
    [(0, 30, False), *(pytest.param(30 + 100 * k, 100, True, marks=pytest.mark.slow) for k in range(4))],
)
def test_robot_files(
    first: int, count: int, far: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = 0
    for seed in range(first, first + count):
        name, text = robot_file(random.Random(seed))
        mission = mission_of(name, tmp_path, text)
        signal.alarm(6 * PATIENCE)  # one that flies may wait for machine code
        try:
            scenario = escort_mj.load_scenario(mission)
            run = escort_mj.run(scenario) if far else None
        except EscortError as error:
            assert len(str(error)) < 2000, seed
            wrong += 1
        else:
            assert run is None or run.outcome.value in ("completed", "unstable", "diverged"), seed
    assert wrong > count // 2


@pytest.mark.parametrize("name", GOOD)
def test_robot_files_that_are_right(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    mission = mission_of(name, tmp_path, GOOD[name])
    if name == "cart":
        with pytest.raises(EscortError, match="MJCF"):
            escort_mj.load_scenario(mission)
    else:
        assert escort_mj.load_scenario(mission).robots.count == 2
