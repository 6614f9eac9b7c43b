"""From a robot's name or file to checked XML.

`RobotDescription` proves that the file exists, is XML without a document type (no entity tricks),
and is one tree of links and joints of a sane size (`urdf_check`). It names the folders from which
files may be read (`allowed_files`): its own, those of `package_dirs`, and for a robot of
example-robot-data that package.
Continuous joints become revolute ones without bounds, so that one coordinate is one velocity, and
right angles that were rounded become exact.
"""

import hashlib
import math
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

from excite_cli.errors import RobotError, nearest
from excite_cli.given_files import require_stored
from excite_cli.robot.allowed_files import own_folder
from excite_cli.robot.formats.base import ConversionRequest, add_shape, capsule, origin_of
from excite_cli.robot.formats.catalogue import as_urdf
from excite_cli.robot.limits import UNBOUNDED, ordered_limits
from excite_cli.robot.loops import Loop, Mimic, closed_loops, loops_in_words, lost, mimics
from excite_cli.robot.ros_packages import PREFIX, Found, find_description
from excite_cli.robot.urdf_check import parsed, xml_text

# What simulators take in a URDF and its standard does not have, put into the standard's words.
#
# PyBullet and Drake know <capsule>, PyBullet joints of type `spherical`. The library that builds
# models would refuse the whole robot for one of them.

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


EXAMPLE_PREFIX = "example-robot-data:"
# How far [rad] an angle is off a right one that was meant, and from where on that matters.
_ROUNDED, _EXACT = 1e-4, 1e-8

# The file meant by a short name where the package holds several of the same robot.
_PREFERRED = {
    "talos": "talos_data/robots/talos_reduced.urdf",
    "talos_full": "talos_data/robots/talos_full_v2.urdf",
    "ur3": "ur_description/urdf/ur3_robot.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "ur10": "ur_description/urdf/ur10_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "anymal_c": "anymal_c_simple_description/urdf/anymal.urdf",
    "g1": "g1_description/urdf/g1_29dof_rev_1_0.urdf",
    "hyq": "hyq_description/robots/hyq_no_sensors.urdf",
    "tiago": "tiago_description/robots/tiago.urdf",
    "icub": "icub_description/robots/icub.urdf",
    "romeo": "romeo_description/urdf/romeo.urdf",
}


@dataclass(frozen=True)
class RobotDescription:
    """A URDF as text, where it came from, and where its packages lie.

    `xml` is what is used of `urdf`, the text as given or as it was made of another format, which
    may have left out what is told in `notes`. `mimicking` names the joints that follow another
    one, with what they follow; `loops` are closed ones, which are cut; `ignored` are pairs of links
    whose contact the file itself rules out. `reversed_limits` says of joints that theirs were.
    """

    name: str
    source: str
    path: Path
    xml: str
    package_dirs: tuple[str, ...]
    sha256: str
    mimicking: dict[str, Mimic]
    urdf: str
    notes: tuple[str, ...] = ()
    loops: tuple[Loop, ...] = ()
    ignored: tuple[tuple[str, str], ...] = ()
    reversed_limits: Mapping[str, str] = field(default_factory=dict)


def example_robots_folder() -> Path:
    """Folder of the robots of the example-robot-data package, as pip or as conda installs it.

    Raises
    ------
    RobotError
        The package is not installed or is laid out differently.
    """
    share = Path("share/example-robot-data/robots")
    folders = [Path(sys.prefix) / share]
    with suppress(metadata.PackageNotFoundError):
        distribution = metadata.distribution("example-robot-data")
        folders.insert(0, Path(str(distribution.locate_file("cmeel.prefix"))) / share)
    for folder in folders:
        if folder.is_dir():
            return folder
    tried = " or ".join(map(str, folders))
    raise RobotError(
        f"The robots of the package example-robot-data are not in {tried}. "
        "Run: pip install example-robot-data (with conda: conda install example-robot-data)"
    )


def example_robots() -> dict[str, Path]:
    """Short names of all robots of example-robot-data with the URDF each stands for."""
    folder = example_robots_folder()
    names = {path.stem: path for path in sorted(folder.glob("*/*/*.urdf"))}
    names.update({name: folder / relative for name, relative in _PREFERRED.items()})
    return {name: path for name, path in sorted(names.items()) if path.is_file()}


