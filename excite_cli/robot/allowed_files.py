"""Which files a robot's description may read: those of its own folder and of `package_dirs`.

A description comes from anywhere, and names other files: includes, meshes, tables of numbers. They
are read where they lie, by whatever links they are reached, in the description's own folder (the
ROS package that it lies in, if it lies in one) or in a folder that the config allows. What is found
elsewhere is named in an `OutsideError`, which says what would have to be allowed.
"""

import os
import stat
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import RobotError

# Folders above a description in which its own things are usually kept (`robots/arm/urdf`).
_ABOVE = 3
_SHOWN = 80  # characters of a name that messages repeat
_MARKS = ("package.xml", "model.config")  # of ROS and of Gazebo


@dataclass(frozen=True)
class FolderRequest:
    """What a description asks for, and the folder that would have to be allowed for it.

    near: the folder is a package that says so itself, or lies beside the description; a path that
    leads elsewhere may lead anywhere.
    """

    name: str
    folder: Path
    near: bool

    def __str__(self) -> str:
        """The folder in full; the name, which the file chose, short and without what steers."""
        return f"{_printable(self.name)[:_SHOWN]} in {_printable(str(self.folder))}"


class OutsideError(RobotError):
    """A description names a file outside the folders that it may read."""

    def __init__(self, source: str, needed: FolderRequest, own: Path) -> None:
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


def outside(file: Path, path: Path) -> FolderRequest:
    """What would have to be allowed for a `file`, which the description at `path` names."""
    return needed(file.name, file.parent, path)


def needed(name: str, folder: Path, path: Path) -> FolderRequest:
    """A folder that the description at `path` asks for, by the name of what is in it."""
    real = folder.resolve()
    above = [each for each in path.resolve().parents[:_ABOVE] if not holds_everything(each)]
    beside = any(real.is_relative_to(each) for each in above)
    marked = any(is_trusted(real / mark, path) for mark in _MARKS)
    hidden = any(part.startswith(".") for part in real.parts[1:] if part not in path.parts)
    near = (beside or marked) and not hidden and not holds_everything(real)
    return FolderRequest(name, folder, near and is_trusted(real, path))


def holds_everything(folder: Path) -> bool:
    """Whether it is the root, lies in it (`/tmp`), or is the home folder or above it."""
    return len(folder.parts) <= 2 or any(each.is_relative_to(folder) for each in _home())


def _home() -> tuple[Path, ...]:
    """The home folder as it is named and where it is; none for a user without any."""
    try:
        return Path.home(), Path.home().resolve()
    except RuntimeError:
        return ()


def _printable(text: str) -> str:
    return "".join(each if each.isprintable() else "?" for each in text)


def own_folder(path: Path) -> Path:
    """The ROS package that a file lies in, else the folder that it lies in.

    A package.xml of another user above the file makes no package of it, nor one in a home folder
    or in a folder that everybody may write to.
    """
    path = path.resolve()
    for folder in path.parents:
        if holds_everything(folder):
            break
        mark = folder / "package.xml"
        if is_trusted(mark, path) and is_trusted(folder, path) and not _is_open(folder):
            return folder
    return path.parent


def _is_open(folder: Path) -> bool:
    """Whether everybody may put files into a folder: nobody's package."""
    return bool(folder.stat().st_mode & stat.S_IWOTH)


def is_trusted(found: Path, path: Path) -> bool:
    """Whether there is something, of the user, the system or the owner of `path`; links as well."""
    try:
        owners = {found.lstat().st_uid, found.stat().st_uid}
        if not hasattr(os, "geteuid"):
            return True
        return owners <= {os.geteuid(), 0, path.stat().st_uid}
    except (OSError, ValueError):
        return False
