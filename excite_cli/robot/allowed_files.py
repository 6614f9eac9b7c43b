"""Which files a robot's description may read: those of its own folder and of `package_dirs`.

A description comes from anywhere, and names other files: includes, meshes, tables of numbers. They
are read where they lie, by whatever links they are reached, in the description's own folder (the
ROS package that it lies in, if it lies in one) or in a folder that the config allows. What is found
elsewhere is named in an `OutsideError`, which says what would have to be allowed.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import RobotError

# Folders above a description in which its own things are usually kept (`robots/arm/urdf`).
_ABOVE = 3


@dataclass(frozen=True)
class Needed:
    """What a description asks for, and the folder that would have to be allowed for it.

    near: it was found by the name of its package, or lies beside the description; a path that
    leads elsewhere may lead anywhere.
    """

    name: str
    folder: Path
    near: bool = True

    def __str__(self) -> str:
        return f"{self.name} in {self.folder}"


class OutsideError(RobotError):
    """A description names a file outside the folders that it may read."""

    def __init__(self, source: str, needed: Needed, own: Path) -> None:
        self.source, self.needed, self.own = source, needed, own
        super().__init__(
            f"{source} asks for {needed}, which is outside its own folder ({own}). If that is "
            f"meant, allow the folder {needed.folder}: list it under robot.package_dirs, or give "
            f"`excite init` --package-dirs FOLDER{' or --allow-found' if needed.near else ''}."
        )


@dataclass(frozen=True)
class AllowedFiles:
    """The folders of one description, resolved; `own` is the first of them."""

    path: Path
    folders: tuple[Path, ...]

    @property
    def source(self) -> str:
        """The description's name."""
        return self.path.name

    @property
    def own(self) -> Path:
        """The description's own folder."""
        return self.folders[0]

    def has(self, path: Path) -> bool:
        """Whether a path leads, by whatever links, to something within the folders."""
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):  # links in a circle, NUL in a name
            return False
        return any(real.is_relative_to(folder) for folder in self.folders)

    def require(self, path: Path) -> Path:
        """The path, resolved.

        Raises
        ------
        OutsideError
            It leads out of the folders.
        RobotError
            It is no name of a file.
        """
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError) as error:
            raise RobotError(f"{self.source}: {str(path)[:200]!r} is no path: {error}.") from error
        if not self.has(real):
            raise OutsideError(self.source, outside(real, self.path), self.own)
        return real


def allowed_files(path: Path, package_dirs: Iterable[str | Path] = ()) -> AllowedFiles:
    """What a description at `path` may read, with the folders that the config allows."""
    folders = (own_folder(path), *(Path(folder).resolve() for folder in package_dirs))
    return AllowedFiles(path, tuple(dict.fromkeys(folders)))


def outside(file: Path, path: Path) -> Needed:
    """What would have to be allowed for a `file`, which the description at `path` names."""
    above = [each for each in path.resolve().parents[:_ABOVE] if not _holds_everything(each)]
    near = any(file.is_relative_to(each) for each in above) and is_trusted(file, path)
    return Needed(file.name, file.parent, near)


def _holds_everything(folder: Path) -> bool:
    """Whether it is the root, lies in it (`/tmp`), or is the home folder."""
    return folder == Path.home() or len(folder.parts) <= 2


def own_folder(path: Path) -> Path:
    """The ROS package that a file lies in, else the folder that it lies in.

    A package.xml of somebody else above the file makes no package of it, nor one in a home folder.
    """
    path = path.resolve()
    for folder in path.parents:
        if _holds_everything(folder):
            break
        mark = folder / "package.xml"
        if mark.is_file() and is_trusted(folder, path) and is_trusted(mark, path):
            return folder
    return path.parent


def is_trusted(found: Path, path: Path) -> bool:
    """Whether what was found belongs to the user, to the system or to the owner of `path`."""
    if not hasattr(os, "geteuid"):
        return True
    try:
        return found.stat().st_uid in (os.geteuid(), 0, path.stat().st_uid)
    except OSError:
        return False
