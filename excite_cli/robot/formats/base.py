"""The family of formats: from a file's text to that of a URDF of the same robot."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar


@dataclass(frozen=True)
class ConversionRequest:
    """What a description is read with: folders of packages, and arguments of xacro.

    absent: packages that are nowhere, for which the one that the file lies in stands.
    """

    package_dirs: tuple[str, ...] = ()
    arguments: Mapping[str, object] = field(default_factory=dict)
    absent: tuple[str, ...] = ()


@dataclass(frozen=True)
class Urdf:
    """A URDF's text, with what was made for it and what it cannot hold.

    folders: further ones that its meshes lie in; notes: what was left out; meshes: files that were
    made in the cache; ignored: pairs of links whose contact the robot's author ruled out.
    """

    text: str
    folders: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    meshes: tuple[str, ...] = ()
    ignored: tuple[tuple[str, str], ...] = ()


class RobotFormat(ABC):
    """One way to describe a robot.

    `foreign`: it is read by a library that a file may lead astray, so in a process of its own.
    """

    name: str
    foreign: ClassVar[bool] = True

    @abstractmethod
    def recognises(self, path: Path, text: str) -> bool:
        """Whether a file with that text is of this format."""

    @abstractmethod
    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        """The same robot as a URDF.

        Raises
        ------
        RobotError
            The file is not what it seems to be, or holds what no URDF can.
        OutsideError
            It needs a file that it may not read.
        MissingExtraError
            The library that reads it is not installed.
        """

    def load_library(self) -> None:
        """Import what reads the format, before the process is confined.

        Raises
        ------
        MissingExtraError
            It is not installed.
        """
        return

    def sources(self, path: Path, text: str, asked: ConversionRequest) -> tuple[Path, ...] | None:
        """All files whose content decides what becomes of `path`; None where that is not known.

        Raises
        ------
        OutsideError
            The file names one that it may not read.
        """
        return None
