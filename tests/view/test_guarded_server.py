"""The viewer's server answers its own page only."""

import socket
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest

from excite_cli.errors import MissingExtraError
from excite_cli.view.browser import Serving, _server, _stop
from excite_cli.view.guarded_server import POLICY, foreign, guarded

viser = pytest.importorskip("viser")
KEY = "dGhlIHNhbXBsZSBub25jZQ=="


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    server = _server(viser, Serving(port=18431), "arm")
    yield server.get_port()
    _stop(server)


def answer(port: int, own: list[str], target: str = "/") -> str:
    """The status line that a websocket with these headers gets; empty where it gets none."""
    lines = [
        f"GET {target} HTTP/1.1",
        *own,
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {KEY}",
        "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: viser-v{viser.__version__}",
    ]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as stream:
        stream.sendall("\r\n".join([*lines, "", ""]).encode())
        said = stream.recv(4096).decode(errors="replace").splitlines()
    return said[0] if said else ""


def handshake(port: int, host: str, origin: str | None) -> str:
    """The status line with which a websocket is answered."""
    return answer(port, [f"Host: {host}", *([f"Origin: {origin}"] if origin is not None else [])])


def test_its_own_page_and_programs_may_connect(port: int) -> None:
    for host in (f"localhost:{port}", f"127.0.0.1:{port}", "localhost:9999"):
        assert " 101 " in handshake(port, host, f"http://{host}")
    assert " 101 " in handshake(port, f"localhost:{port}", None)
    assert " 101 " in handshake(port, f"LocalHost:{port}", f"http://localhost:{port}")
    for other in ("localhost.", "127.1", "0x7f.0.0.1", "2130706433", "local host"):
        assert " 101 " not in answer(port, [f"Host: {other}"]), "this is no name of this machine"


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "null", "http://localhost:1", "https://localhost.evil.example", ""],
)
def test_pages_of_other_sites_may_not(port: int, origin: str) -> None:
    assert " 403 " in handshake(port, f"localhost:{port}", origin)


HOST = "Host: localhost"
MALFORMED = {
    "no host": ([], "/"),
    "host twice": ([HOST, HOST], "/"),
    "host twice, once foreign": (["Host: localhost:1", "Host: evil.example"], "/"),
    "host twice, foreign first": (["Host: evil.example", "host: localhost"], "/"),
    "a list of hosts": (["Host: localhost:1, evil.example"], "/"),
    "a port that is none": (["Host: localhost:evil.example"], "/"),
    "a user": (["Host: @localhost"], "/"),
    "an empty host": (["Host:"], "/"),
    "letters of another alphabet": (["Host: löcalhost"], "/"),
    "origin twice": ([HOST, "Origin: http://localhost", "Origin: http://localhost"], "/"),
    "a whole address": ([HOST], "http://localhost/"),
    "a whole address elsewhere": ([HOST], "http://evil.example/"),
    "an address without its kind": ([HOST], "//evil.example/"),
    "another server's name": ([HOST], "localhost:80"),
    "the server itself": ([HOST], "*"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_what_may_be_read_in_two_ways_is_refused(port: int, name: str) -> None:
    """Two readers of one request (a proxy and this server) must not see two hosts."""
    headers, target = MALFORMED[name]
    assert " 400 " in answer(port, headers, target)


@pytest.mark.parametrize(
    "more",
    [
        ["Transfer-Encoding: chunked"],
        ["Transfer-Encoding: chunked", "Content-Length: 5"],
        ["Content-Length: 5", "Content-Length: 0"],
        ["X-Long: a", " b"],
        ["Host : evil.example"],
    ],
)
def test_requests_with_a_body_or_folded_lines_get_no_answer(port: int, more: list[str]) -> None:
    said = answer(port, [HOST, *more])
    assert " 101 " not in said
    assert " 200 " not in said


def test_names_that_lead_here_may_not(port: int) -> None:
    name = f"evil.example:{port}"
    assert " 403 " in handshake(port, name, f"http://{name}")
    assert " 403 " in handshake(port, name, None)
    asked = urllib.request.Request(f"http://127.0.0.1:{port}/", headers={"Host": name})
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(asked, timeout=10)
    assert refused.value.code == 403
    assert b"is not a name of this server" in refused.value.read()


def test_the_page_carries_a_policy(port: int) -> None:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=10) as page:
        assert page.headers["Content-Security-Policy"] == POLICY
        assert page.headers["X-Content-Type-Options"] == "nosniff"


def test_served_to_the_network() -> None:
    """Addresses and the names of this machine are ours there; foreign names are not."""
    own = socket.gethostname()
    for host in ("192.168.1.7:8080", "[fe80::1]:8080", f"{own}:8080", "localhost"):
        assert foreign({"Host": host, "Origin": f"http://{host}"}, "0.0.0.0") is None
    assert foreign({"Host": "evil.example"}, "0.0.0.0")
    assert foreign({"Host": "robot.lan"}, "robot.lan") is None
    assert foreign({"Host": "192.168.1.7"}, "127.0.0.1")
    for odd in ("", "a@localhost", "localhost/x", "[::1", "localhost,evil.example"):
        assert foreign({"Host": odd}, "127.0.0.1")


def test_a_library_that_starts_otherwise_is_refused() -> None:
    before = threading.active_count()
    with pytest.raises(MissingExtraError, match="foreign pages"), guarded("127.0.0.1"):
        pass
    assert threading.active_count() == before
