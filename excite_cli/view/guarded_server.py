"""Who may talk to the viewer's server: the page that it gave out, and no other page in a browser.

A page of any other site may open a websocket to this machine (its `Origin` is then foreign), and a
name that an attacker owns may be made to lead here (its `Host` is then foreign). Both are refused
before viser sees the request. Programs send no `Origin`; they are not a web page.

A request that two readers may understand in two ways (two `Host` headers, a target with a host of
its own) is refused as well: what stands before this server may have judged by the other one.
"""

import http
import ipaddress
import re
import socket
from collections.abc import Iterator, Mapping, Sequence
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
# A name or an address, an IPv6 address in brackets, and a port.
_HOST = re.compile(r"(?:[a-z0-9._-]+|\[[0-9a-f:.%]+\])(?::[0-9]{1,5})?", re.IGNORECASE | re.ASCII)


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


def ambiguous(target: str, hosts: Sequence[str], origins: Sequence[str]) -> str | None:
    """What of a request can be read in more than one way, in words; None for a plain one.

    `target` is that of the request's first line, `hosts` and `origins` are all its headers of
    these names.
    """
    if not target.startswith("/") or target.startswith("//"):
        return f"'{target}' is not a path on this server"
    if len(hosts) != 1:
        return f"{len(hosts)} Host headers; a request has one"
    if not _HOST.fullmatch(hosts[0]):
        return f"Host '{hosts[0]}' is not one name with a port"
    if len(origins) > 1:
        return f"{len(origins)} Origin headers; a request has one at most"
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

    def process(connection: Any, request: Any) -> Any:
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        reason = ambiguous(request.path, hosts, origins)
        if reason is not None:
            return _refusal(http.HTTPStatus.BAD_REQUEST, reason)
        headers = dict(zip(("Host", "Origin"), (*hosts, *origins), strict=False))
        reason = foreign(headers, serving_host)
        if reason is not None:
            return _refusal(http.HTTPStatus.FORBIDDEN, reason)
        answer = inner(connection, request) if inner is not None else None
        if answer is not None:
            answer.headers.update(_HEADERS)
        return answer

    return process


def _refusal(status: http.HTTPStatus, reason: str) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    text = f"Refused: {reason}.\n".encode("ascii", "replace")
    headers = Headers({"Content-Type": "text/plain", "Content-Length": str(len(text))})
    return Response(status, status.phrase, headers, text)


def _hostname(host: str) -> str | None:
    """The name in a `Host` header, in small letters; None where it is none."""
    if not _HOST.fullmatch(host):
        return None
    try:
        return urlsplit(f"//{host}").hostname
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
