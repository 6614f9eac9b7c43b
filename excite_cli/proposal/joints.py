"""Which joints of a robot a plan should move, and why the others stay where they are.

Names tell wheels, rotors, fingers, faces and hoses; the structure tells when a name misleads: a
joint that carries a tenth of the robot is no finger, and a word that stands in every name says
nothing. A robot that consists of fingers moves them. Joints that follow another one move with it.
Joints of closed loops, which the model cuts, those of next to no range and those that equal limits
hold stay where they are.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import takewhile

from excite_cli.errors import ConfigError, RobotError, nearest
from excite_cli.robot.urdf_joints import UrdfJoint

# Arms, legs and other limbs of a robot, as groups of joints to choose from.


def limbs(joints: Sequence[UrdfJoint]) -> dict[str, tuple[str, ...]]:
    """Joints by limb: each chain without branches, by what its joints' names have in common."""
    names = {joint.name for joint in joints}
    ends = {
        joint.name: tuple(
            sorted(
                other.name
                for other in joints
                if not (names & set(other.beyond)) and other.name in (joint.name, *joint.beyond)
            )
        )
        for joint in joints
    }
    chains: dict[tuple[str, ...], list[str]] = {}
    for joint in joints:
        chains.setdefault(ends[joint.name], []).append(joint.name)
    groups: dict[str, tuple[str, ...]] = {}
    for chain in chains.values():
        word = _shared(chain).rstrip("_-0123456789 ") if len(chain) > 1 else chain[0]
        if not word or word in groups:
            word = f"{chain[0]} to {chain[-1]}"
        groups[word] = tuple(chain)
    return groups


