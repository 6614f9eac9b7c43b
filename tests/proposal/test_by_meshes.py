"""Pairs of links kept apart by their meshes because the config says so."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import pytest

from excite_cli.config.constraints_spec import ConstraintsSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.errors import ConfigError
from excite_cli.geometry.pair_tables import mesh_tables
from excite_cli.robot.model import Robot, build_robot
from tests.geometry.test_pair_tables import NONE, WRIST


@pytest.fixture(autouse=True)
def own_cache() -> Iterator[None]:
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.dict("os.environ", {"XDG_CACHE_HOME": folder}),
    ):
        yield


@pytest.fixture
def wrist(tmp_path: Path) -> Robot:
    (tmp_path / "wrist.urdf").write_text(WRIST)
    return build_robot(RobotSpec(urdf="wrist.urdf"), tmp_path)


def constraints(robot: Robot, **own: object) -> dict[str, Constraint]:
    spec = ConstraintsSpec.model_validate({"self_collision": {"margin": 0.001, **own}})
    return {constraint.name: constraint for constraint in build_constraints(spec, robot)}


def test_the_table_takes_the_place_of_the_capsules(wrist: Robot) -> None:
    found = constraints(wrist, by_meshes=[["plate", "bar"]])
    assert found["mesh_clearance"].labels == ("plate – bar",)
    capsules = found.get("self_collision")
    assert capsules is None or not any("plate – bar" in label for label in capsules.labels)


@pytest.mark.parametrize(
    ("pair", "words"),
    [
        (["plate", "far"], "3 moved joints are between them"),
        (["plate", "cross"], "a joint connects both links"),
        (["plate", "baar"], "Did you mean 'bar'"),
    ],
)
def test_a_pair_that_no_table_guards_is_refused(wrist: Robot, pair: list[str], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        constraints(wrist, by_meshes=[pair])


def test_links_in_contact_at_the_posture_are_refused(tmp_path: Path) -> None:
    (tmp_path / "wrist.urdf").write_text(WRIST)
    robot = build_robot(RobotSpec(urdf="wrist.urdf", posture={"pitch": 0.88}), tmp_path)
    with pytest.raises(ConfigError, match=r"nearer than 0.002 m at robot\.posture"):
        constraints(robot, by_meshes=[["plate", "bar"]])


def test_another_posture_takes_the_same_tables(wrist: Robot, tmp_path: Path) -> None:
    """Tables depend on two joints only: a posture that is changed must not cost minutes again."""
    mesh_tables(wrist, (), NONE)
    moved = build_robot(RobotSpec(urdf="wrist.urdf", posture={"twist": 0.3}), tmp_path)
    with mock.patch("excite_cli.geometry.pair_tables._table", side_effect=AssertionError):
        assert [table.first for table in mesh_tables(moved, (), NONE)] == ["plate"]
