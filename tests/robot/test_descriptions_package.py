"""Names of robot_descriptions, on a package like it that lies in a folder."""

from pathlib import Path

import pytest

from excite_cli.errors import MissingExtraError, RobotError
from excite_cli.robot import descriptions_package
from excite_cli.robot.description import load_description
from excite_cli.robot.descriptions_package import find_description
from tests.proposal.robots import arm

XACRO = (
    '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="a"><xacro:arg name="length" '
    'default="1"/><link name="base"/><link name="l"/><joint name="j" type="revolute">'
    '<parent link="base"/><child link="l"/><origin xyz="$(arg length) 0 0"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a URDF, a xacro with arguments, one that cannot be fetched, one of nothing."""
    monkeypatch.setattr(descriptions_package, "_PACKAGE", "some_descriptions")
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


@pytest.mark.parametrize("name", ["arm_description", "arm"])
def test_a_name_means_a_file(package: Path, name: str) -> None:
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
    monkeypatch.setattr(descriptions_package, "_PACKAGE", "no_descriptions")
    find_description.cache_clear()
    with pytest.raises(MissingExtraError, match="Install it with pip, or give a file"):
        load_description("robot_descriptions:ur10e_description")
