"""Robots by a name of the package robot_descriptions: `robot_descriptions:ur10e_description`.

That package knows where descriptions lie on the net, and fetches a robot's repository with git when
its module is first imported. The import is done in a process of its own: it is other people's code,
and may take minutes.
"""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from excite_cli.errors import MissingExtraError, RobotError, nearest
from excite_cli.robot.confinement import command, environment

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
