"""URDF itself: nothing to do."""

from pathlib import Path

from excite_cli.robot.formats.base import ConversionRequest, RobotFormat, Urdf


class PlainUrdf(RobotFormat):
    """The format that all others become; what no other recognises is taken for one."""

    name = "URDF"
    foreign = False

    def recognises(self, path: Path, text: str) -> bool:
        """Any file."""
        return True

    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        """The text as it is."""
        return Urdf(text)
