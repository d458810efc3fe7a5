"""Who may watch and steer: pages of the viewer's own server, and nobody else's."""

import socket
from pathlib import Path

import pytest

from escort_mj.scenario import parse_scenario
from escort_mj.view.gate import refusal
from escort_mj.view.tape import Live
from escort_mj.view.viewer import Viewer
from tests.corpus import assert_said, wrong

viser = pytest.importorskip("viser")
Headers = pytest.importorskip("websockets.datastructures").Headers

LOOPBACK = "127.0.0.1"


@pytest.mark.parametrize("case", wrong(Path(__file__).with_name("requests")))
def test_who_is_refused(case) -> None:
    """All but pages of the server itself, by whatever name it has there."""
    host = case["host"].replace("HERE", socket.gethostname())
    headers = Headers(Host=host, **({"Origin": case["origin"]} if "origin" in case else {}))
    found = refusal(headers, case["listening"])
    assert found if "said" in case else not found
    assert_said(found, case.get("said", ""))


def test_two_hosts_are_none() -> None:
    headers = Headers([("Host", "localhost"), ("Host", "evil.example")])
    assert refusal(headers, LOOPBACK) and refusal(Headers(), LOOPBACK)


def status(port: int, *lines: str) -> int:
    """Status of the answer to a request."""
    with socket.create_connection((LOOPBACK, port), timeout=10) as connection:
        connection.sendall("\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).encode())
        return int(connection.recv(100).split()[1])


def test_a_server_answers_its_own_pages_only(compiled) -> None:
    mission = "{name: watched, duration: 0.1, robots: {count: 3}}"
    with Viewer(Live(parse_scenario(mission)), port=0) as viewer:
        port = int(viewer.url.rpartition(":")[2])
        key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
        socket_of = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", key)
        version = f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"
        host = f"Host: 127.0.0.1:{port}"
        assert status(port, host) == 200
        assert status(port, host, *socket_of, version, f"Origin: http://127.0.0.1:{port}") == 101
        assert status(port, host, *socket_of, version, "Origin: http://evil.example") == 403
        assert status(port, f"Host: evil.example:{port}", *socket_of, version) == 403
        assert status(port, f"Host: evil.example:{port}") == 403
