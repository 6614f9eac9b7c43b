"""The same seed gives the same numbers, whatever differs around the process."""

import subprocess
from pathlib import Path

import pytest

from benchmarks.trust.kill_commands import numbers
from excite_cli.measurement.hdf5_writer import new_hdf5
from tests.cli.program import EXCITE, SMOKE, environment

BRIEF = ("--motions", "1", "--set", "optimizer.max_iterations=4", "--quiet")


def test_hashes_threads_language_and_caches_change_no_bit(tmp_path: Path) -> None:
    others = {
        "one": {"PYTHONHASHSEED": "1", "OPENBLAS_NUM_THREADS": "1"},
        "two": {"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "2", "LC_ALL": "tr_TR.UTF-8"},
    }
    found = []
    for name, changes in others.items():
        folder = tmp_path / name
        folder.mkdir()
        subprocess.run(
            [*EXCITE, "optimize", SMOKE, "-o", "out.h5", *BRIEF], check=True, cwd=folder,
            env={**environment(folder / "cache"), **changes}, stdin=subprocess.DEVNULL,
            capture_output=True,
        )  # fmt: skip
        found.append(numbers(folder / "out.h5"))
    assert "motions/1/coefficients" in found[0]
    assert found[0] == found[1]


def test_a_full_disk_fails_once_for_an_hdf5_file(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(OSError, match="No space left"), new_hdf5(Path("/dev/full")) as file:
        file["zeros"] = [0.0] * 1000
    assert capfd.readouterr().err == ""
