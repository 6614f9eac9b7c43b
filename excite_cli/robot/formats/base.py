"""The family of formats: from a file's text to that of a URDF of the same robot."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Asked:
    """What a description is read with: folders of packages, and arguments of xacro."""

    package_dirs: tuple[str, ...] = ()
    arguments: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Urdf:
    """A URDF's text, further folders that its meshes lie in, and what it cannot hold."""

    text: str
    folders: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class RobotFormat(ABC):
    """One way to describe a robot."""

    name: str

    @abstractmethod
    def recognises(self, path: Path, text: str) -> bool:
        """Whether a file with that text is of this format."""

    @abstractmethod
    def urdf(self, path: Path, text: str, asked: Asked) -> Urdf:
        """The same robot as a URDF.

        Raises
        ------
        RobotError
            The file is not what it seems to be, or holds what no URDF can.
        MissingExtraError
            The library that reads it is not installed.
        """
