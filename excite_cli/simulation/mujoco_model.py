"""A MuJoCo model of the robot, built from its tree: no meshes, no contacts, any inertias.

A joint between motor and link that is not stiff (elasticity, backlash) becomes two coordinates on
one axis, θ of the motor and δ of the transmission: the link stands at θ + δ, the rotor's inertia
sits on θ alone, the spring or the backlash acts on δ. A joint that follows another one (mimic) is
held where that stands by a constraint as hard as MuJoCo has.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.errors import optional_module
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import Tree, TreeJoint, tree_of

# MuJoCo, loaded where it is needed: it is an extra, and importing it takes a moment.


def load_mujoco() -> Any:
    """The module.

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    return optional_module(
        "mujoco",
        "Simulating needs MuJoCo, which is not installed. "
        "Install it with: pip install 'excite-cli[sim]'",
    )


@contextmanager
def silent_engine() -> Iterator[None]:
    """Within this context MuJoCo neither prints warnings nor writes MUJOCO_LOG.TXT.

    What they would tell is checked here, and told in our words.
    """
    mujoco = load_mujoco()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)


# A friction constraint this hard reaches its full force within micro-radians per second of slip.
_CRISP = (0.9999, 0.9999, 1e-3, 0.5, 2.0)
_LEAST_MASS = 1e-9
_TURNED = (0.8, 0.36, 0.48, 0.0)


@dataclass(frozen=True)
class Plant:
    """A compiled model and where things are in it.

    `motor` (n,) coordinates of the motors, `gear` (n,) those of the transmission (-1: stiff), and
    `bodies` (m,) MuJoCo's body that each joint carries that moves. All coordinates (nv,) are
    `spread` (nv, k) times those that move on their own, the motors' first, plus `offset` (nv,).
    """

    model: Any
    motor: NDArray[np.intp]
    gear: NDArray[np.intp]
    bodies: NDArray[np.intp]
    spread: Array
    offset: Array

    @property
    def coupled(self) -> bool:
        """Whether joints follow others."""
        return len(self.offset) > self.spread.shape[1]

    def coordinates(self, motors: Array) -> Array:
        """All coordinates (nv,) with the motors at (n,) and transmissions at rest."""
        return np.asarray(self.spread[:, : len(motors)] @ motors + self.offset)

    def new_data(self) -> Any:
        """A fresh state."""
        return load_mujoco().MjData(self.model)


def build_plant(
    robot: Robot,
    phi: Array,
    step: float = 5e-4,
    soft: Sequence[int] = (),
    couplings: Sequence[tuple[int, int, float]] = (),
) -> Plant:
    """Compile the robot with inertias φ (10·n_bodies,), physics step `step` [s].

    `soft`: joints with a transmission of their own; their rotors have 1 kg·m² (armature) until
    another is set. `couplings` (j, k, c): a tendon whose length
    is q_j + c q_k, for friction between two joints.
    """
    mujoco = load_mujoco()
    tree = tree_of(robot)
    spec = mujoco.MjSpec()
    placed: list[Any] = []
    places = _places(robot, tree)
    for k, joint in enumerate(tree.joints):
        parent = spec.worldbody if joint.parent < 0 else placed[joint.parent]
        placed.append(_add_body(mujoco, parent, joint, k, places[k], places[k] in set(soft)))
    followers = [k for k, place in enumerate(places) if place < 0]
    for k in followers:
        _hold(mujoco, spec, tree.joints[k], k, tree.joints[k].driver in set(soft))
    for c, (first, second, factor) in enumerate(couplings):
        tendon = spec.add_tendon(name=coupling_name(c))
        tendon.wrap_joint(_motor_name(first), 1.0)
        tendon.wrap_joint(_motor_name(second), factor)
    model = spec.compile()
    model.opt.timestep = step
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.opt.gravity[:] = tree.gravity
    motor = np.array([model.joint(_motor_name(j)).dofadr[0] for j in range(robot.n)])
    gear = np.array(
        [model.joint(_gear_name(j)).dofadr[0] if j in soft else -1 for j in range(robot.n)]
    )
    spread, offset = np.zeros((model.nv, robot.n + len(soft))), np.zeros(model.nv)
    own = [*motor, *gear[gear >= 0]]
    spread[own, np.arange(len(own))] = 1.0
    for k in followers:
        joint, at = tree.joints[k], model.joint(_follower_name(k)).dofadr[0]
        driven = spread[motor[joint.driver]]
        if gear[joint.driver] >= 0:
            driven = driven + spread[gear[joint.driver]]
        spread[at], offset[at] = joint.multiplier * driven, joint.offset
    plant = Plant(
        model=model,
        motor=motor,
        gear=gear,
        bodies=np.array([model.body(_body_name(k)).id for k in range(len(tree.joints))]),
        spread=spread,
        offset=offset,
    )
    rotors = plant.motor[plant.gear >= 0]
    model.dof_armature[np.setdiff1d(np.arange(model.nv), rotors)] = 0.0  # soft joints need one
    model.dof_solref[:] = [2 * step, 1.0]
    model.dof_solimp[:] = _CRISP
    model.eq_solref[:] = [2 * step, 1.0]
    if len(couplings):
        model.tendon_solref_fri[:] = [2 * step, 1.0]
        model.tendon_solimp_fri[:] = _CRISP
    set_inertias(plant, phi[PARAMETERS_PER_BODY * tree.first_body :])
    return plant


