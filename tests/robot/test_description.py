"""Names of robots of packages, meshes as users name them, and dialects of simulators."""

import sys
from importlib import metadata
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import MissingExtraError, RobotError
from excite_cli.geometry.link_shapes import collision_model, placed_shapes
from excite_cli.robot import ros_packages
from excite_cli.robot.description import (
    RobotDescription,
    example_robots,
    example_robots_folder,
    load_description,
)
from excite_cli.robot.mesh_paths import MeshFiles, needed_folders, unusable
from excite_cli.robot.model import build_robot
from excite_cli.robot.ros_packages import find_description
from tests.proposal.robots import GOOD, arm, joint, link, written


def test_robots_of_pip_come_first_then_those_of_conda(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Conda's package has no Python metadata; its files are in share/ of the environment."""
    share = tmp_path / "share/example-robot-data/robots"
    share.mkdir(parents=True)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert "cmeel.prefix" in example_robots_folder().parts
    absent = Mock(side_effect=metadata.PackageNotFoundError)
    monkeypatch.setattr(metadata, "distribution", absent)
    urdf = share / "one/urdf/arm.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.touch()
    assert example_robots() == {"arm": urdf}
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "nowhere"))
    with pytest.raises(RobotError, match=r"are not in .*Run: pip install example-robot-data"):
        example_robots_folder()


XACRO = (
    '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="a"><xacro:arg name="length" '
    'default="1"/><link name="base"/><link name="l"/><joint name="j" type="revolute">'
    '<parent link="base"/><child link="l"/><origin xyz="$(arg length) 0 0"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a URDF, a xacro with arguments, one that cannot be fetched, one of nothing."""
    monkeypatch.setattr(ros_packages, "_PACKAGE", "some_descriptions")
    folder, clone = tmp_path / "site" / "some_descriptions", tmp_path / "clone" / "arm"
    folder.mkdir(parents=True)
    clone.mkdir(parents=True)
    arm(clone)
    (clone / "arm.xacro").write_text(XACRO)
    where = f"print('Cloning')\nREPOSITORY_PATH = {str(clone)!r}\n"
    for name, text in {
        "__init__": "",
        "arm_description": f"{where}URDF_PATH = {str(clone / 'robot.urdf')!r}",
        "bent_description": f"{where}XACRO_PATH = {str(clone / 'arm.xacro')!r}\n"
        "XACRO_ARGS = {'length': 0.25}",
        "far_description": "raise OSError('Could not resolve host')",
        "lost_description": f"{where}MJCF_PATH = {str(clone / 'none.xml')!r}",
        "ends_description": "import os\nos.abort()",
    }.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(folder.parent)
    find_description.cache_clear()
    return folder


def test_a_name_means_a_file(package: Path) -> None:
    for name in ("arm_description", "arm"):
        found = load_description(f"robot_descriptions:{name}")
        assert found.path.name == "robot.urdf"
        assert str(found.path.parent) in found.package_dirs


def test_arguments_come_with_the_name_and_yield_to_ours(package: Path) -> None:
    assert 'xyz="0.25 0 0"' in load_description("robot_descriptions:bent").xml
    ours = load_description("robot_descriptions:bent", arguments={"length": 0.5})
    assert 'xyz="0.5 0 0"' in ours.xml


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("arms_description", r"has no robot 'arms_description'. Did you mean 'arm_description'"),
        ("far", r"could not be fetched \(Could not resolve host\).*ROBOT_DESCRIPTIONS_CACHE"),
        ("ends", r"could not be fetched \(it ended, or took too long\)"),
        ("lost", r"its repository was fetched, but no file .*none.xml is in it"),
    ],
)
def test_what_cannot_be_had_is_told_with_a_way_on(package: Path, name: str, words: str) -> None:
    with pytest.raises(RobotError, match=words):
        load_description(f"robot_descriptions:{name}")


def test_without_the_package_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros_packages, "_PACKAGE", "no_descriptions")
    find_description.cache_clear()
    with pytest.raises(MissingExtraError, match="Install it with pip, or give a file"):
        load_description("robot_descriptions:ur10e_description")


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A capsule along x, ended by NULs as PyBullet's humanoid is."""
    shape = (
        '<collision><origin xyz="0 0 0.5" rpy="0 1.5707963267948966 0"/><geometry>'
        '<capsule radius="0.1" length="0.6"/></geometry></collision>'
    )
    path = written(
        tmp_path,
        link("base"),
        joint("neck", "base", "head", kind="spherical"),
        link("head"),
        joint("j", "head", "arm", GOOD),
        link("arm", shape=shape),
    )
    path.write_text(path.read_text() + "\r\n\0\0")
    return path


