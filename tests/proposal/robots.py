"""Small robots as URDF text: what a proposal must cope with."""

from pathlib import Path

from excite_cli.robot.description import load_description
from excite_cli.robot.urdf_joints import UrdfSurvey, survey
from tests import urdf_elements

BOX = urdf_elements.box("0.05 0.05 0.16", "0 0 0.12")


def link(name: str, mass: float = 1.0, shape: str = BOX) -> str:
    """With a negative mass without inertial properties."""
    if mass < 0:
        return f'<link name="{name}">{shape}</link>'
    return urdf_elements.link(name, mass, "0.01 0.01 0.01", "0 0 0.1", shape)


def joint(
    name: str, parent: str, child: str, limit: str = "", kind: str = "revolute", more: str = ""
) -> str:
    axis = "0 0 1" if kind == "continuous" else "0 1 0"
    return urdf_elements.joint(
        name, (parent, child), "0 0 0.25", axis, limits=limit, kind=kind, more=more
    )


GOOD = urdf_elements.LIMITS


def arm(folder: Path, first: str = GOOD, second: str = GOOD, mass: float = 1.0) -> Path:
    """Two links on a base, with the limits given for its two joints."""
    links = {name: link(name, mass) for name in ("base", "upper", "lower")}
    limits = {
        "shoulder": joint("shoulder", "base", "upper", first),
        "elbow": joint("elbow", "upper", "lower", second),
    }
    return serial(folder, "base shoulder upper elbow lower", **links, **limits)


def serial(folder: Path, names: str, *more: str, **own: str) -> Path:
    """A chain: link, joint, link … by their names, as usual but for one's `own` elements."""
    words = names.split()
    parts = []
    for k, name in enumerate(words):
        usual = joint(name, words[k - 1], words[k + 1], GOOD) if k % 2 else link(name)
        parts.append(own.get(name, usual))
    return written(folder, *parts, *more)


def written(folder: Path, *parts: str) -> Path:
    path = folder / "robot.urdf"
    path.write_text(urdf_elements.robot_text("robot", *parts), encoding="utf-8")
    return path


def surveyed(path: Path) -> UrdfSurvey:
    return survey(load_description(str(path)))


def _facet(normal: str, *corners: str) -> str:
    loop = "".join(f"vertex {corner}\n" for corner in corners)
    return f"facet normal {normal}\nouter loop\n{loop}endloop\nendfacet\n"


_O, _X, _Y, _Z = "0 0 0", "0.03 0 0", "0 0.03 0", "0 0 0.1"
TETRAHEDRON = (
    f"solid a\n{_facet('0 0 -1', _O, _Y, _X)}{_facet('0 -1 0', _O, _X, _Z)}"
    f"{_facet('-1 0 0', _O, _Z, _Y)}{_facet('1 1 1', _X, _Y, _Z)}endsolid a\n"
)
