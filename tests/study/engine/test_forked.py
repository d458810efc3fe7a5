"""Errors of a worker that was forked for a command which is gone."""

import subprocess
import sys

import pytest

SERVER = """
import os, signal, sys, time
import escort_mj.study.engine.forked
if os.fork() == 0:
    if sys.argv[1] == "orphan":
        while os.getppid() == escort_mj.study.engine.forked._SERVER:
            time.sleep(0.01)
    raise FileNotFoundError("a semaphore")
if sys.argv[1] == "orphan":
    os.kill(os.getpid(), signal.SIGKILL)
os.wait()
"""


@pytest.mark.parametrize(("which", "said"), [("child", "FileNotFoundError: a semaphore"), ("orphan", "")])
def test_only_a_worker_whose_server_lives_says_its_errors(which: str, said: str) -> None:
    done = subprocess.run([sys.executable, "-c", SERVER, which], capture_output=True, text=True)
    assert said in done.stderr if said else done.stderr == ""
