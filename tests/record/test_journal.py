import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from escort_mj.errors import RunFolderError
from escort_mj.files import read_text
from escort_mj.record.journal import EPISODES, HEADER, SAMPLES, Journal, journal_of, read_journal
from escort_mj.signals import EPISODE as COLUMNS


def test_what_is_appended_is_on_disk_at_once(tmp_path):
    journal = Journal(tmp_path / "journal", {"record_size": 3})
    block = np.arange(12.0).reshape(4, 3)
    journal.append(block[:3])
    journal.append(block[3:])
    episodes = np.arange(2.0 * len(COLUMNS)).reshape(2, -1)
    journal.append(block[:0], episodes)
    samples, found, header = read_journal(tmp_path / "journal")  # still open
    np.testing.assert_array_equal(samples, block)
    np.testing.assert_array_equal(found, episodes)
    assert header == {"record_size": 3}
    journal.close()


def test_blocks_need_not_be_contiguous_or_double(tmp_path):
    journal = Journal(tmp_path / "journal", {"record_size": 2})
    journal.append(np.arange(16.0).reshape(4, 4)[::2, ::2])
    journal.append(np.array([[7, 8]], dtype=np.int32))
    journal.close()
    np.testing.assert_array_equal(read_journal(tmp_path / "journal")[0], [[0, 2], [8, 10], [7, 8]])


def test_a_touch_that_has_not_ended_is_not_lost(tmp_path):
    """Its row is written anew each time; once it has ended it counts once, even if nothing came after."""
    journal = Journal(tmp_path / "journal", {"record_size": 1})
    touch = np.arange(float(len(COLUMNS)))
    longer, other = touch.copy(), touch + 1.0
    longer[4:] *= 2.0
    journal.append(np.zeros((1, 1)), under_way=np.array([touch]))
    np.testing.assert_array_equal(read_journal(tmp_path / "journal")[1], [touch])
    journal.append(np.zeros((1, 1)), under_way=np.array([longer, other]))
    np.testing.assert_array_equal(read_journal(tmp_path / "journal")[1], [longer, other])
    journal.append(np.zeros((1, 1)), np.array([longer]), np.array([longer, other]))
    np.testing.assert_array_equal(read_journal(tmp_path / "journal")[1], [longer, other])
    journal.append(np.zeros((1, 1)), np.array([other]))
    np.testing.assert_array_equal(read_journal(tmp_path / "journal")[1], [longer, other])
    journal.close()


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(width=st.integers(1, 5), rows=st.integers(0, 6), lost=st.integers(0, 60))
def test_a_torn_end_costs_the_last_row_only(tmp_path, width, rows, lost):
    block = np.arange(float(rows * width)).reshape(rows, width)
    episodes = np.arange(float(rows * len(COLUMNS))).reshape(rows, len(COLUMNS))
    journal = Journal(tmp_path / "journal", {"record_size": width})
    journal.append(block, episodes)
    journal.close()
    left = {}
    for name in (SAMPLES, EPISODES):
        whole = (tmp_path / "journal" / name).read_bytes()
        left[name] = max(len(whole) - lost, 0)
        (tmp_path / "journal" / name).write_bytes(whole[: left[name]])
    samples, found, _ = read_journal(tmp_path / "journal")
    assert samples.shape == (left[SAMPLES] // (8 * width), width)
    assert found.shape == (left[EPISODES] // (8 * len(COLUMNS)), len(COLUMNS))
    np.testing.assert_array_equal(samples, block[: len(samples)])
    np.testing.assert_array_equal(found, episodes[: len(found)])


def test_a_raw_write_that_takes_little_at_a_time_loses_nothing(tmp_path, monkeypatch):
    journal = Journal(tmp_path / "journal", {"record_size": 2})
    file = journal._file

    class Slow:
        def write(self, data: memoryview) -> int:
            return file.write(data[:5])

        def close(self) -> None:
            file.close()

    monkeypatch.setattr(journal, "_file", Slow())
    journal.append(np.arange(8.0).reshape(4, 2))
    journal.close()
    np.testing.assert_array_equal(read_journal(tmp_path / "journal")[0].ravel(), np.arange(8.0))


def test_a_new_journal_forgets_the_old_one(tmp_path):
    for value in (1.0, 2.0):
        journal = Journal(tmp_path / "journal", {"record_size": 1, "value": value})
        journal.append(np.full((1, 1), value))
        journal.close()
    samples, _, header = read_journal(tmp_path / "journal")
    assert samples.tolist() == [[2.0]]
    assert header["value"] == 2.0


def test_the_header_is_json_without_nan(tmp_path):
    Journal(tmp_path, {"record_size": 1, "limit": [np.inf, 1.5], "n": np.int64(3)}).close()
    text = (tmp_path / HEADER).read_text()
    assert json.loads(text, parse_constant=pytest.fail) == {"record_size": 1, "limit": [None, 1.5], "n": 3}


@pytest.mark.parametrize("header", ["{}", "[]", "{not json", '{"record_size": 0}'])
def test_a_spoiled_header_is_one_clear_error(tmp_path: Path, header):
    Journal(tmp_path, {"record_size": 1}).close()
    (tmp_path / HEADER).write_text(header)
    with pytest.raises(RunFolderError, match=r"header\.json(: cannot be read| is damaged)"):
        read_journal(tmp_path)


def test_a_folder_in_place_of_a_file_is_named_once(tmp_path: Path):
    with pytest.raises(RunFolderError, match=f"^{tmp_path}: cannot be read: Is a directory$"):
        read_text(tmp_path)


def test_a_folder_without_a_whole_journal_has_none(tmp_path):
    assert journal_of(tmp_path) is None
    (tmp_path / "journal").mkdir()
    (tmp_path / "journal" / HEADER).write_text("{}")
    assert journal_of(tmp_path) is None
