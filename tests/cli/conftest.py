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
    return Run(Program(folder, cache).good("optimize", SMOKE, "-o", path, *BRIEF, "--json"), path)


@pytest.fixture(scope="session")
def two_joints(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Path:
    """Two motions of two joints, which are drawn soon."""
    path = tmp_path_factory.mktemp("two_joints") / "smoke.h5"
    small = ("robot.joints=[elbow, slide]", "constraints.self_collision=null")
    options = [word for value in small for word in ("--set", value)]
    program = Program(path.parent, cache)
    program.good("optimize", SMOKE, "-o", path, "--motions", "2", *BRIEF, *options)
    return path
