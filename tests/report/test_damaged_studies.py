"""Folders of studies that were damaged: they are read, or refused with a message."""

import json
import random
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


def test_designs(folder, draws) -> None:  # noqa: F811
    file, refused = folder / FILE, 0
    before = file.read_bytes()
    try:
        for draw in draws:
            file.write_bytes(damaged_json(before, draw))
            refused += refused_or(lambda: read(folder))
    finally:
        file.write_bytes(before)
    assert refused > 10


def whole_store(folder: Path) -> bytes:
    """The store as one file, nothing of it in a journal."""
    with sqlite3.connect(folder / STORE) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return (folder / STORE).read_bytes()


def put(folder: Path, content: bytes) -> None:
    for file in folder.glob(f"{STORE}*"):
        file.unlink()
    (folder / STORE).write_bytes(content)


def test_bytes_of_a_store(folder, draws) -> None:  # noqa: F811
    before, refused = whole_store(folder), 0
    try:
        for draw in draws:
            put(folder, damaged_bytes(before, draw))
            refused += refused_or(lambda: read(folder))
    finally:
        put(folder, before)
    assert refused > 3


def test_values_in_a_store(folder, draws) -> None:  # noqa: F811
    before, refused = whole_store(folder), 0
    with sqlite3.connect(folder / STORE) as connection:
        columns = [row[1] for row in connection.execute("PRAGMA table_info(runs)")]
    try:
        for draw in draws:
            put(folder, before)
            change(folder, draw, columns)
            refused += refused_or(lambda: read(folder))
    finally:
        put(folder, before)
    assert refused > 10


def change(folder: Path, draw: random.Random, columns: list[str]) -> None:
    """Writes another value into a place of each run, or drops a column or a table."""
    column, value = draw.choice([one for one in columns if one != "key"]), draw.choice(GARBLED)
    text = json.dumps(value)
    written: Any = draw.choice(
        [text, text.encode(), b"\xff\x00", -7, 1e308, float("inf"), f"[{text}]", f'{{"a": {text}}}']
    )
    with sqlite3.connect(folder / STORE) as connection:
        kind = draw.random()
        if kind < 0.1:
            connection.execute(f"ALTER TABLE runs DROP COLUMN {column}")
        elif kind < 0.15:
            connection.execute("DROP TABLE runs")
        elif kind < 0.25:
            connection.execute("INSERT INTO claims VALUES ('x', ?, ?)", (written, written))
        else:
            connection.execute(f"UPDATE runs SET {column} = ?", (written,))
