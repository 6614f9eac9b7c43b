"""Where packages of ROS lie, without ROS: by folder names, by package.xml, by its variables."""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from pathlib import Path

from excite_cli.errors import RobotError


def find_package(name: str, near: Path, package_dirs: Iterable[str] = ()) -> Path:
    """Folder of the package `name`, for a file `near` it.

    `package_dirs` (which hold packages, or are one) come before `package_folders_of(near)`.

    Raises
    ------
    RobotError
        There is none.
    """
    for folder in (*map(Path, package_dirs), *folders_of_packages(near)):
        for candidate in (folder / name, folder):
            if _is_package(candidate, name):
                return candidate
        for inner in _folders_in(folder):
            if _declared(inner) == name:
                return inner
    raise RobotError(
        f"the package '{name}' was not found above {near.parent}, nor by ROS_PACKAGE_PATH or "
        "AMENT_PREFIX_PATH"
    )


def folders_of_packages(path: Path) -> Iterator[Path]:
    """Folders that may hold packages: those above a file, one below these, and ROS's own."""
    for folder in path.parents:
        yield folder
        yield from _folders_in(folder)
    for variable, inner in (("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "share")):
        for entry in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            yield Path(entry) / inner
            yield Path(entry).parent / inner


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
