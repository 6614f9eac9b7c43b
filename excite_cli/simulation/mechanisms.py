"""How each kind of effect gets into the simulated robot.

What MuJoCo has a part for becomes that part; defects of the data change what is recorded; anything
else, kinds of other packages among them, acts through its own formula (`looped`).
"""

from collections.abc import Callable, Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import Build, Coupling, Push, Transmission, last_body
from excite_cli.simulation.planted import Planted

_JOINT_PARTS = {"damping", "frictionloss", "armature", "stiffness", "springref"}
_ROTOR_SHARE = 0.5  # of the link's inertia, for a rotor whose size nobody said


def assemble(robot: Robot, phi: Array, run: RunId, planted: Iterable[Planted]) -> Build:
    """The robot of one run with the effects that are active in it."""
    build = Build.bare(robot, phi, run)
    for each in planted:
        if each.effect.active(run):
            _add(build, each)
    return build


def _add(build: Build, planted: Planted) -> None:
    effect = planted.effect
    mechanism = _MECHANISMS.get(effect.kind)
    parts = effect.mjcf(planted.values)
    if mechanism is not None:
        mechanism(build, planted)
    elif effect.data_defect:
        build.recorded.append(planted)
    elif parts and set(parts) <= _JOINT_PARTS and len(effect.joints) == 1:
        _joint_parts(build, effect.joints[0], parts)
        build.compensated.append(planted)
    else:
        build.looped.append(planted)
        build.compensated.append(planted)


def _joint_parts(build: Build, j: int, parts: dict[str, float]) -> None:
    """Attributes of MuJoCo's joint; several springs on a joint are one."""
    build.damping[j] += parts.get("damping", 0.0)
    build.friction[j] += parts.get("frictionloss", 0.0)
    build.armature[j] += parts.get("armature", 0.0)
    stiffness = parts.get("stiffness", 0.0)
    build.springs[j] += [stiffness, -stiffness * parts.get("springref", 0.0)]


def _coupled_friction(build: Build, planted: Planted) -> None:
    """The dry part is a tendon's friction; the viscous one has no such part and is looped."""
    build.compensated.append(planted)
    named = planted.named()
    first, second = planted.effect.joints
    if named["coulomb"] > 0.0:
        direction = 1.0 if named["direction"] > 0 else -1.0
        build.couplings.append(Coupling(first, second, direction, named["coulomb"]))
    viscous = planted.values * np.array([p.name == "viscous" for p in planted.effect.parameters])
    if viscous.any():
        build.looped.append(Planted(planted.effect, viscous))


def _elasticity(build: Build, planted: Planted) -> None:
    named = planted.named()
    for j in planted.effect.joints:
        stiffness = 1.0 / max(named["compliance"], 1e-9)
        rotor = _rotor(build, j, named["rotor_inertia"])
        inertia = build.link_inertia(j)
        damping = 2.0 * named["damping_ratio"] * np.sqrt(stiffness * inertia)
        given = named["rotor_inertia"] > 0.0
        build.soft[j] = Transmission(rotor, given, stiffness, float(damping))


def _backlash(build: Build, planted: Planted) -> None:
    named = planted.named()
    for j in planted.effect.joints:
        rotor = _rotor(build, j, named["rotor_inertia"])
        given = named["rotor_inertia"] > 0.0
        build.soft[j] = Transmission(rotor, given, play=named["gap"])


def _rotor(build: Build, j: int, given: float) -> float:
    return given if given > 0.0 else _ROTOR_SHARE * build.link_inertia(j)


def _base_tilt(build: Build, planted: Planted) -> None:
    """Gravity as the turned base sees it, R(δ)ᵀ g, about the two axes it is least along."""
    axes = np.delete(np.eye(3), int(np.argmax(np.abs(build.robot.model.gravity.linear))), axis=0)
    build.gravity = Rotation.from_rotvec(planted.values @ axes).inv().apply(build.gravity)


def _payload(build: Build, planted: Planted) -> None:
    build.phi[last_body(build)] += planted.values


def _encoder_offset(build: Build, planted: Planted) -> None:
    """What is recorded is the true angle less the offset."""
    build.position_offset[list(planted.effect.joints)] -= planted.values[0]


def _contact(build: Build, planted: Planted) -> None:
    named = planted.named()
    build.pushes.append(Push(np.array(planted.values), named["start"], named["end"]))


def _torque_offset(build: Build, planted: Planted) -> None:
    build.offset[list(planted.effect.joints)] += planted.values[0]


def _torque_gain(build: Build, planted: Planted) -> None:
    build.gain[list(planted.effect.joints)] += planted.values[0]


def _torque_delay(build: Build, planted: Planted) -> None:
    build.delay[list(planted.effect.joints)] += planted.values[0]


def _torque_saturation(build: Build, planted: Planted) -> None:
    """The reading saturates; with `actuator:1` the motor itself does, and tracking suffers."""
    named, joints = planted.named(), list(planted.effect.joints)
    if named["actuator"] > 0.0:
        build.clip[joints] = np.minimum(build.clip[joints], named["level"])
    else:
        build.reading[joints] = [named["sharpness"], named["level"]]


_MECHANISMS: dict[str, Callable[[Build, Planted], None]] = {
    "coupled_friction": _coupled_friction,
    "elasticity": _elasticity,
    "backlash": _backlash,
    "base_tilt": _base_tilt,
    "payload": _payload,
    "encoder_offset": _encoder_offset,
    "contact": _contact,
    "torque_offset": _torque_offset,
    "torque_gain": _torque_gain,
    "torque_delay": _torque_delay,
    "torque_saturation": _torque_saturation,
}
