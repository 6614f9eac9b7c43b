"""From what was recorded to what is meant: s, rad (m), and N·m at the joint.

With m the torque of the motors (`torque_sources`), g the gear ratios and S the shares of a coupled
transmission (`coupling`),

    tau = (I + S) diag(g) m        and, by virtual work,        q_motor = diag(g) (I + S)ᵀ q.

Motors that drive joints together (`robot.transmissions`) are next to the joints: then g, S and
signs are those of the motors that stand in a joint's place, and `motors` goes on from there.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.dataset import Array, Dataset, Finding, Mask, Run
from excite_cli.measurement.motors import Motors, at_motors
from excite_cli.measurement.torque_sources.base import per_joint
from excite_cli.measurement.torque_sources.catalogue import torque_source
from excite_cli.measurement.torque_sources.command import Command, DriveLaw, law_of

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
RADIANS = {"rad": 1.0, "deg": np.pi / 180}
METERS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


def check_motors(spec: MeasurementSpec, motors: Motors) -> None:
    """Raise ConfigError where `measurement` contradicts the robot's transmissions."""
    driven = set(motors.places.values())
    coupled = {*spec.coupling, *(k for shares in spec.coupling.values() for k in shares)} & driven
    if coupled:
        raise ConfigError(
            f"measurement.coupling: {', '.join(sorted(coupled))} is driven by "
            "robot.transmissions. Say it once, there."
        )
    for joint in spec.without_torque:
        j = motors.joints.index(joint)
        shown = np.linalg.inv(motors.matrix)[j] if at_motors("tau", spec) else np.zeros(0)
        for k in np.flatnonzero(shown):
            other = motors.joints[int(k)]
            if other not in spec.without_torque:
                raise ConfigError(
                    f"measurement.without_torque: without the torque of the motor "
                    f"'{motors.names[j]}', that of {other} is not known either. Name it there, too."
                )


def check_joints(spec: MeasurementSpec, joints: tuple[str, ...], torques: bool = True) -> None:
    """Raise ConfigError for a joint in `measurement` that the robot does not move."""
    named: dict[str, list[str]] = {
        "coupling": [*spec.coupling, *(k for shares in spec.coupling.values() for k in shares)],
        "sign": list(spec.sign),
        "position_sign": list(spec.position_sign),
        "velocity_sign": list(spec.velocity_sign),
        "offset": list(spec.offset),
        "without_torque": list(spec.without_torque),
        "angle": list(spec.angle) if isinstance(spec.angle, dict) else [],
        **{
            f"command.{key}": list(value)
            for key in ("kd", "limit")
            if isinstance(value := getattr(spec.command, key), dict)
        },
    }
    sizes: dict[str, object] = {
        key: getattr(spec, key) for key in ("gear_ratio", "torque_constant", "torque_unit")
    }
    sizes["command.kp"] = spec.command.kp
    sizes |= {f"motor.{key}": getattr(spec.motor, key) for key in ("resistance", "back_emf")}
    for key, value in sizes.items():
        if isinstance(value, dict):
            named[key] = list(value)
            missing = [joint for joint in joints if joint not in value]
            if missing:
                raise ConfigError(
                    f"measurement.{key}: no value for {', '.join(missing)}. Give one number for "
                    "all joints, or one for each."
                )
    for key, names in named.items():
        for name in names:
            if name not in joints:
                raise ConfigError(
                    f"measurement.{key}: '{name}' is not a moved joint."
                    f"{nearest(name, joints)} Moved joints: {', '.join(joints)}."
                )
    if torques and set(spec.without_torque) >= set(joints):
        raise ConfigError(
            "measurement.without_torque names every joint: nothing is left to fit, but for the "
            "wrench at the base of robot.base: floating with robot.rows: [base]."
        )
    for joint, shares in spec.coupling.items():
        unknown = [motor for motor in shares if motor in spec.without_torque]
        if unknown and joint not in spec.without_torque:
            raise ConfigError(
                f"measurement.coupling: a part of the torque of {joint} is that of {unknown[0]}, "
                f"which measurement.without_torque leaves out. Name {joint} there, too."
            )
    ratios = per_joint(spec.gear_ratio, joints)
    if not ratios.all():
        raise ConfigError("measurement.gear_ratio: a ratio of 0 means nothing.")
    if abs(np.linalg.det(np.eye(len(joints)) + _shares(spec, joints))) < 1e-9:
        raise ConfigError("measurement.coupling: these shares cannot be inverted.")


def given_law(spec: MeasurementSpec, joints: tuple[str, ...], asks: str) -> DriveLaw:
    """The law of drives that follow set points, whose gains the config gives.

    Raises
    ------
    ConfigError
        It does not, or names other joints; `asks` is what needs the law.
    """
    if spec.torque != Command.name or spec.command.kp is None:
        raise ConfigError(
            f"{asks}: it takes the gains of drives that follow set points. Give measurement.torque:"
            " command and measurement.command.kp, or leave it out."
        )
    check_joints(spec, joints)
    return law_of(spec, joints)


