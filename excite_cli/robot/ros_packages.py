"""Where packages of ROS and of robot_descriptions lie, without ROS."""

import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from excite_cli.errors import MissingExtraError, RobotError, nearest
from excite_cli.robot.allowed_files import (
    AllowedFiles,
    OutsideError,
    holds_everything,
    is_trusted,
    needed,
)
from excite_cli.robot.confinement import command, environment

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


# Robots by a name of the package robot_descriptions: `robot_descriptions:ur10e_description`.
#
# That package knows where descriptions lie on the net, and fetches a robot's repository with git
# when its module is first imported. The import is done in a process of its own: it is other
# people's code, and may take minutes.

PREFIX = "robot_descriptions:"
_PACKAGE = "robot_descriptions"
_SUFFIXES = ("_description", "_mj_description")
_SECONDS = 600.0  # for a repository to be fetched
_FILES = ("URDF_PATH", "XACRO_PATH", "MJCF_PATH")
_FOLDERS = ("PACKAGE_PATH", "REPOSITORY_PATH")


@dataclass(frozen=True)
class Found:
    """A description's file, folders of its packages, and arguments of xacro."""

    path: Path
    package_dirs: tuple[str, ...] = ()
    arguments: dict[str, object] = field(default_factory=dict)


@cache
def find_description(source: str) -> Found:
    """The description that `robot_descriptions:NAME` means; NAME may lack its suffix.

    Raises
    ------
    RobotError
        There is no such name; its repository cannot be fetched; it has no file that is read.
    MissingExtraError
        The package is not installed.
    """
    module = _module(source.removeprefix(PREFIX))
    run = _imported(module)
    answer = json.loads(run) if run else {}
    if "error" in answer or not answer:
        reason = answer.get("error", "it ended, or took too long")
        raise RobotError(
            f"{source}: its repository could not be fetched ({reason}). robot_descriptions clones "
            "it with git when it is first used: run this once with a network, name the folder that "
            "holds it in ROBOT_DESCRIPTIONS_CACHE, or give a file of the robot (init: --urdf)."
        )
    path = next((Path(answer[name]) for name in _FILES if name in answer), None)
    if path is None or not path.is_file():
        there = "no file of a robot" if path is None else f"no file {path}"
        raise RobotError(f"{source}: its repository was fetched, but {there} is in it.")
    folders = [Path(answer[name]) for name in _FOLDERS if name in answer]
    dirs = dict.fromkeys(str(each) for folder in folders for each in (folder.parent, folder))
    return Found(path, tuple(dirs), answer.get("XACRO_ARGS", {}))


def _module(name: str) -> str:
    """The name of a module of the package, which is not imported for it."""
    spec = find_spec(_PACKAGE)
    if spec is None or not spec.submodule_search_locations:
        raise MissingExtraError(
            f"{PREFIX}{name} needs the package robot_descriptions of PyPI, which is not installed. "
            "Install it with pip, or give a file of the robot (init: --urdf)."
        )
    folder = Path(next(iter(spec.submodule_search_locations)))
    known = sorted(
        path.stem for path in folder.glob("*_description.py") if not path.stem.startswith("_")
    )
    for candidate in (name, *(f"{name}{suffix}" for suffix in _SUFFIXES)):
        if candidate in known:
            return candidate
    raise RobotError(
        f"robot.urdf: robot_descriptions has no robot '{name}'.{nearest(name, known)} "
        f"`python -m robot_descriptions list` lists all {len(known)}."
    )


def _imported(module: str) -> bytes:
    """What a process of its own says about a module; nothing if it failed."""
    try:
        run = subprocess.run(
            command(__name__),
            input=f"{_PACKAGE}.{module}".encode(),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**environment(), "GIT_TERMINAL_PROMPT": "0"},
            timeout=_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return b""
    return run.stdout


def serve() -> None:
    """In the process: the answer on stdout to a module's name on stdin."""
    name = sys.stdin.read()
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what git and others print
    answer: dict[str, Any]
    try:
        module = import_module(name)
        wanted = (*_FILES, *_FOLDERS, "XACRO_ARGS")
        answer = {key: getattr(module, key) for key in wanted if hasattr(module, key)}
    except Exception as error:  # of git, of the net, of a disk
        answer = {"error": " ".join(str(error).split())[-200:] or type(error).__name__}
    out.write(json.dumps(answer, default=str))
    out.close()
