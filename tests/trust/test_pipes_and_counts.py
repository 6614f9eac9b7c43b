"""What would wait for ever, or take all memory, is refused with a sentence that names the limit."""

import os
import shlex
import socket
import stat
from pathlib import Path

import pytest

from excite_cli.errors import ExciteError
from excite_cli.given_files import require_stored
from tests.trust.conftest import SMOKE, Loop
from tests.trust.in_process import refused


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".mcap", ".db3", ".npz", ".yaml", ".json"])
@pytest.mark.parametrize("command", ["identify", "check", "--prior", "report"])
def test_a_named_pipe_is_refused(tmp_path: Path, suffix: str, command: str) -> None:
    pipe = tmp_path / f"log{suffix}"
    os.mkfifo(pipe)
    arguments: dict[str, list[str | Path]] = {
        "--prior": ["optimize", SMOKE, "--prior", pipe, "-o", tmp_path / "o.h5"],
        "report": ["report", pipe, "-o", tmp_path / "p.html"],
    }
    told = refused(*arguments.get(command, [command, SMOKE, pipe]))
    assert f"{pipe} is a named pipe, not a regular file" in told


def test_pipes_as_config_urdf_and_in_a_bag(tmp_path: Path) -> None:
    pipe, bag = tmp_path / "arm.yaml", tmp_path / "bag"
    os.mkfifo(pipe)
    assert "is a named pipe" in refused("optimize", pipe, "-o", tmp_path / "o.h5")
    urdf = f"robot.urdf={pipe}"
    assert "is a named pipe" in refused("check", SMOKE, SMOKE, "--set", urdf)
    bag.mkdir()
    (bag / "metadata.yaml").touch()
    os.mkfifo(bag / "log.db3")
    assert "log.db3 is a named pipe" in refused("identify", SMOKE, bag)


def test_devices_and_sockets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the path of a socket is short
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("log.csv")
        with pytest.raises(ExciteError, match=r"log\.csv is a socket"):
            require_stored(Path("log.csv"))
    assert stat.S_ISCHR(os.stat("/dev/zero").st_mode)
    with pytest.raises(ExciteError, match="/dev/zero is a device"):
        require_stored(Path("/dev/zero"))


HUGE = 10**12
BSPLINE = f"'trajectory={{family: bspline, duration: 5, control_points: {HUGE}}}'"
# What is asked of the config C or its result R, and words of the limit.
COUNTS = {
    "simulate C R --repeat 1000000000": "1 to 10,000",
    f"simulate C R --periods {HUGE}": "1 to 10,000",
    "simulate C R --repeat 9999 --periods 9999": "up to 20,000,000",
    f"compare-random C --optimized R --set optimizer.max_iterations=4 --candidates {HUGE}":
        "allowed: 1 to 1,000,000",
    f"optimize C --starts {HUGE}": "10000",
    f"optimize C --motions {HUGE}": "1000",
    f"optimize C --workers {HUGE}": "1 to 256",
    f"check C R --random {HUGE}": "0 to 10,000,000",
    "check C R --rate 1e12": "1 to 1e+06 Hz",
    f"export R -f csv --periods {HUGE}": "give 1 to 10,000",
    f"optimize C --set trajectory.harmonics={HUGE}": "100",
    "optimize C --set sampling.cost.samples=1000000": "up to 2,000,000",
    f"optimize C --set {BSPLINE}": "500",
}  # fmt: skip


@pytest.mark.parametrize("command", COUNTS)
def test_absurd_counts(
    command: str, loop: Loop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    files = {"C": str(SMOKE), "R": str(loop.result)}
    given = [files.get(word, word) for word in shlex.split(command)]
    if given[0] in ("simulate", "optimize", "export"):
        given += ["-o", "new.h5"]
    assert COUNTS[command] in refused(*given)
    assert not list(tmp_path.glob("new*"))
