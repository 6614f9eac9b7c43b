"""Where the meshes of a URDF on disk lie: folders to allow under `robot.package_dirs`.

A package is looked for as `search_package` does. A path that leaves the URDF's own folder
(`../meshes/arm.stl`) needs the folder that holds it; one that is relative to a folder above the
URDF (`meshes/arm.stl` beside `urdf/`) needs that folder.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from excite_cli.robot.allowed_files import (
    FolderRequest,
    OutsideError,
    holds_everything,
    is_trusted,
    needed,
    own_folder,
)
from excite_cli.robot.description import RobotDescription, load_description
from excite_cli.robot.mesh_paths import Kind, MeshFiles, mesh_file, mesh_names, package_of
from excite_cli.robot.ros_packages import search_package

_ABOVE = 4  # folders above the URDF that relative paths may start from

Allow = Callable[[FolderRequest], bool]


def allow_nothing(needed: FolderRequest) -> bool:
    """The answer of one who was not asked."""
    return False


def load_with_folders(
    urdf: str,
    package_dirs: tuple[str, ...],
    relative_to: Path,
    arguments: Mapping[str, object] | None = None,
    allow: Allow = allow_nothing,
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
