"""What simulators take in a URDF and its standard does not have, put into the standard's words.

PyBullet and Drake know <capsule>, PyBullet joints of type `spherical`. The library that builds
models would refuse the whole robot for one of them.
"""

import xml.etree.ElementTree as ElementTree

from excite_cli.robot.formats.urdf_parts import add_shape, capsule, origin_of

_BALLS = ("spherical", "ball")


def put_into_standard(root: ElementTree.Element) -> tuple[str, ...]:
    """Change a URDF's tree so that it is one of the standard; what that costs, in words.

    A capsule becomes a cylinder and two balls; a ball joint stays where it is.
    """
    for link in root.findall("link"):
        for kind in ("collision", "visual"):
            for item in link.findall(kind):
                _without_capsule(link, item)
    still = [joint for joint in root.findall("joint") if joint.get("type") in _BALLS]
    for joint in still:
        joint.set("type", "fixed")
    names = ", ".join(joint.get("name", "") for joint in still)
    return (f"ball joints stay where they are: {names}",) if still else ()


def _without_capsule(link: ElementTree.Element, item: ElementTree.Element) -> None:
    found = item.find("geometry/capsule")
    if found is None:
        return
    radius, length = (float(found.get(key, "0")) for key in ("radius", "length"))
    place = origin_of(item)
    for height, shape in capsule(radius, length):
        shift = place.translation + height * place.rotation[:, 2]
        add_shape(link, item.tag, shift, place.rotation, shape)
    link.remove(item)
