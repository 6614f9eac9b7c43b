from dataclasses import dataclass
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.cli.program import BRIEF, SMOKE, Program


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def excite(tmp_path: Path, cache: Path) -> Program:
    """The program in an empty folder."""
    return Program(tmp_path, cache)


@dataclass(frozen=True)
class Run:
    """A finished `excite optimize` and its result file."""

    process: CompletedProcess[str]
    path: Path


@pytest.fixture(scope="session")
def two_motions(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Run:
    """Two brief motions of the smoke arm, with `--json`, into a folder that is not there yet."""
    folder = tmp_path_factory.mktemp("two_motions")
    path = folder / "new" / "folder" / "arm.h5"
    run = Program(folder, cache)("optimize", SMOKE, "-o", path, *BRIEF, "--json")
    assert run.returncode == 0, run.stderr
    return Run(run, path)
