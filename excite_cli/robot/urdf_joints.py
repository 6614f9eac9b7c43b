"""What a URDF says about each of its joints, before anything is built of it.

Read from the XML alone, so that joints with empty limits or of kinds that cannot be moved are seen
like any other.
"""

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace

from excite_cli.robot.description import RobotDescription
from excite_cli.robot.limits import UNBOUNDED, JointRange
from excite_cli.robot.loops import Mimic


@dataclass(frozen=True)
class UrdfJoint:
    """One joint that is not fixed.

    kind: `revolute`, `prismatic`, or another type of URDF; `continuous` is a revolute one with
    infinite `lower` and `upper`. lower, upper [rad or m], velocity [rad/s or m/s], effort [N·m or
    N]: as written, nan where the URDF gives none; without `known` it gives no limits of position,
    and both are 0; `held`: equal ones, its own or those of a follower, hold it. carried: share of
    the robot's mass beyond the joint. above: movable joints between it and the base, nearest to the
    base first. beyond: those that it carries. mimics: what it follows; lower, upper and velocity of
    a joint that others follow are those that these leave it. in_loop: whether it lies on a closed
    loop, which is cut.
    """

    name: str
    kind: str
    parent: str
    child: str
    lower: float
    upper: float
    velocity: float
    effort: float
    mimics: Mimic | None
    carried: float
    above: tuple[str, ...]
    beyond: tuple[str, ...]
    in_loop: bool = False
    known: bool = True
    held: bool = False

    @property
    def sliding(self) -> bool:
        """Whether it is prismatic."""
        return self.kind == "prismatic"

    @property
    def bounds(self) -> JointRange:
        """Its limits of position and speed; what is no speed bounds nothing."""
        speed = self.velocity if self.velocity > 0 else math.inf
        written = JointRange.written(self.lower, self.upper, speed)
        return replace(written, known=self.known, held=self.held)


@dataclass(frozen=True)
class UrdfSurvey:
    """The movable joints in the order of the URDF, and what else a plan must know.

    mass: of all links [kg]; inertial_links: how many links have an <inertial>; has_shapes: whether
    any link has collision geometry; unguarded: joints whose body has mass, no collision geometry,
    and visual geometry that can stand for it.
    """

    joints: tuple[UrdfJoint, ...]
    mass: float
    inertial_links: int
    has_shapes: bool
    unguarded: tuple[str, ...]


class _Tree:
    """Links and joints of a URDF as they hang on each other; circles end where they began."""

    def __init__(self, root: ElementTree.Element) -> None:
        self.joints = root.findall("joint")
        self.masses = {link.get("name", ""): _mass(link) for link in root.findall("link")}
        self._children: dict[str, list[ElementTree.Element]] = {}
        self._parent_joint: dict[str, ElementTree.Element] = {}
        for element in self.joints:
            self._children.setdefault(link_at(element, "parent"), []).append(element)
            self._parent_joint[link_at(element, "child")] = element

    def below(self, link: str) -> tuple[float, list[str]]:
        """The mass of `link` and all that it carries, and movable joints between these."""
        mass, names, todo, seen = 0.0, [], [link], set()
        while todo:
            at = todo.pop()
            if at in seen:
                continue
            seen.add(at)
            mass += self.masses.get(at, 0.0)
            for element in self._children.get(at, []):
                todo.append(link_at(element, "child"))
                if element.get("type") != "fixed":
                    names.append(element.get("name", ""))
        return mass, names

    def unguarded(self, root: ElementTree.Element) -> tuple[str, ...]:
        """Movable joints whose body has mass and visual geometry, but none for collisions."""
        solid, shown = (
            {
                link.get("name", "")
                for link in root.findall("link")
                if link.findall(f"{kind}/geometry")
            }
            for kind in ("collision", "visual")
        )
        found = []
        for element in self.joints:
            body = self._body(link_at(element, "child"))
            mass = sum(self.masses.get(link, 0.0) for link in body)
            if element.get("type") != "fixed" and mass > 0 and not body & solid and body & shown:
                found.append(element.get("name", ""))
        return tuple(found)

    def _body(self, link: str) -> set[str]:
        """`link` and all that is fixed to it."""
        body, todo = set[str](), [link]
        while todo:
            at = todo.pop()
            if at not in body:
                body.add(at)
                fixed = (e for e in self._children.get(at, []) if e.get("type") == "fixed")
                todo += [link_at(element, "child") for element in fixed]
        return body

    def above(self, element: ElementTree.Element) -> list[str]:
        """Movable joints between the root and a joint."""
        names: list[str] = []
        link, seen = link_at(element, "parent"), set()
        while link in self._parent_joint and link not in seen:
            seen.add(link)
            upper = self._parent_joint[link]
            if upper.get("type") != "fixed":
                names.append(upper.get("name", ""))
            link = link_at(upper, "parent")
        return names[::-1]


