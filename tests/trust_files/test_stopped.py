"""The installed program: runs on one output, stopped, in other places; what they leave is told."""

import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
import typer

from benchmarks.trust.kill_commands import numbers
from excite_cli.cli.app import app
from excite_cli.cli.exit_status import run_guarded
from tests.cli.program import EXCITE, SMOKE, Installed, environment
from tests.end_to_end.conftest import cache, excite

__all__ = ["cache", "excite"]

SHORT = ("--motions", "1", "--set", "optimizer.max_iterations=4", "--quiet")
LONG = ("optimize", SMOKE, "--motions", "9", "--set", "optimizer.max_iterations=300")


def test_two_runs_on_one_output_and_a_stop(excite: Installed) -> None:
    first = excite.start(*LONG, "-o", "out.h5")
    until = time.monotonic() + 60.0
    while not (excite.folder / ".out.h5.lock").exists():
        assert first.poll() is None, first.communicate()[1]
        assert time.monotonic() < until
        time.sleep(0.01)
    second = excite(*LONG, "-o", "out.h5", "--resume")
    assert second.returncode == 2
    assert f"out.h5 is being written by another run (process {first.pid} on" in second.stderr
    first.send_signal(signal.SIGTERM)
    said = first.communicate(timeout=60)[1]
    assert first.returncode == 128 + signal.SIGTERM
    assert "interrupted; what was found so far is in the file" in said
    assert "Traceback" not in said
    assert {each.name for each in excite.folder.iterdir()} <= {"out.h5"}


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("/sys/x.json", "cannot be written: no permission"),
        ("/dev/full", "/dev/full is not a regular file"),
        (".", "is a folder"),
        ("file/x.json", "a part of this path is a file"),
        ("x" * 250, "this name is too long"),
    ],
    ids=["read-only", "device", "folder", "file-as-folder", "long"],
)
def test_a_place_that_cannot_be_written_is_told_before_the_work(
    output: str,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.chdir(tmp_path)
    program: Any = typer.main.get_command(app)
    arguments = ["schema", "-o", output, "--overwrite"]
    assert run_guarded(lambda: program.main(arguments, standalone_mode=False)) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.startswith("error: ")
    assert said.count("\n") == 1
    assert {each.name for each in tmp_path.iterdir()} == {"file"}


def test_a_file_that_outgrows_its_limit_leaves_the_old_one(excite: Installed) -> None:
    (excite.folder / "s.json").write_text("old")
    limited = ["bash", "-c", f'trap "" XFSZ; ulimit -f 8; exec {EXCITE[0]} "$@"', "excite"]
    run = subprocess.run(
        [*limited, "schema", "-o", "s.json", "--overwrite"], cwd=excite.folder, text=True,
        capture_output=True, check=False, env=environment(excite.cache), stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert run.returncode == 2
    assert "s.json cannot be written: it is larger than files may be here" in run.stderr
    assert os.listdir(excite.folder) == ["s.json"]
    assert (excite.folder / "s.json").read_text() == "old"


def test_hashes_threads_language_and_caches_change_no_bit(tmp_path: Path) -> None:
    """The same seed gives the same numbers, whatever differs around the process."""
    others = {
        "one": {"PYTHONHASHSEED": "1", "OPENBLAS_NUM_THREADS": "1"},
        "two": {"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "2", "LC_ALL": "tr_TR.UTF-8"},
    }
    found = []
    for name, changes in others.items():
        folder = tmp_path / name
        folder.mkdir()
        subprocess.run(
            [*EXCITE, "optimize", SMOKE, "-o", "out.h5", *SHORT], check=True, cwd=folder,
            env={**environment(folder / "cache"), **changes}, stdin=subprocess.DEVNULL,
            capture_output=True,
        )  # fmt: skip
        found.append(numbers(folder / "out.h5"))
    assert "motions/1/coefficients" in found[0]
    assert found[0] == found[1]
