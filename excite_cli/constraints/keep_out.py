"""Regions of joint space to stay out of: boxes over some joints, the others at any value.

A posture is outside a region if at least one of its joints is: margin = max over its joints of
max(from − q, q − to), which is negative inside: minus the way to its nearest side. Positions are
taken as they are; a region does not repeat after a turn.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from excite_cli.config.constraints_spec import KeepOutSpec
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import ConfigError, nearest
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.robot.model import Robot

_SCALE = 0.2  # [rad or m]


@dataclass(frozen=True, eq=False)
class Region:
    """low ≤ q_j ≤ high for the moved joints j of `joints` (k,); `low`, `high` (k,) [rad or m]."""

    name: str
    joints: Indices
    low: Array
    high: Array


class KeepOut(Constraint):
    """One column per region."""

    name = "keep_out"
    title = "Outside the regions of joint space"
    unit = "rad"

    def __init__(self, robot: Robot, regions: tuple[Region, ...]) -> None:
        self.regions = regions
        self.labels = tuple(region.name for region in regions)
        self.scale = np.full(len(regions), _SCALE)
        self._names, self._sliding = robot.joint_names, robot.sliding

    @classmethod
    def build(cls, spec: dict[str, KeepOutSpec], setting: Setting) -> Iterable[Constraint]:
        """Of the regions, those that can be entered."""
        constraint = build_keep_out(spec, setting.robot)
        return [] if constraint is None else [constraint]

    def unit_of(self, column: int) -> str:
        """Metres where all joints of the region slide; both names where some do."""
        sliding = self._sliding[self.regions[column].joints]
        return "m" if sliding.all() else "rad or m" if sliding.any() else self.unit

    def margins(self, states: States) -> Array:
        """How far outside (T, m) [rad or m]."""
        return np.column_stack(
            [self._sides(region, states.q).max(axis=1) for region in self.regions]
        )

    def least(self, motion: EnclosedMotion) -> Array:
        """The farthest that one side stays outside throughout an interval (T, m)."""
        found = []
        for region in self.regions:
            at = motion.states.q[:, region.joints]
            sides = np.hstack([region.low - at.upper(), at.lower() - region.high])
            found.append(sides.max(axis=1))
        return np.column_stack(found)

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """−1 or 1 at the joint that is farthest outside."""
        rows = np.zeros((len(times), states.q.shape[1]))
        for column, region in enumerate(self.regions):
            some = np.flatnonzero(columns == column)
            active = self._sides(region, states.q[times[some]]).argmax(axis=1)
            size = len(region.joints)
            rows[some, region.joints[active % size]] = np.where(active < size, -1.0, 1.0)
        return rows, None, None

    def why_not(self, states: States) -> str:
        """In which region, with the joints' values."""
        for region, margin in zip(self.regions, self.margins(states)[0], strict=True):
            if margin < 0:
                values = ", ".join(
                    f"{self._names[j]} {states.q[0, j]:.3f} in [{low:g}, {high:g}]"
                    for j, low, high in zip(region.joints, region.low, region.high, strict=True)
                )
                return (
                    f"the robot is in the region '{region.name}' ({values}). Give another "
                    f"robot.posture, or correct constraints.keep_out.{region.name}"
                )
        return ""

    @staticmethod
    def _sides(region: Region, q: Array) -> Array:
        """from − q of all its joints, then q − to, (T, 2k)."""
        at = q[:, region.joints]
        return np.hstack([region.low - at, at - region.high])


def build_keep_out(spec: dict[str, dict[str, tuple[float, float]]], robot: Robot) -> KeepOut | None:
    """The constraint; None if no region of `spec` can be entered.

    Joints that do not move count with the value at which they are locked: such a region is either
    bounded by its other joints alone, or never entered.

    Raises
    ------
    ConfigError
        A joint is unknown, or a region leaves no position to the joints that bound it.
    """
    found = [region for name, one in spec.items() if (region := _region(name, one, robot))]
    return KeepOut(robot, tuple(found)) if found else None


def _region(name: str, spec: dict[str, tuple[float, float]], robot: Robot) -> Region | None:
    where = f"constraints.keep_out.{name}"
    known = [*robot.joint_names, *robot.locked]
    for joint in spec:
        if joint in robot.tree.joint_names and joint not in robot.joint_names:
            raise ConfigError(
                f"{where}: joint '{joint}' follows another one (mimic). Name its driver, with the "
                "positions of that one."
            )
        if joint not in known:
            raise ConfigError(
                f"{where}: the robot has no joint '{joint}'.{nearest(joint, known)} "
                f"Its joints: {', '.join(known)}."
            )
    for joint, (low, high) in spec.items():
        if joint in robot.locked and not low <= robot.locked[joint] <= high:
            return None
    joints = [robot.joint_names.index(joint) for joint in spec if joint not in robot.locked]
    bounds = np.array([spec[robot.joint_names[j]] for j in joints]).reshape(-1, 2)
    low, high = np.ascontiguousarray(bounds.T)
    limits = robot.limits
    if np.all(low <= limits.lower[joints]) and np.all(high >= limits.upper[joints]):
        raise ConfigError(
            f"{where}: the region covers all positions of {', '.join(spec)}, so the robot is "
            "always in it. Narrow it, or add the joint that leads out of it."
        )
    return Region(name, np.array(joints, dtype=np.intp), low, high)
