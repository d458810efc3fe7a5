"""A headless browser that is told what to do while a page lives, by the DevTools protocol."""

import base64
import itertools
import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

from tests.report.browser import BROWSER, FLAGS

PATIENCE = 120.0  # for anything that is waited for [s]


class Browser:
    """One page in a headless browser. A context manager.

    Attributes:
        complaints: Errors and warnings on its console, and exceptions that nobody caught.
    """

    def __init__(self, url: str, profile: Path, size: tuple[int, int] = (1280, 800)) -> None:
        assert BROWSER is not None
        flags = [*FLAGS, f"--user-data-dir={profile}", "--remote-debugging-port=0"]
        flags += [
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
            f"--window-size={size[0]},{size[1]}",
        ]
        self._process = subprocess.Popen(
            [BROWSER, *flags, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self.complaints: list[str] = []
        self._numbers = itertools.count(1)
        port = profile / "DevToolsActivePort"
        wait(lambda: port.exists() and len(port.read_text().splitlines()) == 2, "a browser")
        number, path = port.read_text().splitlines()
        self._socket = connect(f"ws://127.0.0.1:{number}{path}", max_size=None)
        target = self._say("Target.createTarget", url="about:blank")["targetId"]
        self._session = None
        self._session = self._say("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._say(f"{domain}.enable")
        self._say(
            "Emulation.setDeviceMetricsOverride",
            width=size[0],
            height=size[1],
            deviceScaleFactor=1,
            mobile=False,
        )
        self._say("Page.navigate", url=url)

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *error: object) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(20)

    def ask(self, expression: str) -> Any:
        """The value of a JavaScript expression."""
        answer = self._say("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def picture(self) -> bytes:
        """What the page looks like, as PNG."""
        return base64.b64decode(self._say("Page.captureScreenshot", format="png")["data"])

    def _say(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Sends a command and waits for its answer; what the page says meanwhile is kept."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if getattr(self, "_session", None):
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            said = json.loads(self._socket.recv(PATIENCE))
            if said.get("id") == number:
                assert "error" not in said, said
                return said["result"]
            self._listen(said)

    def _listen(self, said: dict[str, Any]) -> None:
        found, what = said.get("params", {}), said.get("method")
        if what == "Runtime.exceptionThrown":
            self.complaints.append(str(found["exceptionDetails"]))
        elif what == "Log.entryAdded" and found["entry"]["level"] == "error":
            self.complaints.append(f"{found['entry']['text']} {found['entry'].get('url', '')}")
        elif what == "Runtime.consoleAPICalled" and found["type"] == "error":
            self.complaints.append(str([one.get("value", one.get("description")) for one in found["args"]]))


def wait(condition: Callable[[], Any], what: str) -> None:
    """Waits until something is so."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"there never was {what}"
        time.sleep(0.05)
