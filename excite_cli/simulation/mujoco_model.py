"""A MuJoCo model of the robot, built from its tree: no meshes, no contacts, any inertias.

A joint between motor and link that is not stiff (elasticity, backlash) becomes two coordinates on
one axis, θ of the motor and δ of the transmission: the link stands at θ + δ, the rotor's inertia
sits on θ alone, the spring or the backlash acts on δ.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import TreeJoint, tree_of
from excite_cli.simulation.engine import load_mujoco

# A friction constraint this hard reaches its full force within micro-radians per second of slip.
_CRISP = (0.9999, 0.9999, 1e-3, 0.5, 2.0)
_LEAST_MASS = 1e-9
_TURNED = (0.8, 0.36, 0.48, 0.0)


@dataclass(frozen=True)
class Plant:
    """A compiled model and where things are in it.

    `motor` (n,) coordinates of the motors, `gear` (n,) those of the transmission (-1: stiff), and
    `bodies` (n,) MuJoCo's body that each joint carries.
    """

    model: Any
    motor: NDArray[np.intp]
    gear: NDArray[np.intp]
    bodies: NDArray[np.intp]

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
    for j, joint in enumerate(tree.joints):
        parent = spec.worldbody if joint.parent < 0 else placed[joint.parent]
        placed.append(_add_body(mujoco, parent, joint, j, j in set(soft)))
    for c, (first, second, factor) in enumerate(couplings):
        tendon = spec.add_tendon(name=f"coupling_{c}")
        tendon.wrap_joint(_motor_name(first), 1.0)
        tendon.wrap_joint(_motor_name(second), factor)
    model = spec.compile()
    model.opt.timestep = step
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.opt.gravity[:] = tree.gravity
    plant = Plant(
        model=model,
        motor=np.array([model.joint(_motor_name(j)).dofadr[0] for j in range(robot.n)]),
        gear=np.array(
            [model.joint(_gear_name(j)).dofadr[0] if j in soft else -1 for j in range(robot.n)]
        ),
        bodies=np.array([model.body(_body_name(j)).id for j in range(robot.n)]),
    )
    model.dof_armature[plant.motor[plant.gear < 0]] = 0.0  # a soft joint needs a rotor
    model.dof_solref[:] = [2 * step, 1.0]
    model.dof_solimp[:] = _CRISP
    if len(couplings):
        model.tendon_solref_fri[:] = [2 * step, 1.0]
        model.tendon_solimp_fri[:] = _CRISP
    set_inertias(plant, phi[PARAMETERS_PER_BODY * tree.first_body :])
    return plant


def set_inertias(plant: Plant, phi: Array) -> None:
    """Put the bodies' standard parameters φ (10·n,) into the model, as they are.

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


def _add_body(mujoco: Any, parent: Any, joint: TreeJoint, j: int, soft: bool) -> Any:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(joint.rotation).ravel())
    body = parent.add_body(name=_body_name(j), pos=joint.position, quat=quaternion)
    # Stand-ins of a general shape: the compiler must take no short cut that the real ones break.
    body.mass, body.inertia, body.ipos = 1.0, [1.0, 1.2, 1.4], [0.1, 0.2, 0.3]
    body.iquat = _TURNED
    body.explicitinertial = True
    kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.sliding else mujoco.mjtJoint.mjJNT_HINGE
    body.add_joint(name=_motor_name(j), type=kind, axis=joint.axis, armature=1.0)
    if soft:
        body.add_joint(name=_gear_name(j), type=kind, axis=joint.axis)
    return body


def _body_name(j: int) -> str:
    return f"body_{j}"


def _motor_name(j: int) -> str:
    return f"motor_{j}"


def _gear_name(j: int) -> str:
    return f"gear_{j}"
