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


def handshake(port: int, host: str, origin: str | None) -> str:
    """The status line with which a websocket is answered."""
    lines = [
        "GET / HTTP/1.1",
        f"Host: {host}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {KEY}",
        "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: viser-v{viser.__version__}",
    ]
    lines += [f"Origin: {origin}"] if origin is not None else []
    with socket.create_connection(("127.0.0.1", port), timeout=10) as stream:
        stream.sendall("\r\n".join([*lines, "", ""]).encode())
        return stream.recv(4096).decode(errors="replace").splitlines()[0]


def test_its_own_page_and_programs_may_connect(port: int) -> None:
    for host in (f"localhost:{port}", f"127.0.0.1:{port}", "localhost:9999"):
        assert " 101 " in handshake(port, host, f"http://{host}")
    assert " 101 " in handshake(port, f"localhost:{port}", None)


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "null", "http://localhost:1", "https://localhost.evil.example", ""],
)
def test_pages_of_other_sites_may_not(port: int, origin: str) -> None:
    assert " 403 " in handshake(port, f"localhost:{port}", origin)


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
