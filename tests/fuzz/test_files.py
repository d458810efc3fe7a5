"""Whatever a study or a log holds: it is read, or refused in words; never a traceback or a hang."""

import random
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from escort_mj.api import judge, scenarios_folder
from escort_mj.errors import EscortError
from escort_mj.study.sweeps.definition import load_study
from tests.fuzz.mutations import broken
from tests.fuzz.test_loader import PATIENCE, ring

PLAIN = "duration: 6\nrobots: {count: 2}\ntarget: {position: [0, 0]}\nexpect: [{contacts: none}]\n"
CELLS = ("nan", "inf", "", "x", "1e308", "-1e308", "1e20", "time", "robot_9.x")
STUDIES = [path.read_text() for path in sorted((scenarios_folder() / "studies").glob("*.yaml"))]


def study(folder: Path, dice: random.Random) -> None:
    (folder / "study.yaml").write_text(broken(dice.choice(STUDIES), dice), errors="replace")
    load_study(str(folder / "study.yaml"))


def log(folder: Path, dice: random.Random) -> None:
    rows = [["time", "robot_1.x", "robot_1.y", "robot_2.x", "robot_2.y"]]
    rows += [[f"{0.1 * k:.1f}", "2", "0", "-2", "0"] for k in range(61)]
    for _ in range(dice.choice((1, 2, 3))):
        row = dice.choice(rows)
        if row and dice.random() < 0.7:
            row[dice.randrange(len(row))] = dice.choice(CELLS)
        elif dice.random() < 0.5:
            del row[dice.randrange(len(row) + 1) :]
        else:
            dice.shuffle(rows)
    (folder / "log.csv").write_text("\n".join(map(",".join, rows)))
    (folder / "s.yaml").write_text(PLAIN)
    judge(folder / "log.csv", folder / "s.yaml", folder / "out", overwrite=True, figures=False, report=False)


@pytest.mark.slow
@pytest.mark.parametrize("attempt", [study, log])
def test_some_broken_files(tmp_path: Path, attempt: Callable[[Path, random.Random], None]) -> None:
    before = signal.signal(signal.SIGALRM, ring)
    try:
        for seed in range(40):
            signal.alarm(6 * PATIENCE)  # the first log may wait for machine code
            try:
                attempt(tmp_path, random.Random(seed))
            except EscortError as error:
                assert error.exit_code == 2 and str(error), seed
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
