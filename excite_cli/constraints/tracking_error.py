"""Bounds on how far set points are from positions, for drives that make torque of that.

With τ = kp (q* − q) + kd (v* − v) a joint moves as planned where

    q* − q = (τ + kd (v − v*)) / kp,    v* = v where the drive gets speeds, else 0,

so |q* − q| ≤ e is the bound kp e − kd v on the torque of a joint that drives (kp e where it
brakes, which asks for less). Friction, which the URDF's inertias do not show, comes on top.
"""

from collections.abc import Iterable

import numpy as np

from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.torque import given_law
from excite_cli.measurement.torque_sources.base import per_joint
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.model import Robot


class TrackingError(Constraint):
    """|q* − q| ≤ `most` (n,) [rad or m], infinite: not bounded; columns as those of the torque.

    Gains `kp` [N·m/rad] and `kd` [N·m·s/rad] (n,), of sliding joints N/m and N·s/m; kd is 0 where
    set points have speeds.
    """

    name = "tracking_error"
    of_forces = True
    title = "Set point to its largest distance"
    unit = "rad"

    def __init__(
        self,
        robot: Robot,
        most: Array,
        kp: Array,
        kd: Array,
        uncertainty: InertiaUncertainty | None = None,
    ) -> None:
        curves = [EffortCurve.falling(*each) for each in zip(kp * most, kd, strict=True)]
        self._torque, self.uncertainty = JointTorque(robot, curves, uncertainty), uncertainty
        joints = self._torque.of_joints.joints
        self._kp, self._sliding = kp[joints], robot.sliding[joints]
        self.labels, self.scale = self._torque.labels, most[joints]

    @classmethod
    def build(cls, given: float | dict[str, float], setting: Setting) -> Iterable[Constraint]:
        """With the gains of the config's drives.

        Raises
        ------
        ConfigError
            There are none, or a joint is not one of those that move.
        """
        names, measurement = setting.robot.joint_names, setting.measurement
        law = given_law(measurement, names, "constraints.tracking_error")
        for name in given if isinstance(given, dict) else ():
            if name not in names:
                raise ConfigError(
                    f"constraints.tracking_error: '{name}' is not a moved joint."
                    f"{nearest(name, names)} Moved joints: {', '.join(names)}."
                )
        kd = 0.0 * law.kd if measurement.command.set_point_speeds else law.kd
        bounds = per_joint(given, names, np.inf)
        return [cls(setting.robot, bounds, law.kp, kd, setting.uncertainty)]

    def unit_of(self, column: int) -> str:
        """Metres for a prismatic joint."""
        return "m" if self._sliding[column] else self.unit

    def margins(self, states: States) -> Array:
        """What is left of the torque (T, m), over kp."""
        return np.asarray(self._torque.margins(states) / self._kp)

    def margins_at_rest(self, states: States) -> Array:
        """The same at rest, with what is allowed at the speed of `states`."""
        return np.asarray(self._torque.margins_at_rest(states) / self._kp)

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on the margins (T, m), for every admitted inertia."""
        return np.asarray(self._torque.least(motion) / self._kp)

    def least_at_rest(self, motion: EnclosedMotion) -> Array:
        """The same of `margins_at_rest`."""
        return np.asarray(self._torque.least_at_rest(motion) / self._kp)

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Those of the torque left, over kp."""
        return self._over_kp(self._torque.gradients(states, times, columns), columns)

    def gradients_at_rest(self, states: States, times: Indices, columns: Indices) -> Parts:
        """The same of `margins_at_rest`."""
        return self._over_kp(self._torque.gradients_at_rest(states, times, columns), columns)

    def _over_kp(self, parts: Parts, columns: Indices) -> Parts:
        shares = self._kp[columns][:, None]
        return tuple(None if part is None else part / shares for part in parts)