def to_joints(
    run: Run,
    spec: MeasurementSpec,
    joints: tuple[str, ...],
    revolute: Mask,
    motors: Motors | None = None,
) -> Run:
    """The run in s, rad (m) and N·m at the joints, as `spec` declares it."""
    ratio, shares = per_joint(spec.gear_ratio, joints), _shares(spec, joints)
    angle = np.where(revolute, angle_units(spec, joints), METERS[spec.length])
    back = np.linalg.inv(np.eye(len(joints)) + shares.T).T

    def at_joints(x: Array, sign: dict[str, Any]) -> Array:
        x = x * angle * per_joint(sign, joints)
        if spec.position == "motor":
            x = x / ratio @ back
            x = x if motors is None else motors.positions(x)
        return x

    offset = per_joint(spec.offset, joints, 0.0)
    q = at_joints(run.q, spec.position_sign) + offset
    dq = None if run.dq is None else at_joints(run.dq, spec.velocity_sign)
    extra, source = dict(run.extra), torque_source(spec)
    if "q_cmd" in source.channels:
        extra["q_cmd"] = at_joints(extra["q_cmd"], spec.position_sign) + offset
        if "v_cmd" in extra:
            extra["v_cmd"] = at_joints(extra["v_cmd"], spec.velocity_sign)
    run = replace(run, q=q, dq=dq, extra=extra)
    tau = source.torque(run, spec, joints)
    tau[:, [joint in spec.without_torque for joint in joints]] = 0.0
    if source.at_motor:
        tau = tau * ratio
    coupled = tau.copy()
    for j, k in np.argwhere(shares):  # not a product with S: 0 · NaN would spread over all joints
        coupled[:, j] += shares[j, k] * tau[:, k]
    converted = replace(run, tau=coupled, law=source.law(spec, joints))
    return converted if motors is None else motors.at_joints(converted, spec)


def with_torques(data: Dataset, spec: MeasurementSpec) -> Dataset:
    """Data in rad and N·m at the joints, where no torque was recorded with that of the source."""
    source = torque_source(spec)
    runs = []
    for run in data.runs:
        held = set(source.channels) <= set(run.extra)
        if held and not np.isfinite(run.tau).any():
            joints = data.joint_names[run.base_rows :]
            law = source.law(spec, joints)
            run = replace(run, tau=source.torque(run, spec, joints), law=law)
        runs.append(run)
    return replace(data, runs=tuple(runs))


def angle_units(spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
    """Rad in one unit of the file, of joints that turn, (n,)."""
    declared = spec.angle
    units = [declared.get(j, "rad") if isinstance(declared, Mapping) else declared for j in joints]
    return np.array([RADIANS[unit] if isinstance(unit, str) else unit for unit in units])


def in_step(run: Run, lag: float) -> Run:
    """An equidistant run whose torques are taken `lag` [s] later, where they belong."""
    if not lag or len(run.t) < 2:
        return run
    later = np.clip(run.t + lag, run.t[0], run.t[-1])
    tau = np.stack([np.interp(later, run.t, column) for column in run.tau.T], axis=1)
    at = np.clip(np.round((later - run.t[0]) / run.step).astype(int), 0, len(run.t) - 1)
    return replace(run, tau=tau, valid=None if run.valid is None else run.valid[at])


def declared(
    spec: MeasurementSpec, joints: tuple[str, ...], motors: Motors | None = None
) -> list[Finding]:
    """Findings about a declaration that contradicts itself."""
    findings = []
    if spec.preset is not None:
        text = f"read as {spec.preset} writes it (measurement.preset)"
        findings.append(Finding("preset", "note", text))
    ratio = per_joint(spec.gear_ratio, joints)
    if spec.torque == "motor" and (ratio == 1.0).all() and motors is None:
        text = (
            "measurement.torque is 'motor', and every gear_ratio is 1: give "
            "measurement.gear_ratio unless the motors drive the joints directly"
        )
        findings.append(Finding("no_ratio", "warning", text))
    at_motor = torque_source(spec).at_motor
    if not at_motor and spec.position == "link" and (ratio != 1.0).any():
        text = (
            "measurement.gear_ratio is given but not applied, for the torque is at the joint; "
            "write measurement.torque: motor if it is not"
        )
        findings.append(Finding("ratio_not_applied", "warning", text))
    unused = spec.torque not in ("current", "voltage", "duty")
    if unused and (per_joint(spec.torque_constant, joints) != 1.0).any():
        text = (
            "measurement.torque_constant is given but not applied: torque is none of 'current', "
            "'voltage', 'duty'"
        )
        findings.append(Finding("constant_not_applied", "warning", text))
    return findings


def _shares(spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
    """S (n, n): row j holds the shares of other motors in joint j's torque."""
    shares = np.zeros((len(joints), len(joints)))
    for joint, motors in spec.coupling.items():
        for motor, share in motors.items():
            shares[joints.index(joint), joints.index(motor)] = share
    return shares
