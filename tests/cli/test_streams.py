"""Closed, full and plain streams: results are written all the same, and the status is right."""

import json
import shlex
import subprocess
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.cli.program import EXCITE, SMOKE, environment

pytestmark = pytest.mark.long

BROKEN = ("--set", "constraints.joint_limits.acceleration=0.1", "--no-meshes", "--rate", "20")


@pytest.fixture
def shell(tmp_path: Path, cache: Path):  # type: ignore[no-untyped-def]
    """Runs `excite ARGUMENTS REST` in a shell, where REST says what becomes of the streams."""

    def run(
        *arguments: str | Path, rest: str = "", **variables: str
    ) -> subprocess.CompletedProcess[str]:
        words = shlex.join([*EXCITE, *map(str, arguments)])
        return subprocess.run(
            ["bash", "-o", "pipefail", "-c", f"{words} {rest}"],
            cwd=tmp_path,
            env={**environment(cache), **variables},
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=120,
            check=False,
        )

    return run


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-", "2>/dev/full", "> >(true)"])
def test_results_are_written(shell, two_motions: Run, tmp_path: Path, closed: str) -> None:  # type: ignore[no-untyped-def]
    arguments = ("export", two_motions.path, "-f", "csv", "--motion", "1", "-o", "motion.csv")
    run = shell(*arguments, rest=closed)
    assert run.returncode == 0, run.stderr
    written = (tmp_path / "motion.csv").read_text()
    assert written.startswith("t,")
    assert "motion.csv" not in written


@pytest.mark.parametrize("rest", ["| head -1", ">&-", "2>&1 | head -1"])
def test_the_status_is_that_of_the_answer(shell, two_motions: Run, rest: str) -> None:  # type: ignore[no-untyped-def]
    run = shell("check", SMOKE, two_motions.path, *BROKEN, rest=rest)
    assert run.returncode == 1, run.stderr


@pytest.mark.parametrize(
    ("words", "rest", "status"),
    [
        ("robots", "| head -1", 0),
        ("schema", "| head -c 1", 0),
        ("--help", "| true", 0),
        ("optimize --help", "| (exec <&-; sleep 0.1)", 0),
        ("robots no_such_robot", "2>&1 | true", 2),
    ],
)
def test_a_reader_that_leaves_is_no_error(shell, words: str, rest: str, status: int) -> None:  # type: ignore[no-untyped-def]
    """Neither a traceback nor a word of it, whenever the pipe is closed."""
    run = shell(*words.split(), rest=rest)
    assert (run.returncode, run.stderr) == (status, "")


def test_an_answer_that_a_full_disk_loses_is_an_error(shell, two_motions: Run) -> None:  # type: ignore[no-untyped-def]
    run = shell("schema", rest="> /dev/full")
    assert run.stderr.startswith("error: standard output: no space is left on the disk.")
    assert run.stderr.count("\n") == 1
    bad = shell("check", SMOKE, two_motions.path, *BROKEN, rest="> /dev/full")
    assert run.returncode == bad.returncode == 2
    assert "standard output: no space is left on the disk" in bad.stderr


PLAIN = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"}


def test_streams_that_know_few_characters(shell, two_motions: Run, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    place = tmp_path / "é" / "motion.csv"
    arguments = ("export", two_motions.path, "-f", "csv", "--motion", "1", "-o", place)
    run = shell(*arguments, "--json", **PLAIN)
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["motions"][0]["instants"] > 1
    assert place.is_file()
    run = shell("check", SMOKE, two_motions.path, "--no-meshes", "--rate", "20", **PLAIN)
    assert run.returncode == 0, run.stderr
    assert "rad/s?" in run.stdout  # the superscript two


def test_without_a_home_and_a_cache(shell, two_motions: Run) -> None:  # type: ignore[no-untyped-def]
    """Tables are made anew where they cannot be kept."""
    nowhere = {"HOME": "/nonexistent", "XDG_CACHE_HOME": "/proc/none"}
    run = shell("check", SMOKE, two_motions.path, "--no-meshes", "--rate", "20", **nowhere)
    assert run.returncode == 0, run.stderr
