"""A trunk on two feet with two arms of two joints, as URDF, and its dynamics by MuJoCo.

The root floats; MuJoCo's inverse dynamics of that tree (a free joint, its own recursion) is what
all of this room is compared with.
"""

from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Robot, build_measured_robot
from tests.urdf_elements import joint, link, robot_text

Array = NDArray[np.float64]
FEET = ("left_sole", "right_sole")
_LIMITS = 'lower="-2" upper="2" velocity="3" effort="80"'


def _link(name: str, mass: float, center: str, moments: str) -> str:
    return link(name, mass, moments, center, turn="0.2 -0.1 0.3")


def _fixed(name: str, parent: str, place: str) -> str:
    return (
        f'<link name="{name}"/><joint name="{name}_mount" type="fixed"><parent link="{parent}"/>'
        f'<child link="{name}"/><origin {place}/></joint>'
    )


def _arm(side: str, y: float) -> str:
    upper, hand = f"{side}_upper", f"{side}_hand"
    return "".join(
        [
            _link(upper, 2.5, "0.02 0.01 -0.15", "0.04 0.05 0.02"),
            _link(hand, 1.4, "0.01 -0.02 -0.12", "0.02 0.025 0.01"),
            joint(
                f"{side}_shoulder", ("trunk", upper), f"0 {y} 0.4", "0 1 0", _LIMITS, turn="0.3 0 0"
            ),
            joint(f"{side}_elbow", (upper, hand), "0.02 0 -0.3", "1 0 0", _LIMITS),
        ]
    )


URDF = robot_text(
    "stander",
    _link("trunk", 25.0, "0.03 0.01 0.1", "1.2 1.0 0.5"),
    _fixed("left_sole", "trunk", 'xyz="0.02 0.1 -0.9" rpy="0 0 0.2"'),
    _fixed("right_sole", "trunk", 'xyz="0.02 -0.1 -0.9" rpy="0 0.1 -0.2"'),
    _fixed("unit", "trunk", 'xyz="-0.1 0.05 0.2" rpy="0.4 0.3 -1.0"'),
    _arm("left", 0.2),
    _arm("right", -0.2),
)


def write(folder: Path) -> Path:
    """The URDF in a folder."""
    path = folder / "stander.urdf"
    path.write_text(URDF, encoding="utf-8")
    return path


def stander(folder: Path, **more: object) -> Robot:
    """The robot of the data."""
    given = {"base": "floating", "rows": ("base", "joints"), **more}
    return build_measured_robot(RobotSpec(urdf=str(write(folder)), **given))  # type: ignore[arg-type]


@dataclass
class ByMujoco:
    """The same tree with a free joint."""

    spec: mujoco.MjSpec = field(init=False)

    def __post_init__(self) -> None:
        extra = '<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco></robot>'
        self.spec = mujoco.MjSpec.from_string(URDF.replace("</robot>", extra))
        self.spec.body("trunk").add_freejoint()
        self.model = self.spec.compile()
        self.data = mujoco.MjData(self.model)

    def forces(self, pose: tuple[Array, Rotation], joints: Array, v: Array, a: Array) -> Array:
        """Generalised forces (6 + n,): in the world at the root, about its own axes, joints.

        v, a: linear in the world, angular in axes of the root, joints.
        """
        data = self.data
        data.qpos[:3] = pose[0]
        data.qpos[3:7] = pose[1].as_quat(scalar_first=True)
        data.qpos[7:] = joints
        data.qvel[:], data.qacc[:] = v, a
        mujoco.mj_inverse(self.model, data)
        return np.array(data.qfrc_inverse)

    def jacobian(self, body: str) -> Array:
        """(6, 6 + n) of a body's frame at the last state: linear, angular, in its own axes."""
        body_id = self.model.body(body).id
        linear, angular = np.zeros((2, 3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, linear, angular, body_id)
        axes = self.data.xmat[body_id].reshape(3, 3)
        return np.vstack([axes.T @ linear, axes.T @ angular])


@dataclass(frozen=True)
class Swayed:
    """A log of the robot, and the motion behind it: coordinates q, v, a (T, 6 + n) of the data's
    robot (base first)."""

    run: Run
    q: Array
    v: Array
    a: Array


def swayed(samples: int = 800, step: float = 0.005, size: float = 0.02, seed: int = 3) -> Swayed:
    """Arms move and the base sways; wrenches at both soles, an estimator's pose, a unit's signals.

    The left sole's wrench is any; the right one's is what MuJoCo asks for beside it.
    """
    rng = np.random.default_rng(seed)
    t = step * np.arange(samples)
    rate = np.concatenate([rng.uniform(3.0, 8.0, 6), rng.uniform(1.0, 3.0, 4)])
    high = np.concatenate([np.full(6, size), np.full(4, 0.8)])
    angle = np.outer(t, rate) + rng.uniform(0, 6, 10)
    q = high * np.sin(angle)
    q[:, :6] -= q[:, :6].mean(axis=0)
    v, a = high * rate * np.cos(angle), -high * rate**2 * np.sin(angle)
    turned = Rotation.from_euler("ZYX", q[:, 3:6])
    spin, gained = _body_rates(q, v, a)
    robot = ByMujoco()
    gravity = np.array([0.0, 0.0, -9.81])
    wrenches = {foot: np.empty((samples, 6)) for foot in FEET}
    tau = np.empty((samples, 4))
    unit = robot.model.body("unit")
    place, axes = np.array(unit.pos), Rotation.from_quat(unit.quat, scalar_first=True).as_matrix()
    gyroscope, accelerometer = np.empty((2, samples, 3))
    for k in range(samples):
        vel = np.concatenate([v[k, :3], spin[k], v[k, 6:]])
        acc = np.concatenate([a[k, :3], gained[k], a[k, 6:]])
        needed = robot.forces((q[k, :3], turned[k]), q[k, 6:], vel, acc)
        left, right = (robot.jacobian(foot) for foot in FEET)
        wrenches["left_sole"][k] = rng.normal(size=6) * [20, 20, 100, 5, 5, 5]
        rest = needed - left.T @ wrenches["left_sole"][k]
        wrenches["right_sole"][k] = np.linalg.solve(right[:, :6].T, rest[:6])
        tau[k] = needed[6:]
        body = turned[k].inv()
        at = body.apply(a[k, :3] - gravity) + np.cross(gained[k], place)
        at += np.cross(spin[k], np.cross(spin[k], place))
        gyroscope[k], accelerometer[k] = axes.T @ spin[k], axes.T @ at
    extra = {
        **wrenches,
        "pose": np.column_stack([q[:, :3], turned.as_quat()]),
        "gyroscope": gyroscope,
        "accelerometer": accelerometer,
    }
    return Swayed(Run("sway", t, q[:, 6:], tau, v[:, 6:], extra=extra), q, v, a)


def _body_rates(q: Array, v: Array, a: Array, h: float = 1e-5) -> tuple[Array, Array]:
    """ω and ω̇ (T, 3) in axes of the root, from yaw, pitch, roll by differences of rotations."""

    def rotation(shift: float) -> Rotation:
        return Rotation.from_euler("ZYX", (q + v * shift + 0.5 * a * shift**2)[:, 3:6])

    def rate(shift: float) -> Array:
        turn = rotation(shift - h).inv() * rotation(shift + h)
        return np.asarray(turn.as_rotvec() / (2 * h))

    return rate(0.0), (rate(1e-4) - rate(-1e-4)) / 2e-4
