"""Who may talk to the viewer's server: pages that it served itself, under a name that is this machine's.

A browser sends requests for any page that is open in it. `Origin` says which page; a foreign page may also
have a name of its own that leads here (DNS rebinding), which `Host` gives away.
"""

from __future__ import annotations

import contextlib
import functools
import http
import inspect
import ipaddress
import socket
import threading
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

LOCAL = ("127.0.0.1", "localhost", "::1")
_starting = threading.Lock()


def refusal(headers: Any, listening: str) -> str:
    """Return why a request is refused; empty if it is not.

    Args:
        headers: Of the request, as `websockets` has them.
        listening: The address or name that the server listens at.
    """
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or len(origins) > 1:
        return f"found {len(hosts)} Host and {len(origins)} Origin headers; expected one, and at most one"
    name = _name(hosts[0])
    if not _is_ours(name, listening):
        return f"found the Host {hosts[0][:100]!r}; this server is {listening}"
    if origins and origins[0].lower() not in (
        f"{scheme}://{hosts[0].lower()}" for scheme in ("http", "https")
    ):
        return f"found the Origin {origins[0][:100]!r}; expected pages of {hosts[0]}"
    return ""


def _name(host: str) -> str:
    """Return the name or address in a Host header, without its port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _is_ours(name: str, listening: str) -> bool:
    """Return whether a name can only mean this machine: an address, or a name that it has itself."""
    if name in ("localhost", listening.lower()):
        return True
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        return listening not in LOCAL and name in (socket.gethostname().lower(), socket.getfqdn().lower())
    return address.is_loopback or listening not in LOCAL


@contextlib.contextmanager
def guarded(listening: str) -> Iterator[None]:
    """Have the server of viser that starts within refuse what `refusal` does; viser has no hook for it.

    Args:
        listening: Where it listens.
    """
    from websockets.asyncio import server
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    serve = server.serve

    @functools.wraps(serve)
    def guarded_serve(*args: Any, process_request: Any = None, **rest: Any) -> Any:
        async def checked(connection: Any, request: Any) -> Any:
            if why := refusal(request.headers, listening):
                body = f"{why}\n".encode()
                about = Headers({"Content-Type": "text/plain; charset=utf-8"})
                about["Content-Length"] = str(len(body))
                return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", about, body)
            answer = process_request(connection, request) if process_request is not None else None
            return await answer if inspect.isawaitable(answer) else answer

        return serve(*args, process_request=checked, **rest)

    with _starting:
        server.serve = guarded_serve  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            server.serve = serve  # type: ignore[misc]
