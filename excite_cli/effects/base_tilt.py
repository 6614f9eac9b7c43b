"""A base that does not stand as the model says: gravity comes from another direction.

With the base turned by small angles δ about the axes of the world, gravity in the model's frame
becomes R(δ)ᵀ g ≈ g − δ × g, and the torque, linear in gravity, changes by G (−δ × g) with G the
torque per unit of gravity along each axis, of bodies that are carried as well. Turning about
gravity itself changes nothing, so there are two angles: roll about x and pitch about y where
gravity is along z. On a robot whose gravity lies along another axis, roll and pitch are about the
other two, in the order x, y, z.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Cotangents, Effect, Parameter, Scope, Signals
from excite_cli.effects.mechanism import MjcfParts, all_joints, reals
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array, Robot

_MISSED = 0.03  # of the tilt, one standard deviation
_SEEN = "a base that leans by more than 0.2 rad is visible, and the columns fail there"


class BaseTilt(Effect):
    """The base is turned by roll about world x and pitch about world y; shows in all rows."""

    kind: ClassVar = "base_tilt"
    title: ClassVar = "tilted base"
    signature: ClassVar = "residuals on many joints that depend on the posture like gravity does"
    scope: ClassVar[Scope] = "robot"
    parameters: ClassVar = (
        Parameter("roll", "rad", 1e-3, 0.2, believed=(-0.2, 0.2), because=_SEEN),
        Parameter("pitch", "rad", 1e-3, 0.2, believed=(-0.2, 0.2), because=_SEEN),
    )
    usual: ClassVar = True
    can_appear_later: ClassVar = True

    def model_error(self, values: Array) -> Array:
        """What those moments make of the angles; measured on simulated arms."""
        return np.full(2, _MISSED * float(np.linalg.norm(values)))

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """Gravity as the turned base sees it, R(δ)ᵀ g."""
        from scipy.spatial.transform import Rotation  # slow to import; only a simulation needs it

        turned = Rotation.from_rotvec(values @ _axes(robot.robot)).inv()
        robot.gravity = turned.apply(robot.gravity)

    def columns(self, signals: Signals) -> Array:
        """G (−axis × g) for both axes, (T, n, 2)."""
        return signals.whole_body.gravity_axes @ _changes(signals.body.robot).T

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """Gravity that is turned."""
        return all_joints(f"tilted({reals(values)}, q, out)")

    def put_into_mjcf(self, parts: MjcfParts, values: Array) -> bool:
        """Gravity as the turned base sees it, to first order, as in `columns`."""
        along = int(np.argmax(np.abs(parts.gravity)))
        axes = np.delete(np.eye(3), along, axis=0)
        parts.gravity = parts.gravity - np.cross(values @ axes, parts.gravity)
        return True

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """The derivative of gravity's torque by position, gravity being −axis × g."""
        back = np.zeros_like(signals.q)
        still, body = np.zeros_like(signals.q), signals.whole_body
        robot = body.robot
        for p, change in enumerate(_changes(robot)):
            model = robot.model.copy()
            model.gravity.linear = change
            turned = RigidBody(replace(robot, model=model), body.phi, signals.q, still, still)
            back += np.einsum("tr,trk->tk", weights[:, :, p], turned.by_position)
        return Cotangents(q=back)


def _changes(robot: Robot) -> Array:
    """Change of gravity (2, 3) per radian of roll and of pitch."""
    return -np.cross(_axes(robot), np.array(robot.model.gravity.linear, dtype=float))


def _axes(robot: Robot) -> Array:
    """The two axes of the world (2, 3) that gravity is least along."""
    along = int(np.argmax(np.abs(robot.model.gravity.linear)))
    return np.delete(np.eye(3), along, axis=0)
