"""A plugin checked in a process of its own: what breaks the process is reported, and breaks nothing else."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from escort_mj.conformance import stand
from escort_mj.conformance.checking import Check, check_plugin
from escort_mj.errors import EscortError, PluginError

CHECK, TRYING, REFUSED, BROKE, DONE = "check", "trying", "refused", "broke", "done"


def check_apart(written: str) -> Iterator[Check]:
    """Check all that a plugin brings, as `check_plugin` does, in another process.

    Args:
        written: A Python file, or the name of an installed plugin.

    Yields:
        One row for each check, as it is made; if the process dies, a last one that says what was being tried.

    Raises:
        PluginError: If the plugin cannot be loaded.
    """
    reading, writing = os.pipe()
    command = [sys.executable, "-m", "escort_mj.conformance", str(writing), written]
    with open(reading, encoding="utf-8") as messages:
        try:
            # What the plugin prints is no result. An interrupt is for this process, which ends the other.
            child = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=2, pass_fds=(writing,), start_new_session=True
            )
        finally:
            os.close(writing)
        member, tried, done = "plugin", "to load it", False
        try:
            for message in map(json.loads, messages):
                if CHECK in message:
                    yield Check(*message[CHECK])
                elif TRYING in message:
                    member, tried = message[TRYING]
                elif DONE in message:
                    done = True
                elif REFUSED in message:
                    raise PluginError(message[REFUSED])
                else:
                    raise RuntimeError(message[BROKE])
            if (code := child.wait()) or not done:
                yield Check(member, "survives", False, f"{_ending(code)} while it was tried {tried}")
        finally:
            child.kill()
            child.wait()


def _ending(code: int) -> str:
    """How a process ended, in words."""
    if code >= 0:
        return f"the process ended with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    wild = code in (-signal.SIGSEGV, -signal.SIGBUS, -signal.SIGABRT)
    return f"{name} ended the process{': it reads or writes where it may not,' if wild else ''}"


def serve(file: int, written: str) -> None:
    """Check a plugin, and tell another process of it line by line.

    Args:
        file: Descriptor to write to.
        written: The plugin.
    """
    with open(file, "w", encoding="utf-8") as messages:

        def tell(kind: str, content: Any) -> None:
            messages.write(json.dumps({kind: content}) + "\n")
            messages.flush()

        stand.listeners.append(lambda *words: tell(TRYING, words))
        try:
            for check in check_plugin(written):
                tell(CHECK, (check.member, check.name, bool(check.held), check.words))
            tell(DONE, None)
        except EscortError as error:
            tell(REFUSED, str(error))
        except Exception as error:
            tell(BROKE, f"{type(error).__name__}: {error}")