def survey(description: RobotDescription) -> UrdfSurvey:
    """The movable joints of a URDF with all that it says about them."""
    root = ElementTree.fromstring(description.xml)
    tree = _Tree(root)
    total = sum(tree.masses.values())
    looped = {joint for loop in description.loops for joint in loop.joints}
    joints: list[UrdfJoint] = []
    for element in tree.joints:
        if element.get("type") == "fixed":
            continue
        child = link_at(element, "child")
        mass, beyond = tree.below(child)
        lower, upper = _limit(element, "lower", 0.0), _limit(element, "upper", 0.0)
        joints.append(
            UrdfJoint(
                name=element.get("name", ""),
                kind=element.get("type", ""),
                parent=link_at(element, "parent"),
                child=child,
                lower=lower if lower > -UNBOUNDED else -math.inf,
                upper=upper if upper < UNBOUNDED else math.inf,
                velocity=_limit(element, "velocity"),
                effort=_limit(element, "effort"),
                mimics=description.mimicking.get(element.get("name", "")),
                carried=mass / total if total > 0 else 0.0,
                above=tuple(tree.above(element)),
                beyond=tuple(beyond),
                in_loop=element.get("name", "") in looped,
            )
        )
    joints = [_as_written(joint) for joint in joints]
    _narrow(joints)
    return UrdfSurvey(
        joints=tuple(joints),
        mass=total,
        inertial_links=len(root.findall("link/inertial")),
        has_shapes=bool(root.findall("link/collision/geometry")),
        unguarded=tree.unguarded(root),
    )


def _as_written(joint: UrdfJoint) -> UrdfJoint:
    """The joint, with what its limits of position mean; only turning and sliding ones have any."""
    bounds = JointRange.written(joint.lower, joint.upper, math.inf)
    held = bounds.held and joint.kind in ("revolute", "prismatic")
    return replace(joint, known=bounds.known, held=held)


def _narrow(joints: list[UrdfJoint]) -> None:
    """Limits of joints that others follow become those that these leave them."""
    place = {joint.name: k for k, joint in enumerate(joints)}
    for follower in joints:
        if follower.mimics is None or follower.mimics.driver not in place:
            continue
        k = place[follower.mimics.driver]
        own = joints[k].bounds
        kept = own.keeping(follower.bounds, follower.mimics)
        speed = kept.velocity if kept.velocity < own.velocity else joints[k].velocity
        joints[k] = replace(
            joints[k], lower=kept.lower, upper=kept.upper, velocity=speed, held=kept.held
        )


def link_at(element: ElementTree.Element, end: str) -> str:
    """The link at the `parent` or `child` end of a <joint>; empty where it names none."""
    found = element.find(end)
    return "" if found is None else found.get("link", "")


def _mass(link: ElementTree.Element) -> float:
    element = link.find("inertial/mass")
    return 0.0 if element is None else float(element.get("value", "0"))


def _limit(element: ElementTree.Element, key: str, default: float = math.nan) -> float:
    limit = element.find("limit")
    try:
        return default if limit is None else float(limit.get(key, default))
    except ValueError:
        return default
