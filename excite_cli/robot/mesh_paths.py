"""The mesh files that a URDF names: where they lie, and whether they may and can be read.

Names are read as ROS, Gazebo and their users write them: `package://NAME/…` and `model://NAME/…`
(the package by its folder's name or by its package.xml), the same with a third slash and the
package after it, `file://…`, and plain paths, relative to the URDF or to one of its folders. What
is read must lie in one of these folders, by whatever links it is reached.
"""

import contextlib
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal
from urllib.parse import unquote

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import (
    FolderRequest,
    OutsideError,
    holds_everything,
    is_trusted,
    needed,
    own_folder,
)
from excite_cli.robot.description import EXAMPLE_PREFIX, RobotDescription, load_description
from excite_cli.robot.mesh_trial import MAX_BYTES, copy_of, faults
from excite_cli.robot.ros_packages import package_in, search_package, variables_in_words
from excite_cli.shown.note import never

Kind = Literal["collision", "visual"]

_OF_PACKAGES = ("package://", "model://")
# What other files a mesh names, by its suffix.
_NAMED = {
    ".obj": re.compile(rb"^\s*mtllib[ \t]+([^\r\n]+)", re.MULTILINE),
    ".gltf": re.compile(rb'"uri"\s*:\s*"([^"]*)"'),
}
_LONGEST = 200  # characters of a name that are told


class MeshFiles:
    """Finds the files of one description's meshes; packages are looked for once."""

    def __init__(self, description: RobotDescription) -> None:
        self._near = description.path.parent
        self.folders = [Path(folder).resolve() for folder in description.package_dirs]
        self._packages: dict[str, list[Path]] = {}

    def found(self, name: str) -> Path | None:
        """The file that a mesh's name means, by whatever links; None where there is none."""
        return next(filter(None, map(mesh_file, self._places(name))), None)

    def may_read(self, path: Path) -> bool:
        """Whether a file lies in a folder that the robot may read."""
        return any(path.is_relative_to(folder) for folder in self.folders)

    def _places(self, name: str) -> Iterator[Path]:
        for spelling in dict.fromkeys((name, unquote(name), name.replace("\\", "/"))):
            package, inside = package_of(spelling)
            if package:
                yield from (folder / package / inside for folder in self.folders)
                yield from (each / inside for each in self.folders if each.name == package)
                yield from (folder / inside for folder in self._folders_of(package))
            else:
                yield from (folder / inside for folder in (self._near, *self.folders))

    def _folders_of(self, package: str) -> list[Path]:
        if package not in self._packages:
            found = (package_in(folder, package) for folder in self.folders)
            self._packages[package] = [folder for folder in found if folder is not None]
        return self._packages[package]


def package_of(name: str) -> tuple[str, str]:
    """The package that a mesh's name begins with ("": none), and the path after it."""
    for prefix in _OF_PACKAGES:
        if name.startswith(prefix):
            package, _, inside = name.removeprefix(prefix).lstrip("/").partition("/")
            return package, inside
    return "", name.removeprefix("file://")


def mesh_file(path: Path) -> Path | None:
    """The file that `path` leads to, by whatever links; None where there is none.

    Names from a URDF may be anything: too long, with a NUL in them, or links in a circle.
    """
    try:
        return path.resolve() if path.is_file() else None
    except (OSError, ValueError, RuntimeError):
        return None


def mesh_names(description: RobotDescription, kind: Kind) -> Iterator[tuple[str, str]]:
    """Link and name of every mesh of the kind."""
    for link in ElementTree.fromstring(description.xml).findall("link"):
        for mesh in link.findall(f"{kind}/geometry/mesh"):
            yield link.get("name", ""), mesh.get("filename", "")


