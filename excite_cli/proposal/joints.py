"""Which joints of a robot a plan should move, and why the others stay where they are.

Names tell wheels, rotors and fingers; the structure tells when a name misleads: a joint that
carries a tenth of the robot is no finger, and a word that stands in every name says nothing. A
robot that consists of fingers moves them.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from excite_cli.errors import ConfigError, RobotError, nearest
from excite_cli.robot.urdf_joints import UrdfJoint

_WHEELS = {"wheel", "wheels", "caster", "castor", "suspension", "track"}
_ROTORS = {"rotor", "rotors", "propeller", "prop"}
_SENSORS = {"laser", "lidar", "velodyne", "camera", "d435", "hokuyo"}
_FINGERS = {"finger", "fingers", "thumb", "index", "pinky", "knuckle", "claw", "jaw", "mrl"}
# Fingers where others are: a spine has a middle too.
_AMONG_FINGERS = {"middle", "ring", "little"}
_HANDS = {"hand", "gripper"}
_WRISTS = {"yaw", "roll", "pitch", "wrist", "rotate", "flex"}
_FINGER_SHARE = 0.1
# A hand with this many fingers' joints, and at most so many others (a wrist), is a hand alone.
_HAND, _WRIST = 8, 2
_MOVABLE = ("revolute", "continuous", "prismatic")
_TOLD = 6


@dataclass(frozen=True)
class Choice:
    """Joints to move, in the order of the URDF, and the others by the reason why not."""

    chosen: tuple[UrdfJoint, ...]
    left_out: dict[str, tuple[str, ...]]

    def in_words(self) -> tuple[str, ...]:
        """One sentence for each reason."""
        return tuple(f"{reason}: {_listed(names)}" for reason, names in self.left_out.items())


def choose_joints(joints: Iterable[UrdfJoint], source: str, asked: tuple[str, ...] = ()) -> Choice:
    """The joints to move; those `asked` for where any are.

    Raises
    ------
    RobotError
        No joint can be moved, or none but wheels and rotors.
    ConfigError
        A joint that is requested is unknown or cannot be moved.
    """
    joints = tuple(joints)
    if not joints:
        raise RobotError(f"{source} has no movable joint: there is nothing to plan for.")
    if asked:
        return _as_asked(joints, asked)
    ruled = {joint.name: _reason(joint, joints) for joint in joints}
    fingers = [joint for joint in joints if ruled[joint.name] == _FINGER]
    kept = [joint for joint in joints if not ruled[joint.name]]
    if fingers and (not kept or (len(kept) <= _WRIST and len(fingers) >= _HAND)):
        for joint in fingers:
            ruled[joint.name] = ""
        kept = [joint for joint in joints if not ruled[joint.name]]
    left_out: dict[str, tuple[str, ...]] = {}
    for joint in joints:
        if ruled[joint.name]:
            left_out[ruled[joint.name]] = (*left_out.get(ruled[joint.name], ()), joint.name)
    if not kept:
        reasons = "; ".join(f"{why}: {_listed(names)}" for why, names in left_out.items())
        raise RobotError(
            f"{source} has no arm, leg or hand to move, only {reasons}. Name joints with --joints "
            "if they are meant all the same."
        )
    return Choice(tuple(kept), left_out)


_FINGER = "fingers and grippers"


def _reason(joint: UrdfJoint, joints: tuple[UrdfJoint, ...]) -> str:
    if joint.mimics is not None:
        return "joints that mimic another"
    if joint.kind not in _MOVABLE:
        return "joints of the base" if not joint.above else f"joints of type {joint.kind}"
    words = _words(joint.name)
    if words & _WHEELS:
        return "wheels and casters"
    if words & _ROTORS:
        return "rotors"
    if _planar_base(joint, joints):
        return "joints of the base"
    if joint.carried >= _FINGER_SHARE:
        return ""
    if words & _SENSORS:
        return "mounts of sensors"
    alike = _everywhere(joints)
    words -= alike
    wrist = bool(words & _WRISTS)
    fingers = _FINGERS - alike
    if any(_words(other.name) & fingers for other in joints):
        fingers = fingers | _AMONG_FINGERS
    if words & fingers or (words & _HANDS and not wrist):
        return _FINGER
    return ""


def _planar_base(joint: UrdfJoint, joints: tuple[UrdfJoint, ...]) -> bool:
    """Whether it is one of the first joints, which slide or turn the whole robot on the ground."""
    words = _words(joint.name)
    on_ground = bool(words & {"base", "world", "odom", "mobile", "virtual", "rootjoint", "root"})
    return (
        on_ground
        and joint.carried > 0.95
        and len(joint.above) < 3
        and joint.parent
        in {"world", "odom", "map", "root", "base_footprint", "base_x", "base_y", "dummy"}
    )


def _words(name: str) -> set[str]:
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name)
    words = re.split(r"[^a-z0-9]+", apart.lower())
    return {re.sub(r"(?<=[a-z]{2})\d+$", "", word) for word in words}


def _everywhere(joints: tuple[UrdfJoint, ...]) -> set[str]:
    """Words that stand in the name of every joint that moves on its own."""
    own = [_words(joint.name) for joint in joints if joint.mimics is None]
    return set.intersection(*own)


def _as_asked(joints: tuple[UrdfJoint, ...], asked: tuple[str, ...]) -> Choice:
    known = {joint.name: joint for joint in joints}
    for name in asked:
        if name not in known:
            raise ConfigError(
                f"--joints: the robot has no joint '{name}'.{nearest(name, known)} Its movable "
                f"joints: {', '.join(known)}."
            )
        joint = known[name]
        if joint.mimics is not None:
            raise ConfigError(
                f"--joints: '{name}' mimics '{joint.mimics}' and does not move on its own; coupled "
                "joints are not modelled. Leave it out."
            )
        if joint.kind not in _MOVABLE:
            raise ConfigError(
                f"--joints: '{name}' is of type {joint.kind}; only revolute, continuous and "
                "prismatic joints can be moved."
            )
    others = tuple(joint.name for joint in joints if joint.name not in asked)
    chosen = tuple(joint for joint in joints if joint.name in asked)
    return Choice(chosen, {"not requested": others} if others else {})


def _listed(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
    return ", ".join(names[:_TOLD]) + more
