"""A robot on a wall, under a ceiling, on a leaning table, whose description stands upright.

The weight of bodies φ is linear in gravity, τ_g = G(q, φ) g. So g is fitted by least squares with
what friction, rotors and offsets explain taken out, then the bodies, in turn; its length is known.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from excite_cli.checks.base import Alternative, Settings, SetupCheck
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import FLOOR, Explained, TextbookFit
from excite_cli.config.spec import Spec
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Array

_ROUNDS = 3
_SAME = np.radians(0.3)  # a direction nearer than this is the same
_NEAR = np.radians(6.0)  # to a wall, a ceiling, or half way between
_DIGITS = 4  # of angles [rad] that are written


class GravityDirection(SetupCheck):
    """Direction of gravity."""

    name = "direction of gravity"
    kind = "mount"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: Explained
    ) -> Iterator[Alternative]:
        """The direction that explains most, and the wall, ceiling or 45° next to it."""
        held = not (fit.robot.floating or fit.robot.base_joints)
        if not (held and setup.gravity.any() and explained.judged.any()):
            return
        z, shares, tried = explained.z, explained.shares, setup
        for _ in range(_ROUNDS):
            gravity = _fitted(fit, tried, z, shares, explained.judged)
            if gravity is None:
                return
            tried = replace(setup, gravity=gravity)
            found = fit(tried)
            z, shares = found.z, found.shares
        plain = _plain(tried.gravity)
        for gravity in (tried.gravity, plain):
            if gravity is not None and _angle(gravity, setup.gravity) > _SAME:
                yield Alternative(replace(setup, gravity=gravity), is_plain=gravity is plain)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How far the robot is turned."""
        angle = np.degrees(_angle(before.gravity, after.gravity))
        along = ", ".join(f"{x:.2f}" for x in after.gravity)
        return (
            f"gravity pulls along ({along}) m/s² in the frame of the base, {angle:.3g}° from where "
            "the config has it: the robot hangs on a wall, under a ceiling, or leans"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """Roll, pitch, yaw of the base that turn gravity to where it is."""
        turn, _ = Rotation.align_vectors([before.gravity], [after.gravity])
        old = Rotation.from_euler("xyz", spec.robot.base_orientation)
        angles = (turn * old).as_euler("xyz")
        return {"robot.base_orientation": [round(float(x), _DIGITS) + 0.0 for x in angles]}


def _fitted(fit: TextbookFit, setup: Setup, z: Array, shares: Array, judged: Mask) -> Array | None:
    """Gravity (3,) by which bodies of `z` explain the torques best; None if they weigh nothing."""
    phi = fit.bodies(z)
    weight = fit.weight(setup, phi)
    inertial = fit.columns(setup) @ phi - weight @ setup.gravity
    torque, counted = setup.torque(fit.samples), fit.counted(setup)
    normal, side = np.zeros((3, 3)), np.zeros(3)
    for j in np.flatnonzero(judged).tolist():
        rows = counted[:, j]
        values = np.column_stack([weight[rows, j], torque[rows, j] - inertial[rows, j]])
        own = fit.without_passive(setup, z, j, values)
        size = np.ptp(torque[rows, j]) * max(shares[j], FLOOR)
        normal += own[:, :3].T @ own[:, :3] / size**2
        side += own[:, :3].T @ own[:, 3] / size**2
    if not np.trace(normal) > 0.0:
        return None
    unsure = normal + 1e-9 * np.trace(normal) * np.eye(3)
    gravity = np.linalg.solve(unsure, side)
    length = np.linalg.norm(gravity)
    if not length > 0.0:
        return None
    return np.asarray(gravity * np.linalg.norm(setup.gravity) / length)


def _plain(gravity: Array) -> Array | None:
    """The direction along an axis or half way between two that is next, if it is near."""
    directions = [d for d in np.ndindex(3, 3, 3) if 1 <= np.count_nonzero(np.array(d) - 1) <= 2]
    units = [(np.array(d) - 1) / np.linalg.norm(np.array(d) - 1) for d in directions]
    best = min(units, key=lambda unit: _angle(unit, gravity))
    return best * np.linalg.norm(gravity) if _angle(best, gravity) < _NEAR else None


def _angle(a: Array, b: Array) -> float:
    cosine = float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