def check_mesh_paths(description: RobotDescription, kind: Kind = "collision") -> None:
    """Raise unless every mesh of the kind is in a folder that the URDF may read, and can be read.

    Raises
    ------
    RobotError
        A mesh is missing, its path leaves the URDF's folder and packages, or it is damaged.
    """
    for link, wrong in unusable(description, kind).items():
        left_out = (
            f", or list {link} under constraints.self_collision.without_shapes: collisions of "
            "this link are then not checked"
        )
        advice = left_out if kind == "collision" else ""
        raise RobotError(f"{description.path.name}: {wrong.words}{advice}.")


@dataclass(frozen=True)
class Unusable:
    """Why a link's mesh cannot be used, without a full stop; `cause`: the package or folder."""

    words: str
    cause: str = ""


def unusable(description: RobotDescription, kind: Kind) -> dict[str, Unusable]:
    """Links with a mesh that is missing, or must not or cannot be read, in the URDF's order.

    Those of example-robot-data are known to be sound.
    """
    files = MeshFiles(description)
    wrong: dict[str, Unusable] = {}
    named: dict[Path, list[str]] = {}
    for link, name in mesh_names(description, kind):
        path = files.found(name)
        if path is None:
            wrong.setdefault(link, _missing(description, kind, name, files))
        elif not files.may_read(path):
            leaves = (
                f"the mesh path '{name[:_LONGEST]}' leaves the robot's own folders. If that is "
                "meant, add its folder to robot.package_dirs"
            )
            wrong.setdefault(link, Unusable(leaves))
        elif outer := next((each for each in _named_by(path) if not _is_own(files, each)), None):
            where = (
                "no regular file" if files.may_read(outer) else "outside the robot's own folders"
            )
            wrong.setdefault(link, Unusable(f"the mesh {path} names {outer}, {where}"))
        else:
            named.setdefault(path, []).append(link)
    if not description.source.startswith(EXAMPLE_PREFIX):
        for path, fault in faults(list(named), files.folders, kind != "collision").items():
            for link in named[path]:
                wrong.setdefault(link, Unusable(fault))
    return wrong


def _is_own(files: MeshFiles, path: Path) -> bool:
    return files.may_read(path) and not (path.exists() and not path.is_file())


def _named_by(mesh: Path) -> Iterator[Path]:
    """Files that a mesh names in its turn: buffers of glTF, materials of OBJ; resolved.

    For a message: what keeps them from being read is the confinement of the process that reads.
    """
    if mesh.stat().st_size > MAX_BYTES:
        return  # refused
    pattern = _NAMED.get(mesh.suffix.lower())
    for found in () if pattern is None else pattern.findall(mesh.read_bytes()):
        name = found.decode(errors="replace").strip()
        for meant in () if name.startswith("data:") else (name, unquote(name)):
            with contextlib.suppress(OSError, ValueError, RuntimeError):
                if (mesh.parent / meant).exists():
                    yield (mesh.parent / meant).resolve()


def _missing(description: RobotDescription, kind: Kind, name: str, files: MeshFiles) -> Unusable:
    package, _ = package_of(name)
    short, told = name[:_LONGEST], package[:_LONGEST]
    looked = f"Looked in {', '.join(str(folder) for folder in files.folders)}"
    if not package:
        return Unusable(
            f"the {kind} mesh '{short}' was not found. {looked}. Add the folder that it is "
            "relative to to robot.package_dirs (init: --package-dirs)",
            str(Path(name).parent),
        )
    there = any(package_in(folder, package) for folder in files.folders)
    what = (
        f"the {kind} mesh '{short}' was not found in the package '{told}'"
        if there
        else f"the package '{told}' of the {kind} mesh '{short}' was not found"
    )
    words = (
        f"{what}. {looked}; `excite init` looks above {description.path.parent} and by "
        f"{variables_in_words()} as well. Add the folder that holds the package to "
        "robot.package_dirs (init: --package-dirs)"
    )
    return Unusable(words, package)


