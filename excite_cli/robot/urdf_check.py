"""What is checked of a URDF before any library reads it: size, depth, structure and numbers.

Files are not trusted. The libraries that build models of it recurse by its depth, print to the
terminal, and some of them end the program by what they do not expect; so all that they get here is
a tree of named links and joints, with finite numbers of a real robot, within limits of size.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn

from excite_cli.errors import RobotError

MAX_BYTES = 20_000_000  # of a text
MAX_DEPTH = 40
MAX_ELEMENTS = 200_000
MAX_LINKS = 1000
MAX_MOVABLE = 300  # joints that are not fixed
_CHUNK = 2**16
_HEAVIEST = 1e9
_FARTHEST = 1e6  # m
_LONGEST = 60  # characters of a name or of numbers that are told
# Attributes that hold numbers: how many, and the largest.
_NUMBERS: dict[str, dict[str, tuple[int, float]]] = {
    "origin": {"xyz": (3, _FARTHEST), "rpy": (3, _FARTHEST)},
    "box": {"size": (3, _FARTHEST)},
    "sphere": {"radius": (1, _FARTHEST)},
    "cylinder": {"radius": (1, _FARTHEST), "length": (1, _FARTHEST)},
    "capsule": {"radius": (1, _FARTHEST), "length": (1, _FARTHEST)},
    "mesh": {"scale": (3, _FARTHEST)},
    "limit": dict.fromkeys(("lower", "upper", "velocity", "effort"), (1, math.inf)),
    "dynamics": {"damping": (1, _HEAVIEST), "friction": (1, _HEAVIEST)},
    "mimic": {"multiplier": (1, _HEAVIEST), "offset": (1, _HEAVIEST)},
}
_PLACES = (
    "joint/*",
    "link/inertial/origin",
    "link/collision/origin",
    "link/collision/geometry/*",
)
_SIZES = ("size", "radius", "length")


def xml_text(path: Path, what: str) -> str:
    """The text of a file that is `what`, as "a URDF": XML that needs no document type.

    Raises
    ------
    RobotError
        It cannot be read, is too large or no text, or declares a document type or entities, which
        may read other files and grow without end.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise RobotError(f"{path} is larger than {MAX_BYTES // 10**6} MB: not {what}.")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError(f"{path} cannot be read as text: {error}") from error
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise RobotError(f"{path} declares a document type or entities; {what} needs neither.")
    return text


def parsed(path: Path, text: str) -> ElementTree.Element:
    """The root of a URDF whose structure and numbers a model can be built of.

    Raises
    ------
    RobotError
        It is not XML, not a URDF, too large or too deep, no tree, or has numbers of no robot.
    """
    root = tree_of(path, text)
    if root.tag != "robot":
        raise RobotError(
            f"{path} is not a URDF: its root is <{_short(root.tag)}>, not <robot>. URDF, xacro, "
            "MJCF and SDF are read."
        )
    _check_structure(path, root)
    _check_axes(path, root)
    _check_inertias(path, root)
    _check_numbers(path, root)
    return root


def root_tag(text: str) -> str:
    """The name of the first element; empty of what is not XML."""
    parser: Any = ElementTree.XMLPullParser(("start",))
    try:
        for start in range(0, len(text), _CHUNK):
            parser.feed(text[start : start + _CHUNK])
            for _, element in parser.read_events():
                return str(element.tag)
    except (ElementTree.ParseError, ValueError, LookupError):
        pass
    return ""


def tree_of(path: Path, text: str) -> ElementTree.Element:
    """Parsed piece by piece, so that depth and number of elements are known before it is large.

    Raises
    ------
    RobotError
        It is not XML, too large or too deep.
    """
    parser: Any = ElementTree.XMLPullParser(("start", "end"))
    root: ElementTree.Element | None = None
    depth = count = 0
    try:
        for start in range(0, len(text), _CHUNK):
            parser.feed(text[start : start + _CHUNK])
            for event, element in parser.read_events():
                root = element if root is None else root
                depth += 1 if event == "start" else -1
                count += event == "start"
                if depth > MAX_DEPTH or count > MAX_ELEMENTS:
                    what = f"deeper than {MAX_DEPTH} levels" if depth > MAX_DEPTH else "too large"
                    raise RobotError(
                        f"{path} is {what}: no robot (up to {MAX_ELEMENTS:,} elements are read)."
                    )
        parser.close()
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise RobotError(f"{path} is not well-formed XML: {error}") from error
    if root is None:
        raise RobotError(f"{path} is not well-formed XML: it has no element.")
    return root


