"""Where packages of ROS lie, without ROS: by folder names, by package.xml, by its variables."""

import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import (
    AllowedFiles,
    OutsideError,
    holds_everything,
    is_trusted,
    needed,
)

# Folders of a package in which descriptions lie.
_OF_DESCRIPTIONS = ("urdf", "xacro", "robots", "robot", "models", "model")
_NAME = re.compile(r"[A-Za-z0-9][\w.-]*\Z")  # of a package: one folder, and none that is hidden
_SHOWN = 80  # characters of a name that messages repeat
# By variable: what lies between a folder that it names and the packages.
_VARIABLES = {
    "ROS_PACKAGE_PATH": "",
    "AMENT_PREFIX_PATH": "share",
    "GAZEBO_MODEL_PATH": "",
    "GZ_SIM_RESOURCE_PATH": "",
}


class MissingPackageError(RobotError):
    """A package is not among the folders that a file may read."""

    def __init__(self, name: str) -> None:
        self.name = name
        super().__init__(f"the package '{name}' is not in the folders that may be read")


def is_name(name: str) -> bool:
    """Whether a package may be called so: by one folder's name, which is not hidden."""
    return bool(_NAME.match(name))


def find_package(name: str, allowed: AllowedFiles) -> Path:
    """Folder of the package `name`, among the folders that a file may read.

    Raises
    ------
    MissingPackageError
        It is in none of them.
    """
    for folder in allowed.folders if is_name(name) else ():
        found = package_in(folder, name)
        if found is not None and allowed.has(found):
            return found
    raise MissingPackageError(name)


def missing_package(name: str, allowed: AllowedFiles) -> RobotError:
    """What is said of a package that a file may not read: where it is, if it is anywhere.

    A package that is nowhere may be the one that the file lies in (`unnamed_package`).
    """
    path = allowed.path
    there = search_package(name, path) or (unnamed_package(path) if is_name(name) else None)
    name = name[:_SHOWN]
    if there is not None:
        what = needed(f"the package '{name}'", there, path)
        return OutsideError(path.name, what, allowed.own)
    return RobotError(
        f"{path.name}: the package '{name}' was not found. Looked in "
        f"{', '.join(map(str, allowed.folders))}; above {path.parent}; and by "
        f"{variables_in_words()}. Name its folder under robot.package_dirs (init: --package-dirs)."
    )


def search_package(name: str, near: Path, inside: str = "") -> Path | None:
    """The nearest folder of the package `name` (with the file `inside`), if there is one.

    It is looked for in every folder above `near`, one folder below these, and in the folders that
    variables of ROS and Gazebo name. What belongs to another user is passed over: anybody may put
    a folder into /tmp.
    """
    for folder in folders_of_packages(near) if is_name(name) else ():
        named = [folder / name] if inside else []
        for found in (*named, package_in(folder, name)):
            if found is None or holds_everything(found) or not is_trusted(found, near):
                continue
            if not inside or is_file(found / inside):
                return found
    return None


def is_file(path: Path) -> bool:
    """Whether there is a file; names of robots' files may be too long, or have a NUL in them."""
    try:
        return path.is_file()
    except (OSError, ValueError, RuntimeError):
        return False


def package_in(folder: Path, name: str) -> Path | None:
    """The package `name` that a folder holds, or is; by the folder's name or its package.xml."""
    for candidate in (folder / name, folder):
        if _is_package(candidate, name):
            return candidate
    return next((inner for inner in _folders_in(folder) if _declared(inner) == name), None)


def unnamed_package(path: Path) -> Path | None:
    """The folder of the package that a file in `urdf` or the like lies in, if nothing names it."""
    if path.parent.name not in _OF_DESCRIPTIONS:
        return None
    folder = path.parent.parent
    return None if holds_everything(folder) or (folder / "package.xml").exists() else folder


def folders_of_packages(path: Path) -> Iterator[Path]:
    """Folders that may hold packages: those above a file, one below these, ROS's and Gazebo's."""
    for folder in path.parents:
        yield folder
        yield from _folders_in(folder)
    for variable, inner in _VARIABLES.items():
        for entry in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            yield Path(entry) / inner
            yield Path(entry).parent / inner


def variables_in_words() -> str:
    """The variables of the environment that name folders of packages, with their values."""
    return ", ".join(f"{name} ({os.environ.get(name) or 'not set'})" for name in _VARIABLES)


def _folders_in(folder: Path) -> list[Path]:
    if folder == folder.parent:
        return []
    try:
        return [inner for inner in sorted(folder.iterdir()) if inner.is_dir()]
    except OSError:
        return []


def _is_package(folder: Path, name: str) -> bool:
    if not folder.is_dir():
        return False
    declared = _declared(folder)
    return declared == name or (declared is None and folder.name == name)


def _declared(folder: Path) -> str | None:
    """The name in a folder's package.xml, if it has one that can be read."""
    file = folder / "package.xml"
    try:
        if not file.is_file() or file.stat().st_size > 1_000_000:
            return None
        text = file.read_text(encoding="utf-8")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            return None
        return (ElementTree.fromstring(text).findtext("name") or "").strip() or None
    except (OSError, UnicodeDecodeError, ElementTree.ParseError):
        return None
