"""Where the meshes of a URDF on disk lie: folders to give as `robot.package_dirs`.

A `package://NAME/…` is looked for in every folder above the URDF, one folder below each of these,
and in the folders that ROS_PACKAGE_PATH and AMENT_PREFIX_PATH name. A relative path that leaves the
URDF's own folder (`../meshes/arm.stl`) needs the folder that holds it.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from excite_cli.robot.description import RobotDescription, mesh_file
from excite_cli.robot.packages import folders_of_packages

_PREFIX = "package://"


def package_folders(description: RobotDescription) -> dict[str, Path]:
    """Folders beyond those of `description` that its collision meshes need, by what they hold.

    What is found nowhere is left out: the check of the meshes says so.
    """
    known = [Path(folder).resolve() for folder in description.package_dirs]
    found: dict[str, Path] = {}
    for mesh in ElementTree.fromstring(description.xml).findall("link/collision/geometry/mesh"):
        name = mesh.get("filename", "")
        if not name.startswith(_PREFIX):
            path = mesh_file(description.path.parent / name.removeprefix("file://"))
            if path is not None and not any(path.is_relative_to(folder) for folder in known):
                found.setdefault(str(Path(name).parent), path.parent)
            continue
        inside = name.removeprefix(_PREFIX)
        package = inside.split("/")[0]
        if package in found or any(mesh_file(folder / inside) for folder in known):
            continue
        for folder in folders_of_packages(description.path):
            if mesh_file(folder / inside):
                found[package] = folder
                break
    return found
