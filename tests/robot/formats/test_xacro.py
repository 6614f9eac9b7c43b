"""xacro files: arguments, packages, and expressions that are programs."""

from pathlib import Path

import pytest

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import OutsideError
from excite_cli.robot.description import load_description

MACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="bar" params="name parent length mass">
<link name="${name}"><inertial><origin xyz="0 0 ${length / 2}"/><mass value="${mass}"/>
<inertia ixx="${mass * length**2 / 12}" iyy="${mass * length**2 / 12}" izz="0.001" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<joint name="${name}_joint" type="revolute"><parent link="${parent}"/><child link="${name}"/>
<axis xyz="0 1 0"/><limit lower="${-pi / 2}" upper="${radians(90)}" velocity="2" effort="9"/>
</joint></xacro:macro></robot>"""
ARM = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">
<xacro:arg name="length" default="0.4"/><xacro:arg name="hand" default="true"/>
<xacro:include filename="$(find {package})/urdf/bar.xacro"/><link name="base"/>
<xacro:bar name="upper" parent="base" length="$(arg length)" mass="{mass}"/>
<xacro:if value="$(arg hand)"><xacro:bar name="hand" parent="upper" length="0.1" mass="1"/>
</xacro:if></robot>"""


def _arm(folder: Path, package: str = "arm_description", mass: str = "2") -> Path:
    """A package whose folder has another name than its package.xml, and an arm that uses it."""
    home = folder / "src" / "arm"
    (home / "urdf").mkdir(parents=True, exist_ok=True)
    (home / "package.xml").write_text("<package><name>arm_description</name></package>")
    (home / "urdf" / "bar.xacro").write_text(MACRO)
    path = home / "urdf" / "arm.urdf.xacro"
    path.write_text(ARM.format(package=package, mass=mass))
    return path


def test_macros_packages_and_arguments(tmp_path: Path) -> None:
    described = load_description(str(_arm(tmp_path, mass="$(eval 2 * length + 1)")))
    assert described.xml.count("<joint") == 2
    assert '<mass value="1.8"' in described.xml
    assert described.name == "arm"
    short = load_description(str(_arm(tmp_path)), arguments={"length": "0.2", "hand": "false"})
    assert short.xml.count("<joint") == 1
    assert 'xyz="0 0 0.1"' in short.xml
    assert short.sha256 != described.sha256


def test_ros_package_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = _arm(tmp_path / "elsewhere")
    moved = tmp_path / "here" / "arm.xacro"
    moved.parent.mkdir()
    moved.write_text(path.read_text())
    with pytest.raises(RobotError, match="the package 'arm_description' was not found"):
        load_description(str(moved))
    given = load_description(str(moved), ("elsewhere/src",), tmp_path)
    assert given.xml.count("<joint") == 2
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "elsewhere" / "src"))
    there = tmp_path / "elsewhere" / "src" / "arm"
    with pytest.raises(OutsideError, match=f"the package 'arm_description' in {there}"):
        load_description(str(moved))
    found = load_description(str(moved), (str(there),))
    assert found.xml.count("<joint") == 2
    assert f"the package 'arm_description' is {there}" in found.notes


@pytest.mark.long
@pytest.mark.parametrize(
    "expression",
    [
        "open('written', 'w')",
        "().__class__",
        "(lambda: ().__class__)()",
        "[x for x in (1,)].gi_frame",
        "(x for x in (1,)).gi_frame.f_back",
    ],
)
@pytest.mark.parametrize("form", ["${{{}}}", "$(eval {})"])
def test_expressions_that_are_programs_are_refused(
    tmp_path: Path, expression: str, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = _arm(tmp_path, mass=form.format(expression))
    with pytest.raises(RobotError, match="xacro cannot expand it"):
        load_description(str(path))
    assert not (tmp_path / "written").exists()


@pytest.mark.long
def test_a_package_that_lost_its_name_is_the_one_the_file_lies_in(tmp_path: Path) -> None:
    path = _arm(tmp_path, "arm_support")
    mesh = '<collision><geometry><mesh filename="package://arm_support/m.stl"/></geometry>'
    text = path.read_text().replace(
        '<link name="base"/>', f'<link name="base">{mesh}</collision></link>'
    )
    path.write_text(text)
    with pytest.raises(RobotError, match="the package 'arm_support' was not found"):
        load_description(str(path))
    (path.parents[1] / "package.xml").unlink()
    with pytest.raises(OutsideError, match=f"the package 'arm_support' in {path.parents[1]}"):
        load_description(str(path))
    found = load_description(str(path), (str(path.parents[1]),))
    assert found.xml.count("<joint") == 2
    assert f"file://{path.parents[1]}/m.stl" in found.xml
    assert any("the package 'arm_support' was not found: " in note for note in found.notes)


def test_a_urdf_that_only_includes_is_a_xacro(tmp_path: Path) -> None:
    path = _arm(tmp_path)
    named = path.with_name("arm.urdf")
    named.write_text(path.read_text())
    assert load_description(str(named)).xml.count("<joint") == 2
    left_over = path.read_text().replace("</robot>", '<joint name="mine"/></robot>')
    named.write_text(left_over)
    with pytest.raises(RobotError, match="joint 'mine' has the parent"):
        load_description(str(named))


def test_properties_without_the_prefix_are_read(tmp_path: Path) -> None:
    """As xacro took them until 2020, and ROS-Industrial's robots still have them."""
    path = _arm(tmp_path, mass="${heavy}")
    old = '<property name="heavy" value="7.5"/><xacro:arg'
    path.write_text(path.read_text().replace("<xacro:arg", old, 1))
    assert 'mass value="7.5"' in load_description(str(path)).xml
