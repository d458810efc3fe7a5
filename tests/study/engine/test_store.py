"""The store of results: nothing lost, nothing twice, whoever dies."""

import json
import multiprocessing
import os
import signal
import sqlite3
import time
from pathlib import Path

import pytest

from escort_mj.errors import UsageError
from escort_mj.files import MACHINE, PARTIAL
from escort_mj.metrics import METRIC_NAMES
from escort_mj.study.engine.store import FILE, SILENCE, Row, Store, open_store
from tests.synthetic import make_verdict


def row(key: str, **changes: object) -> Row:
    metrics = {"radius_error_mean": 0.25, "settling_time": float("inf"), "energy_ratio": None}
    settings, versions, verdicts = {"robots.mass": 2.0}, {"mujoco": "3"}, [make_verdict()]
    return Row(
        key, 3, settings, "completed", "done", True, 2.0, 0.1, verdicts, "name: x\n", versions, metrics
    )._replace(**changes)  # fmt: skip


def test_what_is_put_is_got(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.put(row("a"))
    with open_store(tmp_path) as store:
        (found,) = store.get(["a", "b"]).values()
        assert store.known() == {"a"}
    assert found._replace(metrics={}) == row("a", metrics={})
    assert found.metrics["settling_time"] == float("inf")
    assert found.metrics["energy_ratio"] is None
    assert set(found.metrics) == set(METRIC_NAMES)


def test_what_a_killed_study_left_half_written_is_removed(tmp_path: Path) -> None:
    ended = multiprocessing.get_context("spawn").Process(target=os.getpid)
    ended.start()
    ended.join()
    (tmp_path / "figures").mkdir()
    before = f"{PARTIAL}.{MACHINE}"
    left = [f"{before}.{ended.pid}.1.runs.csv", f"figures/{before}.{ended.pid}.1.front.svg"]
    others = [
        f"{before}.{os.getpid()}.1.runs.csv",
        f"{PARTIAL}.elsewhere.{ended.pid}.1.runs.csv",
        f"{before}.mine",
        "mine.csv",
    ]
    for name in (*left, *others):
        (tmp_path / name).write_text("half")
    Store(tmp_path).close()
    assert {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")} >= {*others, FILE}
    assert not any((tmp_path / name).exists() for name in left)


def test_a_store_whose_damage_is_no_text_is_refused(tmp_path: Path) -> None:
    Store(tmp_path).close()
    with sqlite3.connect(tmp_path / FILE) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    whole = (tmp_path / FILE).read_bytes()
    assert b"CREATE TABLE claims" in whole
    (tmp_path / FILE).write_bytes(whole.replace(b"CREATE TABLE claims", b"CREATE \x83ABLE claims"))
    with pytest.raises(UsageError, match="cannot be used as a store of results"):
        open_store(tmp_path)


def test_a_run_is_written_once(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.put(row("a"))
        store.put(row("a", message="again"))
        assert store.get(["a"])["a"].message == "done"


def test_it_is_a_table_that_others_can_read(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.put(row("a"))
    connection = sqlite3.connect(tmp_path / FILE)
    mass = "json_extract(settings, '$.\"robots.mass\"')"
    found = connection.execute(f"SELECT seed, radius_error_mean, {mass} FROM runs WHERE passed").fetchall()
    assert found == [(3, 0.25, 2.0)]


def test_claims_keep_two_from_making_the_same(tmp_path: Path) -> None:
    with Store(tmp_path) as one, Store(tmp_path) as other:
        other._owner = json.dumps(json.loads(other._owner) | {"pid": os.getppid(), "process_start": None})
        assert one.claim(["a", "b"]) == ["a", "b"]
        assert one.claimed_by_others() == 0
        assert other.claim(["a", "b", "c"]) == ["c"]
        assert other.claimed_by_others() == 2
        one.put(row("a"))
        assert other.claim(["a"]) == []
        assert other.claimed_by_others() == 1
    with Store(tmp_path) as late:  # whoever closes gives back
        assert late.claim(["b", "c"]) == ["b", "c"]


def _hold(folder: Path, ready: "multiprocessing.synchronize.Event") -> None:
    store = Store(folder)
    store.claim(["a", "b"])
    store.put(row("a"))
    ready.set()
    time.sleep(60)


def test_claims_of_the_dead_lapse(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(target=_hold, args=(tmp_path, ready))
    process.start()
    assert ready.wait(60)
    with Store(tmp_path) as store:
        assert store.claim(["a", "b", "c"]) == ["c"]
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)
        process.join()
        assert store.claim(["a", "b"]) == ["b"]
        assert store.known() == {"a"}


def test_what_is_no_store_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="holds no results"):
        open_store(tmp_path)
    (tmp_path / FILE).write_text("this is no database, whatever its name says" * 100)
    with pytest.raises(UsageError, match="cannot be used as a store"):
        Store(tmp_path)
    other = tmp_path / "other"
    other.mkdir()
    connection = sqlite3.connect(other / FILE)
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(UsageError, match="results of format 99; this program reads 1"):
        Store(other)


@pytest.mark.parametrize("jump", [-1e6, 1e6])
def test_a_clock_that_is_set_takes_no_claim_from_the_living(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jump: float
) -> None:
    with Store(tmp_path) as first, Store(tmp_path) as second:
        second._owner = first._owner.replace("host", "hust")  # no process of this machine's
        assert first.claim(["a"]) == ["a"]
        now = time.time()
        monkeypatch.setattr(time, "time", lambda: now + jump)
        assert second.claim(["a"]) == []
        first.put(row("a"))
        assert second.claim(["a"]) == []


def test_another_machines_claim_lapses_after_silence_and_its_late_result_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Store(tmp_path) as away, Store(tmp_path) as here:
        away._owner = json.dumps(json.loads(away._owner) | {"host": "elsewhere"}, sort_keys=True)
        assert away.claim(["a", "b"]) == ["a", "b"]
        now = time.time()
        monkeypatch.setattr(time, "time", lambda: now + SILENCE - 1.0)
        assert here.claim(["a"]) == []
        away.beat()
        monkeypatch.setattr(time, "time", lambda: now + 1.5 * SILENCE)
        assert here.claim(["a"]) == []
        monkeypatch.setattr(time, "time", lambda: now + 3.0 * SILENCE)
        assert here.claim(["a"]) == ["a"]
        here.put(row("a"))
        away.put(row("a", seed=9))
        assert here.get(["a"])["a"].seed == 3
