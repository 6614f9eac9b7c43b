"""A base that moves, as six joints: how data with a wrench at the base see a floating robot.

Three slides along the axes of the base at its reference, then yaw, pitch and roll (z, y, x), carry
the robot's root. Their torques are the wrench that holds the base, as generalised forces, so that
whatever is said of joints (filters, noise, errors, effects) is said of the base-link equations
(Ayusawa, Venture, Nakamura 2014) as well. The five links between them have no mass.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

from excite_cli.errors import RobotError
from excite_cli.robot.description import RobotDescription

BASE_JOINTS = ("base_x", "base_y", "base_z", "base_yaw", "base_pitch", "base_roll")
# Rows of a base that is held still that are theirs.
BASE_ROWS = ("base_fx", "base_fy", "base_fz", "base_mz", "base_my", "base_mx")
_AXES = ("1 0 0", "0 1 0", "0 0 1", "0 0 1", "0 1 0", "1 0 0")
_WORLD = "base_stands_on"
_FAR = "1e9"  # counts as no limit


def on_base_joints(description: RobotDescription) -> RobotDescription:
    """The same robot carried by `BASE_JOINTS`, fixed to the world below them.

    Raises
    ------
    RobotError
        It has a link or joint of such a name.
    """
    tree = ElementTree.fromstring(description.xml)
    links = {str(link.get("name")) for link in tree.findall("link")}
    joints = {str(joint.get("name")) for joint in tree.findall("joint")}
    carriages = [_WORLD, *(f"{name}_carriage" for name in BASE_JOINTS[:-1])]
    taken = sorted((links & set(carriages)) | (joints & set(BASE_JOINTS)))
    if taken:
        raise RobotError(
            f"{description.path}: the base is given joints of the names {', '.join(BASE_JOINTS)}, "
            f"and the robot has {', '.join(taken)} already. Rename that in the file."
        )
    carried = {str(child.get("link")) for child in tree.findall("joint/child")}
    (root,) = links - carried
    for link in carriages:
        ElementTree.SubElement(tree, "link", name=link)
    below = zip(BASE_JOINTS, _AXES, carriages, [*carriages[1:], root], strict=True)
    for k, (name, axis, parent, child) in enumerate(below):
        joint = ElementTree.SubElement(
            tree, "joint", name=name, type="prismatic" if k < 3 else "revolute"
        )
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        ElementTree.SubElement(joint, "axis", xyz=axis)
        ElementTree.SubElement(
            joint, "limit", lower=f"-{_FAR}", upper=_FAR, velocity=_FAR, effort=_FAR
        )
    return replace(description, xml=ElementTree.tostring(tree, encoding="unicode"))
