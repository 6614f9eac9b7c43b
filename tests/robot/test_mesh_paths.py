"""Names of meshes as users meet them, and where packages are found."""

from pathlib import Path

import pytest

from excite_cli.robot.description import RobotDescription, load_description
from excite_cli.robot.mesh_paths import MeshFiles, unusable
from excite_cli.robot.package_search import needed_folders
from tests.proposal.robots import GOOD, joint, link, written


def described(folder: Path, name: str) -> RobotDescription:
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
    files = MeshFiles(described(tmp_path, name.format(absolute=mesh)))
    found = files.found(name.format(absolute=mesh))
    assert found == mesh
    assert files.may_read(found)


@pytest.mark.parametrize("name", ["package://arm_support/l.stl", "package://", "file://", "no.stl"])
def test_names_that_mean_none(tmp_path: Path, mesh: Path, name: str) -> None:
    assert MeshFiles(described(tmp_path, name)).found(name) is None


def test_a_path_relative_to_a_folder_above_is_found(tmp_path: Path) -> None:
    described(tmp_path, "meshes/l.stl")
    above = tmp_path / "arm_description"
    (above / "meshes").mkdir()
    (above / "meshes" / "l.stl").write_text("solid")
    (needed,) = needed_folders(described(tmp_path, "meshes/l.stl"))
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
    robot = described(tmp_path / "robots", name)
    assert needed_folders(robot) == []
    monkeypatch.setenv(variable, str(prefix))
    (needed,) = needed_folders(robot)
    assert (needed.name, needed.folder) == ("the package 'hand'", share / "hand")


def test_a_missing_mesh_of_a_package_that_is_there_is_told_as_such(
    tmp_path: Path, mesh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/opt/ros/share")
    name = "package://arm_support/none.stl"
    (wrong,) = unusable(described(tmp_path, name), "collision").values()
    assert f"collision mesh '{name}' was not found in the package 'arm_support'" in wrong.words
    assert "ROS_PACKAGE_PATH (/opt/ros/share)" in wrong.words
    assert "AMENT_PREFIX_PATH (not set)" in wrong.words
    (wrong,) = unusable(described(tmp_path, "package://hand/l.stl"), "collision").values()
    assert wrong.words.startswith("the package 'hand' of the collision mesh")
