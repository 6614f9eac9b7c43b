"""The robot as the mathematics sees it: moved joints, measured rows, limits.

Locked and fixed joints are lumped into their parents by Pinocchio. With a floating base the base
pose is held at its reference (a stand or hoist carries the robot): the base adds six rows and its
body to the regressor, but no variable to the motion.
"""

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.arrays import Array as Array
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import ConfigError, RobotError
from excite_cli.measurement.motors import Motors, motors_of
from excite_cli.robot.assumed_inertias import with_assumed_inertias
from excite_cli.robot.base_joints import BASE_JOINTS, on_base_joints
from excite_cli.robot.carried_payload import CarriedPayload, add_payload, payload_on
from excite_cli.robot.description import RobotDescription, load_description
from excite_cli.robot.limits import (
    UNBOUNDED,
    JointRange,
    Limits,
    check_range,
    given_limits,
    limits_of,
)
from excite_cli.robot.loops import Mimic
from excite_cli.robot.parsed_model import parsed_model, reduced_model
from excite_cli.robot.posture import Coupling, posture_of, require_known

_FASTEST = 10.0  # where a robot has no bound of its own, samples are drawn below this


@dataclass(frozen=True)
class Robot:
    """A rigid-body model with `n` moved joints.

    `rows` are the rows of the inverse dynamics that are measured; `moved` the velocity indices of
    the moved joints; `reference` the configuration (nq,) at which everything else stands. The
    inertias of `model` include that of the `payload`; `description` knows nothing of it. The first
    `base_joints` joints are those of a base that moves (`base_joints.py`), and `held` is the same
    robot with that base held at its reference, for which motions are planned. With `visual_shapes`,
    the visual shapes of links without collision shapes count as such.

    Where joints follow others (`coupling`), `model` has all of them; `joint_names`, `rows` and
    `moved` count those that move on their own, and `tree` is the robot in which all would. `motors`
    drive several joints together; None where each joint has its own. `held_joints` are those of the
    `locked` ones that equal limits hold.
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
    payload: CarriedPayload | None = None
    visual_shapes: bool = False
    base_joints: int = 0
    held: "Robot | None" = None
    coupling: Coupling | None = None
    motors: Motors | None = None
    held_joints: tuple[str, ...] = ()

    @cached_property
    def tree(self) -> "Robot":
        """The robot in which all m joints that move do so on their own: those of its model.

        Itself where no joint follows another. `rows` are those that the measured rows consist of.
        """
        own = self.coupling
        if own is None:
            return self
        first = int(self.moved[0])
        base = self.rows[self.rows < first]
        followed = np.isin(own.driver, self.rows[self.rows >= first] - first)
        return replace(
            self,
            joint_names=own.joint_names,
            posture=own.positions(self.posture),
            rows=np.concatenate([base, first + np.flatnonzero(followed)]),
            moved=first + np.arange(len(own.driver)),
            limits=own.limits,
            coupling=None,
            motors=None,
        )

    @property
    def first_joint(self) -> int:
        """Index in `model` of the first joint that moves; those after it move as well."""
        return int(self.model.njoints) - self.tree.n

    @cached_property
    def model_joints(self) -> tuple[int, ...]:
        """Index (n,) in `model` of every moved joint; joint k carries body k − 1 of φ."""
        place = {name: k for k, name in enumerate(self.tree.joint_names)}
        return tuple(self.first_joint + place[name] for name in self.joint_names)

    @property
    def followers(self) -> tuple[tuple[str, ...], ...]:
        """For every moved joint (n,) the joints that follow it."""
        found: list[list[str]] = [[] for _ in self.joint_names]
        if self.coupling is not None:
            for name, j in zip(self.coupling.joint_names, self.coupling.driver, strict=True):
                if name != self.joint_names[j]:
                    found[j].append(name)
        return tuple(map(tuple, found))

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """For every moved joint (n,) the one that carries it, -1 for none; followers are passed."""
        own = {joint: k for k, joint in enumerate(self.model_joints)}
        found = []
        for joint in self.model_joints:
            above = int(self.model.parents[joint])
            while above > 0 and above not in own:
                above = int(self.model.parents[above])
            found.append(own.get(above, -1))
        return tuple(found)

    def all_positions(self, q: Array) -> Array:
        """Positions (..., m) of all joints that move, from those of the moved joints (..., n)."""
        return q if self.coupling is None else self.coupling.positions(q)

    def all_rates(self, v: Array) -> Array:
        """Speeds or accelerations (..., m) of all joints that move, from (..., n)."""
        return v if self.coupling is None else self.coupling.rates(v)

    def gathered(self, x: Array) -> Array:
        """Torques of the moved joints, or derivatives by them, (..., n) from all (..., m)."""
        return x if self.coupling is None else self.coupling.gathered(x)

    def gathered_rows(self, y: Array) -> Array:
        """Measured rows (T, R, ...) from the rows of the tree (T, R', ...) that they consist of."""
        if self.coupling is None:
            return y
        return np.asarray(np.einsum("tr...,rs->ts...", y, self._row_shares))

    def spread_rows(self, weights: Array) -> Array:
        """Weights (T, R', ...) of the tree's rows that are worth those of the rows (T, R, ...)."""
        if self.coupling is None:
            return weights
        return np.asarray(np.einsum("ts...,rs->tr...", weights, self._row_shares))

    @cached_property
    def _row_shares(self) -> Array:
        """What each row of the tree is to each measured row (R', R)."""
        assert self.coupling is not None
        first, joints = int(self.moved[0]), self.coupling.matrix
        every = np.eye(first + len(joints), first + self.n)
        every[first:, first:] = joints
        return every[np.ix_(self.tree.rows, self.rows)]

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
        names = [self.model.joints[joint].shortname() for joint in self.model_joints]
        return np.array(["JointModelP" in name for name in names])

    @property
    def row_names(self) -> tuple[str, ...]:
        """Name of each measured row."""
        base = ("base_fx", "base_fy", "base_fz", "base_mx", "base_my", "base_mz")
        names = (*base, *self.joint_names) if self.floating else self.joint_names
        return tuple(names[row] for row in self.rows)

    def configurations(self, q: Array) -> Array:
        """Pinocchio configurations (T, nq) for moved-joint positions (T, n)."""
        q = self.all_positions(q)
        if not self.floating:
            return np.ascontiguousarray(q)
        full = np.tile(self.reference, (len(q), 1))
        full[:, 7:] = q
        return full

    def velocities(self, v: Array) -> Array:
        """Pinocchio velocities (or accelerations) (T, nv) for those of the moved joints (T, n)."""
        v = self.all_rates(v)
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

    def with_gravity(self, gravity: Array) -> "Robot":
        """The same robot under another gravity (3,) [m/s²], in the frame of its base."""
        model = self.model.copy()
        model.gravity.linear = np.array(gravity)
        return replace(self, model=model)

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
                *([] if self.coupling is None else ["coupled"]),  # earlier versions locked them
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
    return _built(_dense(description, spec), spec)


def build_measured_robot(spec: RobotSpec, relative_to: Any = None) -> Robot:
    """The robot as its data show it: where the wrench at a base is measured, the base moves.

    That is `build_robot` but for `rows` with `base`: the first six joints are then those of the
    base, and `rows` what is measured of them and of the others.

    Raises
    ------
    RobotError, ConfigError
        See `build_robot`; the robot has joints of the names of the base's.
    """
    held = build_robot(spec, relative_to)
    if "base" not in spec.rows:
        return held
    description = load_description(spec.urdf, spec.package_dirs, relative_to, spec.xacro_args)
    joints = "all" if spec.joints == "all" else (*BASE_JOINTS, *spec.joints)
    fixed = spec.model_copy(update={"base": "fixed", "rows": ("joints",), "joints": joints})
    robot = _built(on_base_joints(_dense(description, spec)), fixed)
    count = len(BASE_JOINTS)
    rows = robot.rows if "joints" in spec.rows else robot.rows[:count]
    return replace(robot, rows=rows, base_joints=count, held=held)


def _dense(description: RobotDescription, spec: RobotSpec) -> RobotDescription:
    """With masses of links that have none, where a density is given."""
    if spec.density is None:
        return description
    return with_assumed_inertias(description, spec.density)


def _built(description: RobotDescription, spec: RobotSpec) -> Robot:
    full = parsed_model(description, spec)
    if spec.payload is not None:
        add_payload(full, payload_on(full, spec.payload))
    names = [str(name) for name in full.names[1:] if str(name) != "root_joint"]
    if spec.joints == "all":
        _check_types(full, names, description)
    mimicking = {name: own for name, own in description.mimicking.items() if name in names}
    asked = _chosen(spec, names, mimicking)
    _check_types(full, asked, description)
    # Joints of the base that slide or float stand still at neutral: they have no single value.
    others = [name for name in names if not _is_single(full, name)]
    names = [name for name in names if name not in others]
    given = given_limits(spec, names)
    alone = {name: _range_of(full, name).given(given.get(name)) for name in names}
    kept = _kept_ranges(alone, {n: own for n, own in mimicking.items() if n in names})
    chosen = asked if spec.joints != "all" else _not_held(asked, kept, description)
    followers = {
        name: own for name, own in mimicking.items() if own.driver in chosen and name in names
    }
    for name in chosen:
        theirs = [each for each, own in followers.items() if own.driver == name]
        check_range(name, alone[name], kept[name], theirs)
    ranges = {n: kept[n] if n in chosen or kept[n].held else alone[n] for n in names}
    posture = posture_of(spec, names, chosen, ranges, mimicking)
    reference = pin.neutral(full)
    for name in names:
        reference[full.joints[full.getJointId(name)].idx_q] = posture[name]
    if spec.base == "floating":
        rotation = pin.rpy.rpyToMatrix(*spec.base_orientation)
        reference[3:7] = pin.Quaternion(rotation).coeffs()
    moving = {*chosen, *followers}
    locked = [full.getJointId(name) for name in [*others, *names] if name not in moving]
    model = reduced_model(full, locked, reference) if locked else full
    model.gravity.linear = np.array(spec.gravity)
    every = tuple(n for n in map(str, model.names[1:]) if n != "root_joint")
    coupling = _coupling(every, followers, alone) if followers else None
    moved_names = tuple(name for name in every if name not in followers)
    floating = spec.base == "floating"
    moved = np.arange(len(moved_names)) + (6 if floating else 0)
    rows = np.concatenate(
        ([np.arange(6)] if "base" in spec.rows else []) + ([moved] if "joints" in spec.rows else [])
    )
    start = np.array([posture[name] for name in every])
    return Robot(
        name=description.name,
        description=description,
        model=model,
        joint_names=moved_names,
        posture=np.array([posture[name] for name in moved_names]),
        reference=_reduced_reference(model, start, reference[3:7]) if floating else start,
        rows=rows,
        moved=moved,
        floating=floating,
        limits=limits_of(moved_names, ranges),
        base_orientation=spec.base_orientation,
        locked={name: posture[name] for name in names if name not in moving},
        payload=None if spec.payload is None else payload_on(model, spec.payload),
        coupling=coupling,
        motors=motors_of(spec.transmissions, moved_names),
        held_joints=tuple(n for n in names if n not in moving and kept[n].held),
    )


def _reduced_reference(model: pin.Model, start: Array, orientation: Array) -> Array:
    """Configuration (nq,) of a floating robot at the joint positions `start`."""
    reduced = np.array(pin.neutral(model))
    reduced[3:7] = orientation
    reduced[7:] = start
    return reduced


def _kept_ranges(
    alone: dict[str, JointRange], followers: dict[str, Mimic]
) -> dict[str, JointRange]:
    """Ranges of all joints, narrowed for the joints that follow them."""
    kept = dict(alone)
    for name, own in followers.items():
        if own.driver in kept:
            kept[own.driver] = kept[own.driver].keeping(alone[name], own)
    return kept


def _not_held(
    names: list[str], ranges: dict[str, JointRange], description: RobotDescription
) -> list[str]:
    """Those of the joints that equal limits do not hold where they are."""
    free = [name for name in names if not ranges[name].held]
    if names and not free:
        raise RobotError(
            f"{description.path.name}: equal position limits hold every joint where it is, so "
            "there is nothing to move. Give others under robot.limits.<joint>.position."
        )
    return free


def _coupling(
    every: tuple[str, ...], followers: dict[str, Mimic], ranges: dict[str, JointRange]
) -> Coupling:
    """How the joints that move (m,) follow those of them that move on their own."""
    own = {name: k for k, name in enumerate(n for n in every if n not in followers)}
    mimics = [followers.get(name, Mimic(name, 1.0, 0.0)) for name in every]
    return Coupling(
        joint_names=every,
        driver=np.array([own[mimic.driver] for mimic in mimics]),
        multiplier=np.array([mimic.multiplier for mimic in mimics]),
        offset=np.array([mimic.offset for mimic in mimics]),
        limits=limits_of(every, ranges),
    )


def links_by_joint(robot: Robot) -> dict[str, list[str]]:
    """Links that each joint that moves carries directly, also those that follow others.

    Those fixed to the base stand under ''.
    """
    found: dict[str, list[str]] = {}
    moving = robot.tree.joint_names
    for frame in robot.model.frames:
        if frame.type == pin.FrameType.BODY:
            joint = str(robot.model.names[frame.parentJoint])
            found.setdefault(joint if joint in moving else "", []).append(str(frame.name))
    return found


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


def _chosen(spec: RobotSpec, names: list[str], mimicking: dict[str, Mimic]) -> list[str]:
    if spec.joints == "all":
        return [name for name in names if name not in mimicking]
    for joint in spec.joints:
        require_known(joint, names, "robot.joints")
        if joint in mimicking:
            raise ConfigError(
                f"robot.joints: '{joint}' mimics '{mimicking[joint].driver}' and moves with it. "
                f"Leave it out of robot.joints, and name '{mimicking[joint].driver}' there if it "
                "is to move."
            )
    return [name for name in names if name in spec.joints]


def _range_of(model: pin.Model, name: str) -> JointRange:
    """Limits that the URDF gives a joint."""
    joint = model.joints[model.getJointId(name)]
    lower = float(model.lowerPositionLimit[joint.idx_q])
    upper = float(model.upperPositionLimit[joint.idx_q])
    return JointRange.written(
        lower if lower > -UNBOUNDED else -np.inf,
        upper if upper < UNBOUNDED else np.inf,
        float(model.velocityLimit[joint.idx_v]) or np.inf,
        float(model.effortLimit[joint.idx_v]) or np.inf,
    )