def set_inertias(plant: Plant, phi: Array) -> None:
    """Put the bodies' standard parameters φ (10·m,) into the model, as they are.

    They are set after compilation: MuJoCo's compiler refuses what no mass distribution has, and
    URDFs are full of such bodies.
    """
    mujoco = load_mujoco()
    model = plant.model
    for body, ten in zip(plant.bodies, phi.reshape(-1, PARAMETERS_PER_BODY), strict=True):
        mass, lever, moments, axes = principal(ten)
        model.body_mass[body] = mass
        model.body_ipos[body] = lever
        model.body_inertia[body] = moments
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
        model.body_iquat[body] = quaternion
    refresh(plant)


def refresh(plant: Plant) -> None:
    """Let MuJoCo recompute what it derives from masses and armatures."""
    mujoco = load_mujoco()
    mujoco.mj_setConst(plant.model, plant.new_data())


def principal(ten: Array) -> tuple[float, Array, Array, Array]:
    """Mass, centre of mass (3,), principal moments (3,) and axes (3, 3) of ten parameters."""
    mass, first = float(ten[0]), np.asarray(ten[1:4])
    ixx, ixy, iyy, ixz, iyz, izz = ten[4:]
    about_origin = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    lever = first / mass if abs(mass) > _LEAST_MASS else np.zeros(3)
    about_center = about_origin - mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    moments, axes = np.linalg.eigh(about_center)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return mass, lever, moments, axes


def _places(robot: Robot, tree: Tree) -> list[int]:
    """For every joint of the tree its place among the moved joints, -1 for one that follows."""
    own = {name: j for j, name in enumerate(robot.joint_names)}
    return [own.get(joint.name, -1) for joint in tree.joints]


def _hold(mujoco: Any, spec: Any, joint: TreeJoint, k: int, soft: bool) -> None:
    """Let joint k of the tree follow its driver: q − multiplier · q_driver = offset."""
    tendon = spec.add_tendon(name=_follower_name(k))
    tendon.wrap_joint(_follower_name(k), 1.0)
    tendon.wrap_joint(_motor_name(joint.driver), -joint.multiplier)
    if soft:
        tendon.wrap_joint(_gear_name(joint.driver), -joint.multiplier)
    held = spec.add_equality(name=_follower_name(k))
    held.type, held.name1 = mujoco.mjtEq.mjEQ_TENDON, _follower_name(k)
    held.data[:5] = [joint.offset, 0.0, 0.0, 0.0, 0.0]
    held.solimp = _CRISP


def _add_body(mujoco: Any, parent: Any, joint: TreeJoint, k: int, j: int, soft: bool) -> Any:
    """Body k of the tree, on the moved joint j or, for -1, on one that follows."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(joint.rotation).ravel())
    body = parent.add_body(name=_body_name(k), pos=joint.position, quat=quaternion)
    # Stand-ins of a general shape: the compiler must take no short cut that the real ones break.
    body.mass, body.inertia, body.ipos = 1.0, [1.0, 1.2, 1.4], [0.1, 0.2, 0.3]
    body.iquat = _TURNED
    body.explicitinertial = True
    kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.sliding else mujoco.mjtJoint.mjJNT_HINGE
    name = _motor_name(j) if j >= 0 else _follower_name(k)
    body.add_joint(name=name, type=kind, axis=joint.axis, armature=1.0)
    if soft:
        body.add_joint(name=_gear_name(j), type=kind, axis=joint.axis)
    return body


def coupling_name(c: int) -> str:
    """The tendon of a coupling's friction."""
    return f"coupling_{c}"


def _body_name(j: int) -> str:
    return f"body_{j}"


def _motor_name(j: int) -> str:
    return f"motor_{j}"


def _follower_name(k: int) -> str:
    return f"follower_{k}"


def _gear_name(j: int) -> str:
    return f"gear_{j}"
