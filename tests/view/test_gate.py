"""Who may watch and steer: pages of the viewer's own server, and nobody else's."""

import socket

import pytest

from escort_mj.scenario import parse_scenario
from escort_mj.view.gate import refusal
from escort_mj.view.tape import Live
from escort_mj.view.viewer import Viewer

viser = pytest.importorskip("viser")
Headers = pytest.importorskip("websockets.datastructures").Headers

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"


@pytest.mark.parametrize(
    ("listening", "host", "origin"),
    [
        (LOOPBACK, "127.0.0.1:8080", None),
        (LOOPBACK, "localhost:8080", "http://localhost:8080"),
        (LOOPBACK, "LOCALHOST", "http://localhost"),
        (LOOPBACK, "[::1]:8080", "http://[::1]:8080"),
        (LOOPBACK, "localhost:2222", "https://localhost:2222"),  # through a tunnel
        (EVERYWHERE, "192.168.1.7:8080", "http://192.168.1.7:8080"),
        (EVERYWHERE, f"{socket.gethostname()}:8080", None),
        ("lab.example", "lab.example:8080", "http://lab.example:8080"),
    ],
)
def test_pages_of_the_server_itself(listening, host, origin) -> None:
    headers = Headers(Host=host, **({"Origin": origin} if origin else {}))
    assert refusal(headers, listening) == ""


@pytest.mark.parametrize(
    ("listening", "host", "origin", "words"),
    [
        (LOOPBACK, "127.0.0.1:8080", "http://evil.example", "Origin 'http://evil.example'"),
        (LOOPBACK, "127.0.0.1:8080", "http://127.0.0.1:9999", "Origin"),  # another server of this machine
        (LOOPBACK, "127.0.0.1:8080", "null", "Origin 'null'"),  # a file, or a page in a sandbox
        (LOOPBACK, "127.0.0.1:8080", "http://127.0.0.1:8080.evil.example", "Origin"),
        (LOOPBACK, "evil.example:8080", "http://evil.example:8080", "Host 'evil.example:8080'"),
        (LOOPBACK, "192.168.1.7:8080", None, "Host"),
        (LOOPBACK, "localhost.evil.example", None, "Host"),
        (LOOPBACK, "[::1", None, "Host"),
        (LOOPBACK, "", None, "Host"),
        (EVERYWHERE, "evil.example", None, "Host"),
    ],
)
def test_pages_of_others(listening, host, origin, words) -> None:
    headers = Headers(Host=host, **({"Origin": origin} if origin else {}))
    assert words in refusal(headers, listening)


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