def test_capsules_and_ball_joints_of_simulators(robot: Path) -> None:
    """A capsule is a cylinder with two balls; a ball joint stays where it is."""
    built = build_robot(RobotSpec(urdf=str(robot)))
    found = placed_shapes(built, collision_model(built))
    points = np.vstack([corners for _, name, corners in found if name == "arm"])
    np.testing.assert_allclose(np.ptp(points, axis=0), [0.8, 0.2, 0.2], rtol=0.02)
    np.testing.assert_allclose(points.mean(axis=0), [0, 0, 0.5], atol=0.01)
    assert "ball joints stay where they are: neck" in load_description(str(robot)).notes
    assert built.joint_names == ("j",)


def mesh_named(folder: Path, name: str) -> RobotDescription:
    """A robot in `folder`/arm_description/urdf, whose last link has a mesh of that name."""
    urdf = folder / "arm_description" / "urdf"
    urdf.mkdir(parents=True, exist_ok=True)
    shape = f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'
    path = written(urdf, link("base"), joint("j", "base", "l", GOOD), link("l", shape=shape))
    return load_description(str(path))


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    """A package whose folder has another name, as its package.xml says, with one mesh."""
    package = tmp_path / "arm_description"
    (package / "my meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>arm_support</name></package>")
    path = package / "my meshes" / "l.stl"
    path.write_text("solid")
    return path


@pytest.mark.parametrize(
    "name",
    [
        "package://arm_description/my meshes/l.stl",
        "package://arm_support/my meshes/l.stl",
        "package:///arm_description/my meshes/l.stl",
        "package://arm_description/my%20meshes/l.stl",
        "model://arm_description/my meshes/l.stl",
        "model://arm_support/my meshes/l.stl",
        "../my meshes/l.stl",
        "..\\my meshes\\l.stl",
        "file://../my meshes/l.stl",
        "file://{absolute}",
        "{absolute}",
    ],
)
def test_names_that_mean_a_file(tmp_path: Path, mesh: Path, name: str) -> None:
    files = MeshFiles(mesh_named(tmp_path, name.format(absolute=mesh)))
    found = files.found(name.format(absolute=mesh))
    assert found == mesh
    assert files.may_read(found)


@pytest.mark.parametrize("name", ["package://arm_support/l.stl", "package://", "file://", "no.stl"])
def test_names_that_mean_none(tmp_path: Path, mesh: Path, name: str) -> None:
    assert MeshFiles(mesh_named(tmp_path, name)).found(name) is None


def test_a_path_relative_to_a_folder_above_is_found(tmp_path: Path) -> None:
    mesh_named(tmp_path, "meshes/l.stl")
    above = tmp_path / "arm_description"
    (above / "meshes").mkdir()
    (above / "meshes" / "l.stl").write_text("solid")
    (needed,) = needed_folders(mesh_named(tmp_path, "meshes/l.stl"))
    assert needed.folder == above


@pytest.mark.parametrize("variable", ["ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "GAZEBO_MODEL_PATH"])
def test_packages_of_the_environment_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    prefix = tmp_path / "install" / "hand"
    share = prefix / "share" if variable == "AMENT_PREFIX_PATH" else prefix
    (share / "hand" / "meshes").mkdir(parents=True)
    (share / "hand" / "meshes" / "l.stl").write_text("solid")
    name = "package://hand/meshes/l.stl"
    robot = mesh_named(tmp_path / "robots", name)
    assert needed_folders(robot) == []
    monkeypatch.setenv(variable, str(prefix))
    (needed,) = needed_folders(robot)
    assert (needed.name, needed.folder) == ("the package 'hand'", share / "hand")


def test_a_missing_mesh_of_a_package_that_is_there_is_told_as_such(
    tmp_path: Path, mesh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/opt/ros/share")
    name = "package://arm_support/none.stl"
    (wrong,) = unusable(mesh_named(tmp_path, name), "collision").values()
    assert f"collision mesh '{name}' was not found in the package 'arm_support'" in wrong.words
    assert "ROS_PACKAGE_PATH (/opt/ros/share)" in wrong.words
    assert "AMENT_PREFIX_PATH (not set)" in wrong.words
    (wrong,) = unusable(mesh_named(tmp_path, "package://hand/l.stl"), "collision").values()
    assert wrong.words.startswith("the package 'hand' of the collision mesh")
