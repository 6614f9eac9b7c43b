from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import cache
from tests.cli.program import ROOT, Program

__all__ = ["cache"]


@dataclass(frozen=True)
class Planned:
    """A config of `excite init`, and a motion as `excite export --entry` writes it."""

    urdf: Path
    config: Path
    motion: Path

    @property
    def joints(self) -> list[str]:
        return [name[2:] for name in self._header() if name.startswith("q_")]

    @property
    def start(self) -> np.ndarray:
        row = np.loadtxt(self.motion, delimiter=",", skiprows=1, max_rows=1)
        return row[1 : len(self.joints) + 1]

    @property
    def seconds(self) -> float:
        return float(np.loadtxt(self.motion, delimiter=",", skiprows=1, usecols=0)[-1])

    def edited(self, path: Path, old: str, new: str) -> Path:
        """The motion with other words."""
        path.write_text(self.motion.read_text().replace(old, new))
        return path

    def _header(self) -> list[str]:
        with self.motion.open() as file:
            return file.readline().strip().split(",")


def _planned(folder: Path, cache: Path, urdf: Path, *settings: str) -> Planned:
    excite = Program(folder, cache)
    brief = "--set", "optimizer.max_iterations=12", "--set", "optimizer.restarts=1"
    for command in (
        ("init", "--urdf", urdf, "-o", "arm.yaml", *settings),
        ("optimize", "arm.yaml", "-o", "arm.h5", "--motions", "1", *brief),
        ("export", "arm.h5", "--format", "csv", "--entry", "--rate", "200", "-o", "motion.csv"),
    ):
        run = excite(*command)
        assert run.returncode == 0, run.stderr
    return Planned(urdf, folder / "arm.yaml", folder / "motion.csv")


@pytest.fixture(scope="session")
def ur10(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Planned:
    urdf = ROOT / "data" / "ur10_cb" / "ur10.urdf"
    return _planned(tmp_path_factory.mktemp("ur10"), cache, urdf)


@pytest.fixture(scope="session")
def smoke_arm(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Planned:
    return _planned(tmp_path_factory.mktemp("arm"), cache, ROOT / "data" / "smoke_arm.urdf")


@pytest.fixture
def excite(tmp_path: Path, cache: Path) -> Program:
    return Program(tmp_path, cache)
