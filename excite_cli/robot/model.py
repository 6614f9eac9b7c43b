"""The robot as the mathematics sees it: moved joints, measured rows, limits.

Locked and fixed joints are lumped into their parents by Pinocchio. With a floating base the base
pose is held at its reference (a stand or hoist carries the robot): the base adds six rows and its
body to the regressor, but no variable to the motion.
"""

import hashlib
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.config.robot_spec import JointLimits, RobotSpec
from excite_cli.errors import ConfigError, RobotError, nearest
from excite_cli.robot.base_joints import BASE_JOINTS, on_base_joints
from excite_cli.robot.carried_payload import Payload, add_payload, payload_on
from excite_cli.robot.description import (
    UNBOUNDED,
    RobotDescription,
    load_description,
    require_limits,
)

Array = NDArray[np.float64]

# Where a robot has no bound of its own, samples are drawn from these.
_TURN, _FASTEST = np.pi, 10.0
_LINK = " (link)"


@dataclass(frozen=True)
class Limits:
    """Bounds of the moved joints, each of shape (n,); infinite where there is none."""

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    effort: Array

    def ranges(self) -> tuple[Array, Array]:
        """Finite positions (n,) to draw between: a turn where there is no bound, or only one."""
        low, high = np.isfinite(self.lower), np.isfinite(self.upper)
        lower = np.where(low, self.lower, np.where(high, self.upper - 2 * _TURN, -_TURN))
        return lower, np.where(high, self.upper, np.where(low, self.lower + 2 * _TURN, _TURN))