def without_unusable(description: RobotDescription, links: tuple[str, ...]) -> RobotDescription:
    """The description without shapes of those of `links` whose meshes cannot be used.

    Where one shape of a link is missing none of its kind is left: what is half guarded would pass
    for guarded.
    """
    if not links:
        return description
    root = ElementTree.fromstring(description.xml)
    kinds: tuple[Kind, ...] = ("collision", "visual")
    for kind in kinds:
        lacking = unusable(description, kind)
        for link in root.findall("link"):
            if link.get("name") in lacking and link.get("name") in links:
                for shape in link.findall(kind):
                    link.remove(shape)
    return replace(description, xml=ElementTree.tostring(root, encoding="unicode"))


def located(description: RobotDescription, kind: Kind) -> str:
    """The URDF's XML with every mesh of the kind by the path of its copy, once it was checked.

    Those of example-robot-data by their own.
    """
    known = description.source.startswith(EXAMPLE_PREFIX)
    root = ElementTree.fromstring(description.xml)
    files = MeshFiles(description)
    for mesh in root.findall(f"link/{kind}/geometry/mesh"):
        path = files.found(mesh.get("filename", ""))
        if path is not None:
            mesh.set("filename", str(path if known else copy_of(path)))
    return ElementTree.tostring(root, encoding="unicode")


# Where the meshes of a URDF on disk lie: folders to allow under `robot.package_dirs`.
#
# A package is looked for as `search_package` does. A path that leaves the URDF's own folder
# (`../meshes/arm.stl`) needs the folder that holds it; one that is relative to a folder above the
# URDF (`meshes/arm.stl` beside `urdf/`) needs that folder.

_ABOVE = 4  # folders above the URDF that relative paths may start from

Allow = Callable[[FolderRequest], bool]


def load_with_folders(
    urdf: str,
    package_dirs: tuple[str, ...],
    relative_to: Path,
    arguments: Mapping[str, object] | None = None,
    allow: Allow = never,
) -> tuple[RobotDescription, tuple[FolderRequest, ...]]:
    """The description, as `load_description`, and what had to be allowed for it.

    allow: whether a folder outside the robot's own may be read; asked once for each.

    Raises
    ------
    OutsideError
        One may not.
    RobotError, MissingExtraError, FileError
        As `load_description`.
    """
    allowed: dict[Path, FolderRequest] = {}
    while True:
        dirs = (*package_dirs, *map(str, allowed))
        try:
            description = load_description(urdf, dirs, relative_to, arguments)
            more = needed_folders(description)
        except OutsideError as error:
            source, own, more = error.source, error.own, [error.needed]
        else:
            source, own = description.path.name, own_folder(description.path)
            if not more:
                return description, tuple(allowed.values())
        for each in more:
            if each.folder in allowed or not allow(each):
                raise OutsideError(source, each, own)
            allowed[each.folder] = each


def needed_folders(description: RobotDescription) -> list[FolderRequest]:
    """Folders beyond those of `description` that its meshes are in, and what they hold.

    What is found nowhere is left out: the check of the meshes says so.
    """
    files = MeshFiles(description)
    found: dict[Path, FolderRequest] = {}
    kinds: tuple[Kind, ...] = ("collision", "visual")
    for name in dict.fromkeys(name for kind in kinds for _, name in mesh_names(description, kind)):
        package, inside = package_of(name)
        path = files.found(name)
        what = f"meshes ({Path(name).name}, …)"
        if path is not None and files.may_read(path):
            continue
        if path is not None:
            folder: Path | None = path.parent
        elif package:
            folder = search_package(package, description.path, inside)
            what = f"the package '{package}'"
        else:
            folder = _above(name, description.path)
        if folder is not None:
            found.setdefault(folder, needed(what, folder, description.path))
    return list(found.values())


def _above(name: str, urdf: Path) -> Path | None:
    """The nearest folder above a URDF from which a relative path leads to a file."""
    inside = name.removeprefix("file://")
    above = urdf.parents[1 : 1 + _ABOVE]
    return next(
        (
            each
            for each in above
            if not holds_everything(each)
            and mesh_file(each / inside)
            and is_trusted(each / inside, urdf)
        ),
        None,
    )
