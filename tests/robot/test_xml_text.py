"""The one reader of robots' XML files: what it refuses."""

from pathlib import Path

import pytest

from excite_cli.errors import RobotError
from excite_cli.robot import urdf_check
from excite_cli.robot.urdf_check import xml_text


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"<robot>" + b" " * 100 + b"</robot>", "MB: not a URDF"),
        (b"<robot name='\xff'/>", "cannot be read as text"),
        (b"<!DOCTYPE robot><robot/>", "document type or entities; a URDF needs neither"),
        (b"<!ENTITY a 'b'><robot/>", "document type or entities; a URDF needs neither"),
        (None, "cannot be read as text"),
    ],
    ids=["large", "no text", "document type", "entity", "missing"],
)
def test_text_that_may_not_be_read(
    content: bytes | None, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(urdf_check, "MAX_BYTES", 100)
    path = tmp_path / "arm.urdf"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RobotError, match=message):
        xml_text(path, "a URDF")


def test_text_of_the_largest_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text("<robot/>")
    monkeypatch.setattr(urdf_check, "MAX_BYTES", 8)
    assert xml_text(path, "a URDF") == "<robot/>"