def _shared(words: Sequence[str]) -> str:
    """The letters with which all words begin."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*words, strict=False))
    return "".join(letters[0] for letters in alike)


_WHEELS = {"wheel", "wheels", "caster", "castor", "suspension", "track"}
_ROTORS = {"rotor", "rotors", "propeller", "prop"}
_SENSORS = {"laser", "lidar", "velodyne", "camera", "d435", "hokuyo"}
_FACES = {"eye", "eyes", "eyelid", "eyelids", "lid", "lids", "brow", "brows", "eyebrow", "mouth",
          "lip", "lips", "face", "cheek", "nose", "antenna", "antennae"}  # fmt: skip
_SOFT = {"bellow", "bellows", "hose", "hoses", "cable", "cables", "spring", "springs", "damper",
         "dampers", "bumper", "bumpers"}  # fmt: skip
_LEAST_TURN, _LEAST_SLIDE = 0.02, 0.002  # rad and m: a range that shows nothing
_FINGERS = {"finger", "fingers", "thumb", "index", "pinky", "knuckle", "claw", "jaw", "mrl"}
# Fingers where others are: a spine has a middle too.
_AMONG_FINGERS = {"middle", "ring", "little"}
_HANDS = {"hand", "gripper"}
_WRISTS = {"yaw", "roll", "pitch", "wrist", "rotate", "flex"}
_ON_GROUND = {"base", "world", "odom", "mobile", "virtual", "rootjoint", "root", "rootx", "rooty",
              "rootz"}  # fmt: skip
_GROUND = {"world", "odom", "map", "root", "base_footprint", "base_x", "base_y", "dummy"}
_FINGER_SHARE = 0.1
# A hand with this many fingers' joints, and at most so many others (a wrist), is a hand alone.
_HAND, _WRIST = 8, 2
_MOVABLE = ("revolute", "continuous", "prismatic")
_TOLD = 6


@dataclass(frozen=True)
class JointChoice:
    """Joints to move, in the order of the URDF, and the others by the reason why not.

    `followers`: joints that move with one that is chosen, by its name.
    """

    chosen: tuple[UrdfJoint, ...]
    left_out: dict[str, tuple[str, ...]]
    followers: dict[str, tuple[str, ...]]

    def in_words(self) -> tuple[str, ...]:
        """One sentence for each reason, and for each joint that others follow."""
        left = (f"not moved, {why}: {_listed(names)}" for why, names in self.left_out.items())
        led = (f"moved with {name}: {_listed(names)}" for name, names in self.followers.items())
        return (*left, *led)


def choose_joints(
    joints: Iterable[UrdfJoint], source: str, asked: tuple[str, ...] = ()
) -> JointChoice:
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
    own = tuple(joint for joint in joints if joint.mimics is None)
    ruled = {joint.name: _reason(joint, own) for joint in own}
    fingers = [joint for joint in own if ruled[joint.name] == _FINGER]
    kept = [joint for joint in own if not ruled[joint.name]]
    if fingers and (not kept or (len(kept) <= _WRIST and len(fingers) >= _HAND)):
        for joint in fingers:
            ruled[joint.name] = ""
        kept = [joint for joint in own if not ruled[joint.name]]
    held = {joint.name for joint in own if joint.held}
    for joint in joints:  # a joint that follows does as its driver does
        if joint.mimics is not None:
            driver = joint.mimics.driver
            ruled[joint.name] = _STILL if driver in held else ruled.get(driver, _STILL)
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
    return JointChoice(tuple(kept), left_out, _followers(kept, joints))


def _followers(
    chosen: Iterable[UrdfJoint], joints: tuple[UrdfJoint, ...]
) -> dict[str, tuple[str, ...]]:
    """Joints that move with the chosen ones."""
    found = {
        one.name: tuple(
            joint.name
            for joint in joints
            if joint.mimics is not None and joint.mimics.driver == one.name
        )
        for one in chosen
    }
    return {name: followers for name, followers in found.items() if followers}


_FINGER = "fingers and grippers"
_STILL = "joints that mimic one that is fixed or unknown"
_NO_RANGE = "joints whose limits and those of the joints that mimic them leave no range"


def _reason(joint: UrdfJoint, joints: tuple[UrdfJoint, ...]) -> str:
    if joint.kind not in _MOVABLE:
        return "joints of the base" if not joint.above else f"joints of type {joint.kind}"
    if joint.in_loop:
        return "joints of closed loops, which the model cuts"
    least, unit = (_LEAST_SLIDE, "m") if joint.sliding else (_LEAST_TURN, "rad")
    if joint.held:
        return f"held at {joint.lower:g} {unit} by equal position limits"
    if joint.known and joint.lower >= joint.upper:
        return _NO_RANGE
    if joint.known and joint.upper - joint.lower < least:
        return f"joints with a range below {least:g} {unit}"
    words = _words(joint.name)
    if words & _WHEELS or (joint.carried < _FINGER_SHARE and _words(joint.child) & _WHEELS):
        return "wheels and casters"
    if words & _ROTORS:
        return "rotors"
    if _planar_base(joint, joints):
        return "joints of the base"
    if joint.carried <= 0.0 and any(other.carried > 0.0 for other in joints):
        return "joints that move no mass"
    if joint.carried >= _FINGER_SHARE:
        return ""
    if words & _SENSORS:
        return "mounts of sensors"
    if words & _FACES:
        return "faces"
    if words & _SOFT:
        return "springs, bellows and hoses"
    alike = set.intersection(*(_words(joint.name) for joint in joints))
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
    if not _words(joint.name) & _ON_GROUND or joint.carried <= 0.95 or len(joint.above) > 2:
        return False
    above = [other for other in joints if other.name in joint.above]
    return joint.parent in _GROUND or (
        bool(above) and all(_planar_base(other, joints) for other in above)
    )


def _words(name: str) -> set[str]:
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name)
    words = re.split(r"[^a-z0-9]+", apart.lower())
    return {re.sub(r"(?<=[a-z]{2})\d+$", "", word) for word in words}


def _as_asked(joints: tuple[UrdfJoint, ...], asked: tuple[str, ...]) -> JointChoice:
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
                f"--joints: '{name}' mimics '{joint.mimics.driver}' and moves with it. Leave it "
                f"out, and name '{joint.mimics.driver}' if it is to move."
            )
        if joint.kind not in _MOVABLE:
            raise ConfigError(
                f"--joints: '{name}' is of type {joint.kind}; only revolute, continuous and "
                "prismatic joints can be moved."
            )
        if joint.known and joint.lower >= joint.upper:
            why = f"is held at {joint.lower:g} by equal position limits"
            raise ConfigError(
                f"--joints: '{name}' {why if joint.held else 'has no range left by its followers'}."
                " Leave it out; to move it, write the config without it, then name it under "
                "robot.joints and give robot.limits.<joint>.position what the robot really has."
            )
    chosen = tuple(joint for joint in joints if joint.name in asked)
    followers = _followers(chosen, joints)
    moved = {*asked, *(name for names in followers.values() for name in names)}
    others = tuple(joint.name for joint in joints if joint.name not in moved)
    return JointChoice(chosen, {"not requested": others} if others else {}, followers)


def _listed(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
    return ", ".join(names[:_TOLD]) + more
