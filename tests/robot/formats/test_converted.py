"""Conversions can end, hang or fill their own process only, and are not made twice."""

import subprocess
from pathlib import Path
from unittest.mock import Mock

import pytest

from excite_cli.errors import MissingExtraError, RobotError
from excite_cli.robot.allowed_files import allowed_files
from excite_cli.robot.description import load_description
from excite_cli.robot.formats import converted as module
from excite_cli.robot.formats.base import ConversionRequest, Urdf
from excite_cli.robot.formats.converted import converted
from excite_cli.robot.formats.mjcf_sources import mjcf_sources

from .lethal import Lethal

MODEL = """<mujoco><compiler meshdir="shapes"/><asset><mesh name="m" file="m.obj"/></asset>
<worldbody><include file="arm.xml"/></worldbody></mujoco>"""
ARM = (
    '<mujocoinclude><body name="a"><joint name="j" range="-90 {upper}"/>'
    '<geom type="mesh" mesh="m" mass="1"/></body></mujocoinclude>'
)
OBJ = "v 0 0 0\nv {0} 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def given(folder: Path, text: str) -> Urdf:
    path = folder / "robot.x"
    path.write_text(text)
    return converted(Lethal(), path, text, ConversionRequest())


@pytest.mark.long
@pytest.mark.parametrize(("text", "words"), [("abort", "fails"), ("grow", "too much memory")])
def test_a_file_that_ends_the_library_is_one_message(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(RobotError, match=rf"^robot\.x: reading it as Lethal .*{words}"):
        given(tmp_path, text)
    with pytest.raises(MissingExtraError, match=r"^pip install something$"):
        given(tmp_path, "missing")


def test_a_file_that_never_ends_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_SECONDS", 0.3)
    with pytest.raises(RobotError, match="takes too long"):
        given(tmp_path, "run on")
    monkeypatch.setattr(module, "_SECONDS", 60.0)
    monkeypatch.setattr(module, "_SLOWEST", 0.01)
    with pytest.raises(RobotError, match="takes too long"):
        given(tmp_path, "run on")


def test_what_libraries_print_and_log_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    found = given(tmp_path, "<robot/>")
    # Folders that no conversion has a need of are not believed.
    assert found == Urdf("<robot/>", (), ("a note",), (), (("a", "b"),))
    assert [path.name for path in tmp_path.iterdir()] == ["robot.x"]
    assert capfd.readouterr() == ("", "")


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An MJCF of three files, converted once; its cache is its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes" / "m.obj").write_text(OBJ.format(0.1))
    (tmp_path / "arm.xml").write_text(ARM.format(upper=90))
    path = tmp_path / "robot.xml"
    path.write_text(MODEL)
    load_description(str(path))
    return path


@pytest.fixture
def made(robot: Path, monkeypatch: pytest.MonkeyPatch) -> Mock:
    """Called as often as a process was started for a conversion."""
    counted = Mock(side_effect=subprocess.run)
    monkeypatch.setattr(module.subprocess, "run", counted)
    return counted


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "text", "seen"),
    [
        ("arm.xml", ARM.format(upper=45), 'upper="0.785'),
        ("shapes/m.obj", OBJ.format(0.2), 'upper="1.57'),
        ("robot.xml", MODEL.replace("<asset>", '<compiler angle="radian"/><asset>'), 'upper="90'),
    ],
)
def test_any_file_that_changes_is_seen(
    robot: Path, made: Mock, name: str, text: str, seen: str
) -> None:
    """The same files are converted once."""
    before = load_description(str(robot)).xml
    assert made.call_count == 0
    assert before.count("<link") == 2
    assert "file://" in before
    (robot.parent / name).write_text(text)
    after = load_description(str(robot)).xml
    assert made.call_count == 1
    assert after != before
    assert seen in after


def test_a_mesh_of_the_cache_that_is_damaged_is_made_anew(robot: Path, made: Mock) -> None:
    (mesh,) = (robot.parent / "cache" / "excite" / "meshes").glob("*.stl")
    content = mesh.read_bytes()
    mesh.write_bytes(content[:-1] + b"x")
    load_description(str(robot))
    assert made.call_count == 1
    assert mesh.read_bytes() == content


def test_what_may_be_read_is_listed(robot: Path, tmp_path: Path) -> None:
    allowed = allowed_files(robot)
    found = mjcf_sources(robot, robot.read_text(), allowed)
    assert found is not None
    names = {str(path.relative_to(tmp_path)) for path in found}
    assert names == {"robot.xml", "arm.xml", "shapes/m.obj"}
    attached = MODEL.replace("<asset>", '<asset><model name="o" file="other.xml"/>')
    (tmp_path / "other.xml").write_text("<mujoco/>")
    assert mjcf_sources(robot, attached, allowed) is None