def _check_structure(path: Path, root: ElementTree.Element) -> None:
    """See that links and joints have names of their own and make one tree."""
    links, joints = root.findall("link"), root.findall("joint")
    movable = sum(joint.get("type") != "fixed" for joint in joints)
    if len(links) > MAX_LINKS or movable > MAX_MOVABLE:
        raise RobotError(
            f"{path} has {len(links):,} links and {movable:,} movable joints; robots of up to "
            f"{MAX_LINKS:,} links and {MAX_MOVABLE} movable joints are read."
        )
    for what, elements in (("link", links), ("joint", joints)):
        names = Counter(element.get("name", "").strip() for element in elements)
        if names[""]:
            _refuse(path, f"a {what} has no name")
        twice = next((name for name, count in names.items() if count > 1), None)
        if twice is not None:
            _refuse(path, f"two {what}s are called '{_short(twice)}'")
    known = {link.get("name", "") for link in links}
    children: dict[str, list[str]] = {}
    parents: set[str] = set()
    for joint in joints:
        ends = [_end(path, joint, end, known) for end in ("parent", "child")]
        if ends[1] in parents:
            link = _short(ends[1])
            _refuse(path, f"two joints lead to link '{link}', which closes a loop, and a URDF is a "
                          f"tree. Cut the loop: give one of the two joints as <loop_joint><link1 "
                          f"link=\"…\"/><link2 link=\"{link}\"/></loop_joint>; `excite init` then "
                          "leaves the joints of the loop where they are")  # fmt: skip
        parents.add(ends[1])
        children.setdefault(ends[0], []).append(ends[1])
    roots = sorted(known - parents)
    if len(roots) != 1:
        there = f"{len(roots)} links that no joint leads to ({_short(', '.join(roots))})"
        _refuse(path, f"it has {there if roots else 'no first link'}; a robot has one")
    reached, todo = 0, list(roots)
    while todo:
        reached += 1
        todo += children.get(todo.pop(), [])
    if reached != len(known):
        _refuse(path, "its joints go round in a circle")


def _end(path: Path, joint: ElementTree.Element, end: str, known: set[str]) -> str:
    """The link at an end of a joint."""
    found = joint.find(end)
    link = "" if found is None else found.get("link", "")
    if link not in known:
        name = _short(joint.get("name", ""))
        _refuse(path, f"joint '{name}' has the {end} '{_short(link)}', which is not a link of it")
    return link


def _check_axes(path: Path, root: ElementTree.Element) -> None:
    for joint in root.findall("joint"):
        axis = joint.find("axis")
        if axis is None or joint.get("type") == "fixed":
            continue
        numbers = _numbers(axis.get("xyz", "1 0 0"))
        if len(numbers) != 3 or not 1e-6 <= math.hypot(*numbers) <= _FARTHEST:
            raise RobotError(
                f"{path}: joint '{_short(joint.get('name', ''))}' has the axis "
                f"'{_short(axis.get('xyz', ''))}'; an axis is three numbers that are not all zero."
            )


def _check_inertias(path: Path, root: ElementTree.Element) -> None:
    for link in root.findall("link"):
        for tag in ("mass", "inertia"):
            element = link.find(f"inertial/{tag}")
            values = [] if element is None else list(element.attrib.values())
            try:
                numbers = [float(value) for value in values]
            except ValueError:
                numbers = [math.nan]
            wrong = any(not math.isfinite(x) or abs(x) > _HEAVIEST for x in numbers)
            if wrong or (tag == "mass" and any(x < 0 for x in numbers)):
                raise RobotError(
                    f"{path}: link '{_short(link.get('name', ''))}' has <{tag}> "
                    f"{_short(' '.join(values))}; it must be finite numbers of a real robot, and a "
                    "mass not negative."
                )


def _check_numbers(path: Path, root: ElementTree.Element) -> None:
    for place in _PLACES:
        for element in root.findall(place):
            for key, (count, most) in _NUMBERS.get(element.tag, {}).items():
                text = element.get(key)
                if text is None:
                    continue
                numbers = _numbers(text)
                good = len(numbers) == count and all(abs(x) <= most for x in numbers)
                if not good or (key in _SIZES and min(numbers) < 0):
                    wanted = "three numbers" if count == 3 else "a number"
                    _refuse(path, f"<{element.tag} {key}=\"{_short(text)}\"> is not {wanted} of a "
                                  "real robot")  # fmt: skip


def _numbers(text: str) -> list[float]:
    """The numbers of `text`; nothing where one of them is none."""
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []


def _refuse(path: Path, what: str) -> NoReturn:
    raise RobotError(f"{path} is not a URDF that can be used: {what}.")


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