@dataclass(frozen=True)
class Robot:
    """A rigid-body model with `n` moved joints.

    `rows` are the rows of the inverse dynamics that are measured; `moved` the velocity indices of
    the moved joints; `reference` the configuration (nq,) at which everything else stands. The
    inertias of `model` include that of the `payload`; `description` knows nothing of it. The first
    `base_joints` joints are those of a base that moves (`base_joints.py`). With `visual_shapes`,
    the visual shapes of links without collision shapes count as such.
    """

    name: str
    description: RobotDescription
    model: pin.Model
    joint_names: tuple[str, ...]
    posture: Array
    reference: Array
    rows: NDArray[np.intp]
    moved: NDArray[np.intp]
    floating: bool
    limits: Limits
    base_orientation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    locked: dict[str, float] = field(default_factory=dict)
    payload: Payload | None = None
    visual_shapes: bool = False
    base_joints: int = 0

    @property
    def n(self) -> int:
        """Number of moved joints."""
        return len(self.joint_names)

    @property
    def n_bodies(self) -> int:
        """Number of bodies that carry inertial parameters."""
        return int(self.model.njoints) - 1

    @property
    def massless(self) -> int:
        """How many of the first bodies have no mass whatever a fit says: those between joints of
        the base."""
        return max(self.base_joints - 1, 0)

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Joints whose torque is none of the `rows`, of a robot whose base's are."""
        if not self.base_joints:
            return ()
        rows = set(self.rows.tolist())
        names = zip(self.moved.tolist(), self.joint_names, strict=True)
        return tuple(name for row, name in names if row not in rows)

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Which moved joints (n,) are prismatic."""
        first = self.model.njoints - self.n
        names = [self.model.joints[first + j].shortname() for j in range(self.n)]
        return np.array(["JointModelP" in name for name in names])

    @property
    def row_names(self) -> tuple[str, ...]:
        """Name of each measured row."""
        base = ("base_fx", "base_fy", "base_fz", "base_mx", "base_my", "base_mz")
        names = (*base, *self.joint_names) if self.floating else self.joint_names
        return tuple(names[row] for row in self.rows)

    def configurations(self, q: Array) -> Array:
        """Pinocchio configurations (T, nq) for moved-joint positions (T, n)."""
        if not self.floating:
            return np.ascontiguousarray(q)
        full = np.tile(self.reference, (len(q), 1))
        full[:, 7:] = q
        return full

    def velocities(self, v: Array) -> Array:
        """Pinocchio velocities (or accelerations) (T, nv) for those of the moved joints (T, n)."""
        if not self.floating:
            return np.ascontiguousarray(v)
        return np.hstack([np.zeros((len(v), 6)), v])

    def draw_states(self, count: int, seed: int) -> tuple[Array, Array, Array]:
        """`count` random positions, velocities and accelerations (count, n) within the limits.

        A base stands still: it sways by millimetres, which shows no inertia of its own.
        """
        rng = np.random.default_rng(seed)
        lower, upper = self.limits.ranges()
        speed = np.minimum(self.limits.velocity, _FASTEST)  # placeholders like 1e6 drown gravity
        q = rng.uniform(lower, upper, (count, self.n))
        v = rng.uniform(-speed, speed, (count, self.n))
        a = rng.uniform(-3 * speed, 3 * speed, (count, self.n))
        for x in (q, v, a):
            x[:, : self.base_joints] = 0.0
        return q, v, a

    def fingerprint(self) -> str:
        """Hash of what decides the regressor: URDF, moved joints, posture, base and rows.

        A payload is not part of it: it adds constants to φ and changes no column of Y.
        """
        text = "|".join(
            [
                self.description.sha256,
                ",".join(self.joint_names),
                ",".join(f"{joint}={value!r}" for joint, value in sorted(self.locked.items())),
                f"floating={self.floating}",
                ",".join(map(str, self.rows)),
                f"base={self.base_orientation}",
                np.array2string(np.asarray(self.model.gravity.linear)),
            ]
        )
        return hashlib.sha256(text.encode()).hexdigest()


def build_robot(spec: RobotSpec, relative_to: Any = None) -> Robot:
    """Build the robot that `spec` describes.

    Raises
    ------
    RobotError
        The URDF is missing or wrong, or uses a joint type that is not supported.
    ConfigError
        A joint is unknown, the posture leaves the limits, or limits cross.
    """
    description = load_description(spec.urdf, spec.package_dirs, relative_to, spec.xacro_args)
    return _built(description, spec)


def build_measured_robot(spec: RobotSpec, relative_to: Any = None) -> Robot:
    """The robot as its data show it: where the wrench at a base is measured, the base moves.

    That is `build_robot` but for `rows` with `base`: the first six joints are then those of the
    base, and `rows` what is measured of them and of the others.

    Raises
    ------
    RobotError, ConfigError
        See `build_robot`; the robot has joints of the names of the base's.
    """
    if "base" not in spec.rows:
        return build_robot(spec, relative_to)
    description = load_description(spec.urdf, spec.package_dirs, relative_to, spec.xacro_args)
    joints = "all" if spec.joints == "all" else (*BASE_JOINTS, *spec.joints)
    fixed = spec.model_copy(update={"base": "fixed", "rows": ("joints",), "joints": joints})
    robot = _built(on_base_joints(description), fixed)
    count = len(BASE_JOINTS)
    rows = robot.rows if "joints" in spec.rows else robot.rows[:count]
    return replace(robot, rows=rows, base_joints=count)


def _built(description: RobotDescription, spec: RobotSpec) -> Robot:
    full = _parse(description, spec)
    if spec.payload is not None:
        add_payload(full, payload_on(full, spec.payload))
    names = [str(name) for name in full.names[1:] if str(name) != "root_joint"]
    if spec.joints == "all":
        _check_types(full, names, description)
    chosen = _chosen(spec, names, description.mimicking)
    _check_types(full, chosen, description)
    # Joints of the base that slide or float stand still at neutral: they have no single value.
    others = [name for name in names if not _is_single(full, name)]
    names = [name for name in names if name not in others]
    limits_full = {name: _limits_of(full, name, spec.limits.get(name)) for name in names}
    _check_limits(chosen, limits_full)
    posture = _posture(spec, names, chosen, limits_full)
    reference = pin.neutral(full)
    for name in names:
        reference[full.joints[full.getJointId(name)].idx_q] = posture[name]
    if spec.base == "floating":
        rotation = pin.rpy.rpyToMatrix(*spec.base_orientation)
        reference[3:7] = pin.Quaternion(rotation).coeffs()
    locked = [full.getJointId(name) for name in [*others, *names] if name not in chosen]
    model = _reduced(full, locked, reference) if locked else full
    model.gravity.linear = np.array(spec.gravity)
    moved_names = tuple(n for n in map(str, model.names[1:]) if n != "root_joint")
    floating = spec.base == "floating"
    moved = np.arange(6, model.nv) if floating else np.arange(model.nv)
    rows = np.concatenate(
        ([np.arange(6)] if "base" in spec.rows else []) + ([moved] if "joints" in spec.rows else [])
    )
    start = np.array([posture[name] for name in moved_names])
    reduced = np.array(pin.neutral(model))
    if floating:
        reduced[3:7] = reference[3:7]
        reduced[7:] = start
    else:
        reduced = start.copy()
    columns = np.array([limits_full[name] for name in moved_names]).T
    return Robot(
        name=description.name,
        description=description,
        model=model,
        joint_names=moved_names,
        posture=start,
        reference=reduced,
        rows=rows,
        moved=moved,
        floating=floating,
        limits=Limits(*columns),
        base_orientation=spec.base_orientation,
        locked={name: posture[name] for name in names if name not in chosen},
        payload=None if spec.payload is None else payload_on(model, spec.payload),
    )


def _reduced(full: pin.Model, locked: list[int], reference: Array) -> pin.Model:
    """The model with joints locked at `reference`.

    Pinocchio finds a joint's frame by its name, which a link may have too: such links have another
    name meanwhile.
    """
    joints = {str(name) for name in full.names}
    for frame in full.frames:
        if frame.type == pin.FrameType.BODY and str(frame.name) in joints:
            frame.name = f"{frame.name}{_LINK}"
    model = pin.buildReducedModel(full, locked, reference)
    for frame in model.frames:
        frame.name = str(frame.name).removesuffix(_LINK)
    return model


def links_by_joint(robot: Robot) -> dict[str, list[str]]:
    """Links that each moved joint carries directly; those fixed to the base under ''."""
    found: dict[str, list[str]] = {}
    for frame in robot.model.frames:
        if frame.type == pin.FrameType.BODY:
            joint = str(robot.model.names[frame.parentJoint])
            found.setdefault(joint if joint in robot.joint_names else "", []).append(
                str(frame.name)
            )
    return found


def _parse(description: RobotDescription, spec: RobotSpec) -> pin.Model:
    require_limits(description)  # the parser would tell it to the terminal, not to us
    try:
        if spec.base == "floating":
            model = pin.buildModelFromXML(description.xml, pin.JointModelFreeFlyer())
        else:
            rotation = pin.rpy.rpyToMatrix(*spec.base_orientation)
            model = pin.buildModelFromXML(description.xml)
            if any(spec.base_orientation):
                _turn_base(model, rotation)
    except (RuntimeError, ValueError) as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else "no reason given"
        raise RobotError(f"{description.path} is not a URDF that can be used: {first}") from error
    if model.nv - (6 if spec.base == "floating" else 0) < 1:
        raise RobotError(f"{description.path} has no movable joint.")
    return model


def _turn_base(model: pin.Model, rotation: Array) -> None:
    turn = pin.SE3(rotation, np.zeros(3))
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = turn * model.jointPlacements[joint]
    model.inertias[0] = model.inertias[0].se3Action(turn)
    for frame in model.frames:
        if frame.parentJoint == 0:
            frame.placement = turn * frame.placement


def _check_types(model: pin.Model, names: list[str], description: RobotDescription) -> None:
    for name in names:
        if not _is_single(model, name):
            kind = model.joints[model.getJointId(name)].shortname()
            raise RobotError(
                f"{description.path.name}: joint '{name}' is of type {kind}; only revolute, "
                "continuous, prismatic and fixed joints can be used. To keep it still, name the "
                "joints to move under robot.joints."
            )


def _is_single(model: pin.Model, name: str) -> bool:
    """Whether a joint has one coordinate and one velocity."""
    joint = model.joints[model.getJointId(name)]
    return bool(joint.nv == 1 and joint.nq == 1)


def _chosen(spec: RobotSpec, names: list[str], mimicking: dict[str, str]) -> list[str]:
    if spec.joints == "all":
        return [name for name in names if name not in mimicking]
    for joint in spec.joints:
        _known(joint, names, "robot.joints")
        if joint in mimicking:
            raise ConfigError(
                f"robot.joints: '{joint}' mimics '{mimicking[joint]}' and does not move on its "
                "own; coupled joints are not modelled. Leave it out of robot.joints."
            )
    return [name for name in names if name in spec.joints]


def _inside(lower: float, upper: float) -> float:
    """The middle of the range, or a little off its only bound."""
    if np.isfinite(lower) and np.isfinite(upper):
        return (lower + upper) / 2
    return lower + 0.5 if np.isfinite(lower) else upper - 0.5


def _in_degrees(value: float) -> str:
    """A hint for those who wrote degrees."""
    if abs(value) <= 2 * np.pi:
        return ""
    return f"; angles are in radians, {value:g}° is {np.radians(value):.4g} rad"


def _known(joint: str, names: list[str], where: str) -> None:
    if joint not in names:
        raise ConfigError(
            f"{where}: the robot has no joint '{joint}'.{nearest(joint, names)} "
            f"Its joints: {', '.join(names)}."
        )


def _limits_of(model: pin.Model, name: str, given: JointLimits | None) -> list[float]:
    joint = model.joints[model.getJointId(name)]
    lower = float(model.lowerPositionLimit[joint.idx_q])
    upper = float(model.upperPositionLimit[joint.idx_q])
    lower = lower if lower > -UNBOUNDED else -np.inf
    upper = upper if upper < UNBOUNDED else np.inf
    velocity = float(model.velocityLimit[joint.idx_v]) or np.inf
    effort = float(model.effortLimit[joint.idx_v]) or np.inf
    acceleration = np.inf
    if given is not None:
        lower, upper = given.position or (lower, upper)
        velocity = given.velocity or velocity
        acceleration = given.acceleration or acceleration
        effort = given.effort or effort
    return [lower, upper, velocity, acceleration, effort]


def _check_limits(names: list[str], limits: dict[str, list[float]]) -> None:
    for name in names:
        lower, upper = limits[name][:2]
        if not lower < upper:
            raise ConfigError(
                f"robot: joint '{name}' has crossed or empty position limits "
                f"[{lower:g}, {upper:g}]. Give sensible ones under robot.limits.{name}.position, "
                "or leave the joint out of robot.joints."
            )


def _posture(
    spec: RobotSpec, names: list[str], chosen: list[str], limits: dict[str, list[float]]
) -> dict[str, float]:
    for joint in spec.posture:
        _known(joint, names, "robot.posture")
    for joint in spec.limits:
        _known(joint, names, "robot.limits")
    posture = {}
    for name in names:
        lower, upper = limits[name][:2]
        if name in spec.posture:
            value = float(spec.posture[name])
            if not lower <= value <= upper and (lower < upper or name in chosen):
                raise ConfigError(
                    f"robot.posture.{name}: {value:g} is outside its limits "
                    f"[{lower:g}, {upper:g}]. Give a value between them{_in_degrees(value)}."
                )
        else:
            value = 0.0 if lower <= 0.0 <= upper else _inside(lower, upper)
        posture[name] = value
    return posture
