"""The whole robot in MuJoCo, on a free base that is made to stand still: an independent reference.

MuJoCo's inverse dynamics then gives the torques of the joints and the wrench at the base, which is
what the ground must give. Body 0 of φ is the base; only robots with a fixed base.
"""

from typing import Any

import mujoco
import numpy as np

from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import tree_of
from excite_cli.simulation.mujoco_model import principal


class WholePlant:
    """Inverse dynamics of `robot` with inertias φ (10·(1 + n_bodies),) of the whole robot."""

    def __init__(self, robot: Robot) -> None:
        assert not robot.floating
        tree = tree_of(robot)
        spec = mujoco.MjSpec()
        base = spec.worldbody.add_body(name="base")
        _stand_in(base)
        base.add_freejoint()
        placed: list[Any] = []
        for j, joint in enumerate(tree.joints):
            quaternion = np.empty(4)
            mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(joint.rotation).ravel())
            parent = base if joint.parent < 0 else placed[joint.parent]
            body = parent.add_body(name=f"body_{j}", pos=joint.position, quat=quaternion)
            _stand_in(body)
            slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
            body.add_joint(
                name=f"joint_{j}", type=slide if joint.sliding else hinge, axis=joint.axis
            )
            placed.append(body)
        self.model = spec.compile()
        self.model.opt.gravity[:] = tree.gravity
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.data = mujoco.MjData(self.model)
        mujoco.set_mju_user_warning(lambda text: None)  # of corners that no real body has
        self.bodies = [self.model.body("base").id]
        self.bodies += [self.model.body(f"body_{j}").id for j in range(robot.n)]
        self.n = robot.n

    def set_inertias(self, phi: Array) -> None:
        """Put φ into the model."""
        for body, ten in zip(self.bodies, phi.reshape(-1, 10), strict=True):
            mass, lever, moments, axes = principal(ten)
            self.model.body_mass[body] = mass
            self.model.body_ipos[body] = lever
            self.model.body_inertia[body] = moments
            mujoco.mju_mat2Quat(self.model.body_iquat[body], np.ascontiguousarray(axes).ravel())
        # All that inverse dynamics needs of mj_setConst, which warns of inertias that are not real.
        subtree = self.model.body_mass.copy()
        for body in range(self.model.nbody - 1, 0, -1):
            subtree[self.model.body_parentid[body]] += subtree[body]
        self.model.body_subtreemass[:] = subtree

    def inverse(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Torques (T, n), wrench about the world origin (T, 6), centre of mass (T, 3)."""
        torques, wrenches, centers = [], [], []
        data = self.data
        for qt, vt, at in zip(q, v, a, strict=True):
            data.qpos[:] = [0, 0, 0, 1, 0, 0, 0, *qt]
            data.qvel[:] = [0, 0, 0, 0, 0, 0, *vt]
            data.qacc[:] = [0, 0, 0, 0, 0, 0, *at]
            mujoco.mj_inverse(self.model, data)
            torques.append(data.qfrc_inverse[6:].copy())
            wrenches.append(data.qfrc_inverse[:6].copy())
            centers.append(data.subtree_com[self.bodies[0]].copy())
        return np.array(torques), np.array(wrenches), np.array(centers)


def _stand_in(body: Any) -> None:
    """Any inertia: the real one comes later, and may be none that the compiler accepts."""
    body.mass, body.inertia, body.ipos = 1.0, [1.0, 1.2, 1.4], [0.1, 0.2, 0.3]
    body.iquat = (0.8, 0.36, 0.48, 0.0)
    body.explicitinertial = True
