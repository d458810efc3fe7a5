"""Interrupts: held back while something ends in order, then `KeyboardInterrupt`; one line and exit code."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from escort_mj import stopping
from escort_mj.mission.batch import in_threads


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Signals as a Python program has them; afterwards as they were."""
    before = {number: signal.getsignal(number) for number in stopping.SIGNALS}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_an_interrupt_waits_for_what_ends_in_order() -> None:
    said = []
    with pytest.raises(KeyboardInterrupt):
        with stopping.deferred():
            assert stopping.asked() == ""
            signal.raise_signal(signal.SIGINT)
            said.append(stopping.asked())
            with stopping.deaf():
                said.append(stopping.asked())
        said.append("never")
    assert said == ["SIGINT", ""]
    assert stopping.asked() == "" and signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_error_does_not_hide_an_interrupt() -> None:
    with pytest.raises(KeyboardInterrupt), stopping.deferred():
        signal.raise_signal(signal.SIGINT)
        raise ValueError


def test_signals_that_come_together_are_one() -> None:
    with pytest.raises(KeyboardInterrupt), stopping.deferred():
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)


def test_ignored_signals_stay_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with stopping.deferred():
        signal.raise_signal(signal.SIGINT)
        assert not stopping.asked()


def test_the_innermost_says_what_is_kept() -> None:
    with pytest.raises(stopping.Interrupted, match="^three runs$"):
        with stopping.keeping(lambda: "all"), stopping.keeping(lambda: "three runs"):
            raise KeyboardInterrupt


def test_threads_end_what_they_do_when_nobody_takes_results() -> None:
    begun, ended = threading.Event(), threading.Event()

    def work(item: int) -> int:
        if item == 0:
            return 0
        begun.set()
        while not stopping.asked():
            begun.wait(0.01)
        ended.set()
        return 1

    with pytest.raises(KeyboardInterrupt):
        for _ in in_threads(work, range(2), 2):
            assert begun.wait(10.0)
            raise KeyboardInterrupt
    assert ended.wait(10.0)


COMMAND = """
import signal, sys, time
from escort_mj import stopping

class Fragile:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

def run():
    if sys.argv[1] == "fragile":
        Fragile()
        time.sleep(10.0)
    elif sys.argv[1] == "library":
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt as stop:  # as the command line's library does
            raise SystemExit(130) from stop
    elif sys.argv[1] == "class":  # before Python 3.12, an error of __set_name__ becomes a RuntimeError
        class Named:
            def __set_name__(self, owner, name):
                signal.raise_signal(signal.SIGINT)
        type("Owner", (), {"named": Named()})
    elif sys.argv[1] == "error":
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as stop:
            raise OSError("a library's own words") from stop
    elif sys.argv[1] == "kept":
        with stopping.keeping(lambda: "all is kept"):
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt as stop:
                raise ImportError("a library's own words") from stop
    elif sys.argv[1] == "folder":
        import json, tempfile
        from pathlib import Path
        from escort_mj.record.folder import RunFolder
        path = Path(tempfile.mkdtemp())
        try:
            with RunFolder.create(path):
                try:
                    signal.raise_signal(signal.SIGINT)
                except KeyboardInterrupt as stop:
                    raise ImportError("a library's own words") from stop
        except ImportError:
            assert json.loads((path / "outcome.json").read_text())["outcome"] == "interrupted"
            raise
    elif sys.argv[1] == "text":
        exec("signal.raise_signal(signal.SIGTERM)")
    elif sys.argv[1] == "swallowed":
        try:
            signal.raise_signal(signal.SIGTERM)
        except BaseException:
            pass
        stopping.raise_if_interrupted()
    elif sys.argv[1] == "machine code":  # that does not come back, as in an endless loop
        import ctypes, os, threading
        stopping.PATIENCE, lock = 0.05, ctypes.create_string_buffer(64)
        for delay in (0.1, 0.3):
            threading.Timer(delay, os.kill, (os.getpid(), signal.SIGTERM)).start()
        for _ in range(2):
            ctypes.CDLL(None).pthread_mutex_lock(lock)
        print("never")
    elif sys.argv[1] == "twice":
        stopping.PATIENCE = 0.0
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            time.sleep(0.01)
            signal.raise_signal(signal.SIGINT)
            print("never")
    with stopping.keeping(lambda: "all is kept"):
        signal.raise_signal(signal.SIGTERM)
    print("never")

if sys.argv[1] == "early":
    signal.pthread_sigmask(signal.SIG_BLOCK, stopping.SIGNALS)
    signal.raise_signal(signal.SIGINT)
stopping.command(run)
"""


@pytest.mark.parametrize(
    "how", ["fragile", "library", "class", "error", "kept", "folder", "text", "swallowed", "early", "plain"]
)
def test_a_command_says_one_line_and_ends(how: str) -> None:
    done = subprocess.run([sys.executable, "-c", COMMAND, how], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (stopping.EXIT_CODE, "")
    kept = "all is kept" if how in ("plain", "kept") else "the same command begins again"
    assert done.stderr == f"escort-mj: interrupted; {kept}\n"


@pytest.mark.parametrize("how", ["twice", "machine code"])
def test_a_second_interrupt_ends_a_command_at_once(how: str) -> None:
    done = subprocess.run([sys.executable, "-c", COMMAND, how], capture_output=True, text=True, timeout=20)
    assert (done.returncode, done.stdout, done.stderr) == (stopping.EXIT_CODE, "", "")


def test_a_command_that_has_nowhere_to_say_it_ends_all_the_same() -> None:
    shell = ["bash", "-c", 'exec "$@" 2>&-', "bash", sys.executable, "-c", COMMAND, "plain"]
    done = subprocess.run(shell, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (stopping.EXIT_CODE, "")


def test_an_ignored_interrupt_reaches_a_command() -> None:
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, "fragile"],
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN) and None,
        env=os.environ,
    )
    assert done.returncode == stopping.EXIT_CODE, done.stderr
