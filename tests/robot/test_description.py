"""Robots of example-robot-data are found where pip and where conda put them."""

import sys
from importlib import metadata
from pathlib import Path

import pytest

from excite_cli.errors import RobotError
from excite_cli.robot.description import example_robots, example_robots_folder


def absent(name: str) -> metadata.Distribution:
    raise metadata.PackageNotFoundError(name)


def test_robots_of_conda_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its package has no Python metadata; the files are in share/ of the environment."""
    urdf = tmp_path / "share/example-robot-data/robots/one/urdf/arm.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.touch()
    monkeypatch.setattr(metadata, "distribution", absent)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert example_robots() == {"arm": urdf}


def test_robots_of_pip_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "share/example-robot-data/robots").mkdir(parents=True)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert "cmeel.prefix" in example_robots_folder().parts


def test_robots_that_are_nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata, "distribution", absent)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    with pytest.raises(RobotError, match=r"are not in .*Run: pip install example-robot-data"):
        example_robots_folder()