def load_description(
    urdf: str,
    package_dirs: tuple[str, ...] = (),
    relative_to: Path | None = None,
    arguments: Mapping[str, object] | None = None,
) -> RobotDescription:
    """Read and check a URDF, xacro, MJCF or SDF, given by path or by a package's name for it.

    Parameters
    ----------
    urdf: path (relative to `relative_to`), `example-robot-data:<name>` or
        `robot_descriptions:<name>`
    package_dirs: folders that hold the packages named by `package://`
    relative_to: folder that relative paths start from; default the working directory
    arguments: of xacro

    Raises
    ------
    RobotError
        Unknown name, missing or unreadable file, not a robot, or larger than 20 MB.
    MissingExtraError
        The library that reads its format is not installed.
    FileError
        It is a named pipe, a socket or a device.
    """
    root = relative_to or Path.cwd()
    extra = tuple(str((root / folder).resolve()) for folder in package_dirs)
    for given, folder in zip(package_dirs, extra, strict=True):
        if not Path(folder).is_dir():
            raise RobotError(f"robot.package_dirs: there is no folder {given} ({folder}).")
    file = _file(urdf, root)
    path, dirs = file.path, (*extra, *file.package_dirs)
    text = xml_text(path, "a URDF").rstrip("\0 \t\r\n")  # some files end so
    found = as_urdf(path, text, ConversionRequest(dirs, {**file.arguments, **(arguments or {})}))
    tree = parsed(path, found.text)
    strange, swapped = put_into_standard(tree), ordered_limits(path, tree)
    followers, loops = mimics(path, tree), closed_loops(tree)
    packages = (*dirs, str(own_folder(path)), str(path.parent), *found.folders)
    return RobotDescription(
        name=path.stem.removesuffix(".urdf"),
        source=urdf,
        path=path,
        xml=_without_continuous_joints(tree),
        package_dirs=tuple(dict.fromkeys(packages)),
        sha256=hashlib.sha256(found.text.encode()).hexdigest(),
        mimicking=followers,
        urdf=found.text,
        notes=(
            *found.notes,
            *strange,
            *swapped.values(),
            *lost(followers, tree),
            *loops_in_words(loops),
        ),
        loops=loops,
        ignored=found.ignored,
        reversed_limits=swapped,
    )


def is_named(urdf: str) -> bool:
    """Whether a robot is given by the name that a package has for it, not by a file."""
    return urdf.startswith((EXAMPLE_PREFIX, PREFIX))


def _file(urdf: str, root: Path) -> Found:
    """The file that `robot.urdf` means; relative paths start from `root`."""
    if urdf.startswith(PREFIX):
        return find_description(urdf)
    if urdf.startswith(EXAMPLE_PREFIX):
        known = example_robots()
        name = urdf.removeprefix(EXAMPLE_PREFIX)
        if name not in known:
            raise RobotError(
                f"robot.urdf: example-robot-data has no robot '{name}'."
                f"{nearest(name, known)} `excite robots` lists all {len(known)}."
            )
        return Found(known[name], (str(example_robots_folder().parent),))
    path = (root / urdf).resolve()
    if path.exists():
        require_stored(path)
    if not path.is_file():
        offered = [f"{EXAMPLE_PREFIX}{name}" for name in example_robots()]
        meant = "" if "/" in urdf else nearest(f"{EXAMPLE_PREFIX}{urdf}", offered, 0.93)
        raise RobotError(
            f"robot.urdf: there is no file {path}.{meant} Give the path of a file (in a config "
            f"relative to it), {EXAMPLE_PREFIX}<name> or {PREFIX}<name>."
        )
    return Found(path)


def require_limits(description: RobotDescription) -> None:
    """See that every joint that moves within limits has them.

    Raises
    ------
    RobotError
        A revolute or prismatic joint has no <limit>.
    """
    for joint in ElementTree.fromstring(description.xml).findall("joint"):
        if joint.get("type") in ("revolute", "prismatic") and joint.find("limit") is None:
            raise RobotError(
                f"{description.path}: joint '{joint.get('name')}' is {joint.get('type')} and has "
                'no <limit>, which a URDF must give: <limit lower="…" upper="…" velocity="…" '
                'effort="…"/>. A joint that turns without end is of type continuous.'
            )


def _square(root: ElementTree.Element) -> None:
    """Right angles of joints' frames that were rounded (1.5708) become exact.

    Tilted by some 4e-6 rad, an upright axis shows parameters through gravity that nobody can
    measure, and condition numbers of a million come of them.
    """
    for origin in root.findall("joint/origin"):
        words = origin.get("rpy", "").split()
        try:
            angles = [float(word) for word in words]
        except ValueError:
            continue
        if not words:
            continue
        exact = [round(angle / (math.pi / 2)) * (math.pi / 2) for angle in angles]
        origin.set(
            "rpy",
            " ".join(
                repr(right) if _EXACT < abs(angle - right) < _ROUNDED else word
                for word, angle, right in zip(words, angles, exact, strict=True)
            ),
        )


def _without_continuous_joints(root: ElementTree.Element) -> str:
    _square(root)
    for joint in root.findall("joint"):
        if joint.get("type") != "continuous":
            continue
        joint.set("type", "revolute")
        limit = joint.find("limit")
        if limit is None:
            limit = ElementTree.SubElement(joint, "limit", {"effort": "0", "velocity": "0"})
        limit.set("lower", str(-UNBOUNDED))
        limit.set("upper", str(UNBOUNDED))
    return ElementTree.tostring(root, encoding="unicode")
