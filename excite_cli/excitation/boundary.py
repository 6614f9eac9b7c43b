"""Where a motion starts and ends, as an affine set of coefficients.

With E the rows of the basis (position where it is given, velocity, acceleration) at t = 0 and T,

    E α = [q_start; q_end; 0; 0; 0; 0]   ⇔   α = α_0 + N β,   E N = 0

and α_0 the straight motion: q(t) = q_start + s(t) (q_end − q_start), s the member of the family
with the smallest mean square of acceleration. For equal postures that is standing there.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from excite_cli.config.trajectory_spec import BSplineSpec, FourierSpec, Posture
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.model import Array, Robot
from excite_cli.trajectory.base import Trajectory

_INSTANTS_PER_FUNCTION = 16


@dataclass(frozen=True)
class Boundary:
    """Given postures (n,), None where they are free; free directions N (K, K'); α_0 (K, n)."""

    start: Array | None
    end: Array | None
    free: Array
    offset: Array

    @property
    def given(self) -> bool:
        """Whether a posture is given at either end."""
        return self.start is not None or self.end is not None

    @property
    def postures(self) -> Array:
        """The given ones, (0 to 2, n)."""
        found = [posture for posture in (self.start, self.end) if posture is not None]
        return np.array(found).reshape(len(found), self.offset.shape[1])


def build_boundary(
    spec: FourierSpec | BSplineSpec, robot: Robot, trajectory: Trajectory
) -> Boundary:
    """What `spec` asks of start and end of `trajectory`; a Fourier series ends where it starts.

    Raises
    ------
    ConfigError
        A posture names an unknown joint or leaves the limits.
    """
    start = end = None
    if spec.start is not None:
        start = posture_of(robot, spec.start, "trajectory.start")
    if isinstance(spec, FourierSpec):
        end = start
    elif spec.end is not None:
        end = posture_of(robot, spec.end, "trajectory.end")
    return boundary_between(trajectory, start, end, robot.n)


def boundary_between(
    trajectory: Trajectory, start: Array | None, end: Array | None, joints: int
) -> Boundary:
    """The affine set of coefficients (K, `joints`) that start and end there at rest."""
    if start is None and end is None:
        offset = np.zeros((trajectory.n_coefficients, joints))
        return Boundary(None, None, trajectory.free_directions, offset)
    rows = _rows(trajectory, start is not None, end is not None)
    first = start if start is not None else end
    last = end if end is not None else start
    assert first is not None
    assert last is not None
    return Boundary(start, end, _null_space(rows), straight_motion(trajectory, first, last))


def straight_motion(trajectory: Trajectory, start: Array, end: Array) -> Array:
    """Coefficients (K, n) of the straight motion at rest between two postures (n,)."""
    standing = trajectory.constant(start)
    if np.array_equal(start, end):
        return standing
    return standing + np.outer(_profile(trajectory), end - start)


def _profile(trajectory: Trajectory) -> Array:
    """Coefficients (K,) of s: from 0 to 1, at rest at both ends, with the least acceleration."""
    rows = _rows(trajectory, True, True)
    size = np.linalg.norm(rows, axis=1)
    target = np.zeros(len(rows))
    target[1] = 1.0
    particular = np.linalg.lstsq(rows / size[:, None], target / size, rcond=None)[0]
    free = _null_space(rows)
    count = _INSTANTS_PER_FUNCTION * trajectory.n_coefficients
    acceleration = trajectory.basis(np.linspace(0.0, trajectory.duration, count)).acceleration
    least = np.linalg.lstsq(acceleration @ free, -acceleration @ particular, rcond=None)[0]
    return np.asarray(particular + free @ least)


def _rows(trajectory: Trajectory, start: bool, end: bool) -> Array:
    """Rows E (4 to 6, K): positions that are given, then velocities and accelerations."""
    ends = trajectory.basis(np.array([0.0, trajectory.duration]))
    return np.vstack([ends.position[np.array([start, end])], trajectory.rest_rows()])


def _null_space(rows: Array) -> Array:
    found = null_space(rows / np.linalg.norm(rows, axis=1, keepdims=True), rcond=1e-10)
    return np.asarray(found)


def posture_of(robot: Robot, given: Posture, where: str) -> Array:
    """The posture (n,) that is `given` at `where`; joints not named are at robot.posture.

    Raises
    ------
    ConfigError
        A joint is unknown or does not move, or a value is outside its limits.
    """
    posture = robot.posture.copy()
    for name, value in {} if given == "posture" else dict(given).items():
        if name not in robot.joint_names:
            why = "does not move (robot.joints)" if name in robot.locked else "is unknown"
            if name in robot.tree.joint_names:
                why = "follows another joint (mimic)"
            raise ConfigError(
                f"{where}: joint '{name}' {why}.{nearest(name, robot.joint_names)} Moved joints: "
                f"{', '.join(robot.joint_names)}."
            )
        joint = robot.joint_names.index(name)
        lower, upper = robot.limits.lower[joint], robot.limits.upper[joint]
        if not lower <= value <= upper:
            raise ConfigError(
                f"{where}.{name}: {value:g} is outside its limits [{lower:g}, {upper:g}]. Give a "
                "value between them."
            )
        posture[joint] = value
    return posture
