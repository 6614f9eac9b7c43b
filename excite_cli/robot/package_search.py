"""Where the meshes of a URDF on disk lie: folders to give as `robot.package_dirs`.

A package is looked for in every folder above the URDF, one folder below each of these, and in the
folders that the variables of ROS and Gazebo name. A path that leaves the URDF's own folder
(`../meshes/arm.stl`) needs the folder that holds it; one that is relative to a folder above the
URDF (`meshes/arm.stl` beside `urdf/`) needs that folder.
"""

from pathlib import Path

from excite_cli.robot.description import RobotDescription
from excite_cli.robot.mesh_paths import Kind, MeshFiles, mesh_file, mesh_names, package_of
from excite_cli.robot.packages import folders_of_packages, package_in

_ABOVE = 4  # folders above the URDF that relative paths may start from


def package_folders(description: RobotDescription) -> dict[str, Path]:
    """Folders beyond those of `description` that its meshes need, by what they hold.

    What is found nowhere is left out: the check of the meshes says so.
    """
    files = MeshFiles(description)
    found: dict[str, Path] = {}
    kinds: tuple[Kind, ...] = ("collision", "visual")
    for name in dict.fromkeys(name for kind in kinds for _, name in mesh_names(description, kind)):
        package, inside = package_of(name)
        if (package or name) in found:
            continue
        path = files.found(name)
        if path is None:
            folder = (
                _of_package(package, inside, description.path)
                if package
                else _above(name, description.path)
            )
            if folder is not None:
                found[package or str(Path(name).parent)] = folder
        elif not package and not files.may_read(path):
            found.setdefault(str(Path(name).parent), path.parent)
    return found


def _of_package(package: str, inside: str, urdf: Path) -> Path | None:
    """The nearest folder that holds a package with the file `inside`."""
    for folder in folders_of_packages(urdf):
        if mesh_file(folder / package / inside):
            return folder
        there = package_in(folder, package)
        if there is not None and mesh_file(there / inside):
            return there
    return None


def _above(name: str, urdf: Path) -> Path | None:
    """The nearest folder above a URDF from which a relative path leads to a file."""
    inside = name.removeprefix("file://")
    above = urdf.parents[1 : 1 + _ABOVE]
    return next((folder for folder in above if mesh_file(folder / inside)), None)
