"""Folders of studies that were damaged: they are read, or refused with a message."""

import json
import random
import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from escort_mj.report.pages import study_page
from escort_mj.report.pages.study_page import write_study_page
from escort_mj.study.engine.store import FILE as STORE
from escort_mj.study.engine.store import Store
from escort_mj.study.sweeps.results import FILE, open_results
from tests.report.test_damaged_runs import GARBLED, damaged_bytes, damaged_json, draws, refused_or  # noqa: F401
from tests.study.planted import study_folder

STUDY = """
study: planted
scenario: main
set: {duration: 2, expect: []}
vary: {controller: [apd_smc, asmc], robots.mass: [1, 5]}
seeds: 2
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_page, "draw_study", lambda *_: [])
        yield study_folder(tmp_path_factory.mktemp("study"), STUDY)


def read(folder: Path) -> None:
    """Everything that a report says in words, and what a sweep does before it goes on."""
    open_results(folder).front()
    write_study_page(folder)
    with Store(folder) as store:
        store.known(), store.claim(["a"]), store.claimed_by_others()


def test_the_folder_is_in_order(folder) -> None:
    assert not refused_or(lambda: read(folder))


def of_the_design(folder: Path, draw: random.Random) -> None:
    (folder / FILE).write_bytes(damaged_json((folder / FILE).read_bytes(), draw))


def of_the_store(folder: Path, draw: random.Random) -> None:
    (folder / STORE).write_bytes(damaged_bytes((folder / STORE).read_bytes(), draw))


def of_values(folder: Path, draw: random.Random) -> None:
    """Writes another value into a place of each run, or drops a column or a table."""
    value, kind = draw.choice(GARBLED), draw.random()
    text = json.dumps(value)
    written: Any = draw.choice(
        [text, text.encode(), b"\xff\x00", -7, 1e308, float("inf"), f"[{text}]", f'{{"a": {text}}}']
    )
    with sqlite3.connect(folder / STORE) as connection:
        columns = [row[1] for row in connection.execute("PRAGMA table_info(runs)")]
        column = draw.choice([one for one in columns if one != "key"])
        if kind < 0.1:
            connection.execute(f"ALTER TABLE runs DROP COLUMN {column}")
        elif kind < 0.15:
            connection.execute("DROP TABLE runs")
        elif kind < 0.25:
            connection.execute("INSERT INTO claims VALUES ('x', ?, ?)", (written, written))
        else:
            connection.execute(f"UPDATE runs SET {column} = ?", (written,))


@pytest.mark.parametrize(("damage", "least"), [(of_the_design, 10), (of_the_store, 3), (of_values, 10)])
def test_damage_is_read_or_refused(folder, draws, tmp_path, damage, least) -> None:  # noqa: F811
    refused = 0
    for number, draw in enumerate(draws):
        copy = Path(shutil.copytree(folder, tmp_path / str(number)))
        damage(copy, draw)
        refused += refused_or(lambda copy=copy: read(copy))
    assert refused > least
