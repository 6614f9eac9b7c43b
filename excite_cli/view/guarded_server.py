"""Who may talk to the viewer's server: the page that it gave out, and no other page in a browser.

A page of any other site may open a websocket to this machine (its `Origin` is then foreign), and a
name that an attacker owns may be made to lead here (its `Host` is then foreign). Both are refused
before viser sees the request. Programs send no `Origin`; they are not a web page.
"""

import http
import ipaddress
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any
from urllib.parse import urlsplit

from excite_cli.errors import MissingExtraError

# viser's page unpacks itself from one script and draws in workers made of blobs.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; worker-src blob:; "
    "style-src 'unsafe-inline' blob:; img-src data: blob:; font-src data: blob:; "
    "connect-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


def foreign(headers: Mapping[str, str], serving_host: str) -> str | None:
    """What of a request's headers comes from elsewhere, in words; None for our own page.

    Known hosts are the one served at, and localhost with its addresses; where another address than
    those is served, any address written as such and the names of this machine too.
    """
    host = headers.get("Host", "")
    name = _hostname(host)
    if name is None or not _known(name, serving_host):
        return f"Host '{host}' is not a name of this server"
    origin = headers.get("Origin")
    if origin is None:
        return None
    parts = urlsplit(origin)
    if parts.scheme not in ("http", "https") or parts.netloc.lower() != host.lower():
        return f"Origin '{origin}' is another site"
    return None


@contextmanager
def guarded(serving_host: str) -> Iterator[None]:
    """Within it, a server that viser starts refuses foreign requests; its pages carry a policy.

    viser has no place for such a check of its own, so it is put around what viser hands to
    `websockets`.

    Raises
    ------
    MissingExtraError
        This version of viser starts its server in another way, which cannot be guarded.
    """
    from websockets.asyncio import server

    original, started = server.serve, False

    def serve(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        nonlocal started
        started = True
        check = _checked(process_request, serving_host)
        return original(*arguments, process_request=check, **options)

    server.serve = serve  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        server.serve = original  # type: ignore[misc]
    if not started:
        raise MissingExtraError(
            "This version of viser cannot be kept from foreign pages. Run: pip install "
            "'excite-cli[view]' (or take --png or --gif)."
        )


def _checked(inner: Any, serving_host: str) -> Any:
    """`inner`, viser's answer to a request, for requests of our own page only."""
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    def process(connection: Any, request: Any) -> Any:
        reason = foreign(_single(request.headers), serving_host)
        if reason is not None:
            text = f"Refused: {reason}.\n".encode()
            headers = Headers({"Content-Type": "text/plain", "Content-Length": str(len(text))})
            return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", headers, text)
        answer = inner(connection, request) if inner is not None else None
        if answer is not None:
            answer.headers.update(_HEADERS)
        return answer

    return process


def _single(headers: Any) -> dict[str, str]:
    """The two headers that are judged; one that is there twice is joined, and thus foreign."""
    names = ("Host", "Origin")
    return {name: ",".join(all_) for name in names if (all_ := headers.get_all(name))}


def _hostname(netloc: str) -> str | None:
    try:
        parts = urlsplit(f"//{netloc}")
        return parts.hostname if parts.netloc == netloc and not parts.username else None
    except ValueError:
        return None


def _known(name: str, serving_host: str) -> bool:
    address = _address(name)
    if name in ("localhost", serving_host.lower()) or (address and address.is_loopback):
        return True
    served = _address(serving_host)
    if serving_host == "localhost" or (served is not None and served.is_loopback):
        return False
    return address is not None or name in _own_names()


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


@cache
def _own_names() -> frozenset[str]:
    own = socket.gethostname().lower()
    return frozenset({own, f"{own.partition('.')[0]}.local", socket.getfqdn().lower()})
