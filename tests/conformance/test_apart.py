"""Plugins checked in a process of their own, which they may end."""

import pytest

from escort_mj.conformance.apart import check_apart
from escort_mj.errors import PluginError
from tests.plugged import LAW


def test_what_ends_the_process_is_reported_with_what_was_tried(compiled, tmp_path) -> None:
    wild = "import ctypes\n        ctypes.memset(0, 0, 1) if r.e.shape == (4, 3) else None"
    (tmp_path / "own.py").write_text(LAW.replace("return r.rho_hat", f"{wild}\n        return r.rho_hat"))
    *before, last = check_apart(str(tmp_path / "own.py"))
    assert [check.name for check in before] == ["loads", "parameters", "defaults", "wrong values"]
    assert all(check.held and check.member == "Pid" for check in before)
    assert last[:3] == ("Pid", "survives", False)
    assert last.words.startswith("SIGSEGV ended the process: ")
    assert last.words.endswith("while it was tried with 4 robots in 3 axes")


def test_a_plugin_that_cannot_be_loaded_is_refused_as_elsewhere(tmp_path) -> None:
    with pytest.raises(PluginError, match="nothing.py: there is no such file"):
        list(check_apart(str(tmp_path / "nothing.py")))
