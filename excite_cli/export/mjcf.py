"""A MuJoCo model (MJCF) of the moved joints with identified inertias and joint effects.

The kinematic tree, one body per joint that moves, and no shapes: MuJoCo's inverse dynamics of it
gives the identified torque. Actuators are those of robots that follow set points.
A floating base stands at its reference. Joints that
follow others (mimic) are coupled by <equality>, which MuJoCo's inverse dynamics leaves out: add
their torques to their drivers', times the multiplier.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from math import ceil, isfinite

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.effects.mechanism import MjcfParts
from excite_cli.errors import RobotError
from excite_cli.export.drive import Drive
from excite_cli.export.exported import (
    ModelText,
    in_words,
    number,
    ten_as_body,
    vector,
)
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import Tree, TreeJoint, tree_of

STEP = 5e-4  # s: physics step of models with actuators
_POINT = 1e-6  # kg·m²: no body that moves has less, to MuJoCo


def mjcf(robot: Robot, model: IdentifiedModel, drive: Drive | None = None) -> ModelText:
    """The model's text, and what MJCF cannot hold; with the actuators of a `drive`, if given.

    What the model holds for gains and offsets of the drive's law is in the actuators.

    Raises
    ------
    RobotError
        A body has inertias that MuJoCo refuses, since no mass distribution has them.
    """
    tree = tree_of(robot)
    phi = model.phi + model.carried(robot)
    parts, left = joint_parts(robot, model)
    root = ElementTree.Element("mujoco", {"model": robot.name})
    ElementTree.SubElement(root, "compiler", {"angle": "radian", "autolimits": "false"})
    option = {"gravity": vector(parts.gravity)}
    if drive is not None:  # the damping of stiff drives is taken implicitly, as in `replay`
        option.update(integrator="implicitfast", timestep=number(STEP))
    ElementTree.SubElement(root, "option", option)
    world = ElementTree.SubElement(root, "worldbody")
    placed: list[ElementTree.Element] = []
    for k, joint in enumerate(tree.joints):
        parent = world if joint.parent < 0 else placed[joint.parent]
        body = _body(parent, joint, phi[_ten(tree, k)])
        kind = "slide" if joint.sliding else "hinge"
        settings = {"name": joint.name, "type": kind, "axis": vector(joint.axis)}
        if joint.name in robot.joint_names:
            settings.update(_limits(robot, joint.driver))
            settings.update(_attributes(parts.joints[joint.driver]))
        joint_element = ElementTree.Element("joint", settings)
        body.insert(1, joint_element)
        placed.append(body)
    _add_tendons(root, robot, parts)
    _add_couplings(root, robot, tree)
    notes = ["it has no shapes, actuators or sensors"]
    if drive is not None:
        left = [effect for effect in left if not held_by_actuators(effect, drive)]
        notes = ["it has no shapes or sensors"]
        notes += add_actuators(root, robot.joint_names, drive.corrected(model))
    ElementTree.indent(root)
    if robot.payload is not None:
        notes.append(f"the payload ({robot.payload.in_words}) is part of its body")
    if left:
        words = in_words(left, robot.joint_names)
        notes.append(f"MJCF cannot hold: {words}. The file of parameters does")
    return ModelText(ElementTree.tostring(root, encoding="unicode") + "\n", tuple(notes))


def _ten(tree: Tree, j: int) -> slice:
    first = 10 * (tree.first_body + j)
    return slice(first, first + 10)


def _body(parent: ElementTree.Element, joint: TreeJoint, ten: Array) -> ElementTree.Element:
    mass, center, inertia = ten_as_body(ten)
    moments = np.linalg.eigvalsh(inertia)
    if abs(moments[0]) < _POINT:  # a point mass, or a body that the URDF gave no inertia
        inertia = inertia + _POINT * np.eye(3)
        moments = np.linalg.eigvalsh(inertia)
    if mass <= 0 or moments[0] <= 0 or moments[0] + moments[1] < moments[2]:
        raise RobotError(
            f"The body carried by '{joint.name}' (mass {mass:.3g} kg, principal moments "
            f"{', '.join(f'{moment:.3g}' for moment in moments)} kg·m²) is not one that MuJoCo "
            "accepts. Identify with identification.consistent: true."
        )
    place = {"pos": vector(joint.position), "quat": vector(_quaternion(joint.rotation))}
    body = ElementTree.SubElement(parent, "body", {"name": f"body_of_{joint.name}", **place})
    entries = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2]]
    ElementTree.SubElement(
        body,
        "inertial",
        {
            "pos": vector(center),
            "mass": number(mass),
            "fullinertia": vector(np.array([*entries, inertia[1, 2]])),
        },
    )
    return body


def _quaternion(rotation: Array) -> Array:
    """w, x, y, z of a rotation matrix."""
    values, vectors = np.linalg.eigh(_quaternion_form(rotation))
    found = vectors[:, int(np.argmax(values))]
    return found if found[0] >= 0 else -found


def _quaternion_form(r: Array) -> Array:
    """4×4 symmetric matrix whose dominant eigenvector is the quaternion (Bar-Itzhack 2000)."""
    return np.array(
        [
            [np.trace(r), r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )


def _limits(robot: Robot, j: int) -> dict[str, str]:
    lower, upper = float(robot.limits.lower[j]), float(robot.limits.upper[j])
    if not (np.isfinite(lower) and np.isfinite(upper)):
        return {}
    return {"limited": "true", "range": f"{number(lower)} {number(upper)}"}


def holds(effect: Effect, values: Array) -> bool:
    """Whether MuJoCo has a part for the effect."""
    size = max(effect.joints, default=0) + 1
    parts = MjcfParts([{} for _ in range(size)], np.zeros(3), _knows_polynomials())
    return effect.put_into_mjcf(parts, values)


def joint_parts(robot: Robot, model: IdentifiedModel) -> tuple[MjcfParts, list[Effect]]:
    """What the effects become in MuJoCo, and those that have no place there."""
    gravity = np.array(tree_of(robot).gravity)
    parts = MjcfParts([{} for _ in range(robot.n)], gravity, _knows_polynomials())
    left = [
        effect
        for effect, values in model.by_effect
        if effect.runs or not (effect.carried or effect.put_into_mjcf(parts, values))
    ]
    for tendon in parts.tendons:  # it damps each of its joints alone as well
        for joint in (tendon.first, tendon.second):
            own = parts.joints[joint].get("damping", 0.0)
            parts.joints[joint]["damping"] = max(own - tendon.damping, 0.0)
    return parts, left


def _knows_polynomials() -> bool:
    """Whether the installed MuJoCo has damping by powers of the speed."""
    if find_spec("mujoco") is None:
        return False
    return hasattr(import_module("mujoco").MjModel, "dof_dampingpoly")


def _attributes(own: dict[str, float]) -> dict[str, str]:
    powers = [own.get(name, 0.0) for name in ("damping", "damping_2", "damping_3")]
    while len(powers) > 1 and not powers[-1]:
        powers.pop()
    told = {name: number(x) for name, x in own.items() if not name.startswith("damping")}
    return {**told, "damping": vector(np.array(powers))} if any(powers) else told


def _add_couplings(root: ElementTree.Element, robot: Robot, tree: Tree) -> None:
    """The joints that follow others, and what they follow."""
    followers = [joint for joint in tree.joints if joint.name not in robot.joint_names]
    if not followers:
        return
    coupled = ElementTree.SubElement(root, "equality")
    for joint in followers:
        told = {"joint1": joint.name, "joint2": robot.joint_names[joint.driver]}
        factors = vector(np.array([joint.offset, joint.multiplier, 0.0, 0.0, 0.0]))
        hard = {"solref": "0.004 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
        ElementTree.SubElement(coupled, "joint", {**told, "polycoef": factors, **hard})


def _add_tendons(root: ElementTree.Element, robot: Robot, parts: MjcfParts) -> None:
    if not parts.tendons:
        return
    tendons = ElementTree.SubElement(root, "tendon")
    for each in parts.tendons:
        told = {"frictionloss": number(each.friction), "damping": number(each.damping)}
        fixed = ElementTree.SubElement(tendons, "fixed", told)
        for joint, coefficient in ((each.first, 1.0), (each.second, each.ratio)):
            name = robot.joint_names[joint]
            ElementTree.SubElement(fixed, "joint", {"joint": name, "coef": number(coefficient)})


# Actuators of an exported MuJoCo model whose robot follows position set points.
#
#     force = clip(k_p (ctrl − q) − k_v v, ±limit)
#
# is `<position>` with `kp`, `kv` and `forcerange`; where the law is off by a constant, `<general>`
# with the same coefficients and that constant. The set point acts after `delay`, if the installed
# MuJoCo knows that; else the delay stands in a comment and as the number `command_delay`.

# s: a delay is usually a multiple of the physics step; rounding must not make it a step more.
_ROUNDING = 1e-7
_SHORTEST_STEP = 5e-4  # s: a physics step for which the history of set points is long enough


def held_by_actuators(effect: Effect, drive: Drive | None) -> bool:
    """Whether the coefficients of the actuators, if there are any, hold it."""
    return drive is not None and effect.kind in ("torque_gain", "torque_offset") and not effect.runs


def add_actuators(root: ElementTree.Element, joint_names: Sequence[str], drive: Drive) -> list[str]:
    """An actuator for each joint, named after it; sentences for who uses the file."""
    delayed = drive.delay > 0.0 and _knows_delays()
    actuators = ElementTree.SubElement(root, "actuator")
    for j, name in enumerate(joint_names):
        kp, kd, bias = float(drive.kp[j]), float(drive.kd[j]), float(drive.bias[j])
        settings = {"name": name, "joint": name}
        if bias == 0.0:
            kind, law = "position", {"kp": number(kp), "kv": number(kd)}
        else:
            numbers = " ".join(map(number, (bias, -kp, -kd)))
            kind, law = "general", {"biastype": "affine", "gainprm": number(kp), "biasprm": numbers}
        settings.update(law)
        limit = float(drive.limit[j])
        if isfinite(limit):
            settings.update(forcelimited="true", forcerange=f"{number(-limit)} {number(limit)}")
        if delayed:
            history = ceil(drive.delay / _SHORTEST_STEP) + 1
            late = round(max(drive.delay - _ROUNDING, _ROUNDING), 9)
            settings.update(delay=number(late), nsample=str(history), interp="zoh")
        ElementTree.SubElement(actuators, kind, settings)
    if drive.delay > 0.0 and not delayed:
        text = f" A set point acts {number(drive.delay)} s after it was sent: delay ctrl by that. "
        root.insert(list(root).index(actuators), ElementTree.Comment(text))
        custom = ElementTree.SubElement(root, "custom")
        numeric = {"name": "command_delay", "data": number(drive.delay)}
        ElementTree.SubElement(custom, "numeric", numeric)
        return [
            f"this version of MuJoCo has no delays: delay ctrl by {drive.delay:g} s yourself "
            "(numeric command_delay)"
        ]
    if delayed:
        return [
            f"actuators delay ctrl by {drive.delay:g} s: with physics steps of "
            f"{1e3 * _SHORTEST_STEP:g} ms or more; nsample is the history of a finer one"
        ]
    return []


def _knows_delays() -> bool:
    """Whether the installed MuJoCo has actuators with a delay; so it is if it is not installed."""
    if find_spec("mujoco") is None:
        return True
    return hasattr(import_module("mujoco").MjModel, "actuator_delay")
