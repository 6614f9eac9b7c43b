"""Where packages of ROS lie, without ROS: by folder names, by package.xml, by its variables."""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from pathlib import Path

from excite_cli.errors import RobotError

# Folders of a package in which descriptions lie.
_OF_DESCRIPTIONS = ("urdf", "xacro", "robots", "robot", "models", "model")
# By variable: what lies between a folder that it names and the packages.
_VARIABLES = {
    "ROS_PACKAGE_PATH": "",
    "AMENT_PREFIX_PATH": "share",
    "GAZEBO_MODEL_PATH": "",
    "GZ_SIM_RESOURCE_PATH": "",
}


def find_package(name: str, near: Path, package_dirs: Iterable[str] = ()) -> Path:
    """Folder of the package `name`, for a file `near` it.

    `package_dirs` (which hold packages, or are one) come before `package_folders_of(near)`.

    Raises
    ------
    RobotError
        There is none.
    """
    dirs = tuple(map(Path, package_dirs))
    for folder in (*dirs, *folders_of_packages(near)):
        found = package_in(folder, name)
        if found is not None:
            return found
    given = ", ".join(map(str, dirs)) or "none given"
    raise RobotError(
        f"the package '{name}' was not found. Looked in package_dirs ({given}), above "
        f"{near.parent}, and by {variables_in_words()}"
    )


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
    return None if (folder / "package.xml").exists() else folder


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
