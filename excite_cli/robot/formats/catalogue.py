"""All formats; the first that recognises a file reads it."""

from pathlib import Path

from excite_cli.robot.formats.base import ConversionRequest, RobotFormat, Urdf
from excite_cli.robot.formats.converted import converted
from excite_cli.robot.formats.mjcf import Mjcf
from excite_cli.robot.formats.plain_urdf import PlainUrdf
from excite_cli.robot.formats.sdf import Sdf
from excite_cli.robot.formats.xacro import Xacro

FORMATS: tuple[RobotFormat, ...] = (Xacro(), Mjcf(), Sdf(), PlainUrdf())


def as_urdf(path: Path, text: str, asked: ConversionRequest) -> Urdf:
    """The robot of a file as a URDF.

    Raises
    ------
    RobotError, MissingExtraError
        See `converted`.
    """
    form = next(each for each in FORMATS if each.recognises(path, text))
    return converted(form, path, text, asked) if form.foreign else form.urdf(path, text, asked)
