"""Torques of another unit, and torques without gravity, as the URDF's masses show them.

Where a joint moves, its torque is fitted by least squares as

    τ ≈ k g(q) + m (τ_URDF − g(q)) + b v + c sgn v,

with the URDF's gravity g. Masses may be wrong by a half, but not by a factor of `_FACTOR`: a k
beyond that is another unit, the torque before a gear, or a counterbalance. A k of about 0 on most
joints that carry weight, where inertia shows, is a torque from which the controller took gravity
away. Joints whose weight the URDF hardly knows (masses 30 %, centres of mass 3 cm) are not judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.diagnosis.torque_shares import RoughModel, Samples, spread_of
from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.model import Array, Robot

_FACTOR = 4.0
_KNOWN = 2.0  # weight over its standard deviation from which a joint is judged
_OWN = 0.05  # share of the energy of g that no other column has
_ROWS = 40
_DUST = 1e-3  # of the largest weight: less is an axis that stands upright
# k of torques without gravity, whose masses may be off by a half; the least m; and what may be left
# of them by the URDF's dynamics with gravity added.
_GONE, _INERTIA, _FITS = (-0.6, 0.3), 0.3, 0.15
_HEAVY = 0.5  # weight over torque: less would not be missed
# Friction may be taken for a few times the weight, not for so many times: a TX40 in mN·m, whose
# weight is 0.45 of its torques, went unnoticed.
_ABSURD, _SOME = 30.0, 0.2
_POWER = 0.4  # in log: a factor so near to a power of ten is taken for it


@dataclass(frozen=True)
class _Weight:
    """k and m (n,) of all joints; which are `judged` (n,); weight over torque `heavy` (n,)."""

    k: Array
    m: Array
    judged: NDArray[np.bool_]
    heavy: Array


def check_scale(
    robot: Robot, samples: Samples, declared: MeasurementSpec, names: Sequence[str]
) -> tuple[Finding, ...]:
    """At most one warning: torques of another unit, or without gravity."""
    found = _weights(robot, samples)
    here = found.judged & (found.heavy > _HEAVY)
    gone = here & (found.k > _GONE[0]) & (found.k < _GONE[1]) & (found.m > _INERTIA)
    if gone.sum() > 1 and gone.sum() >= 0.5 * here.sum():
        left, whole = _left(robot, samples, gone)
        if whole < min(_FITS, left):
            return (_without_gravity(found, whole, gone, names),)
    shown = np.abs(found.k) * found.heavy
    shows = (shown > _HEAVY) | ((shown > _SOME) & (found.k > _ABSURD))
    light = (found.k < 1 / _FACTOR) & (found.heavy > _FACTOR)
    off = found.judged & (((found.k > _FACTOR) & shows) | light)
    if not off.any():
        return ()
    return (_another_unit(found, off, declared, names),)


def _weights(robot: Robot, samples: Samples) -> _Weight:
    q, n = samples.q, robot.n
    rest, phi = np.zeros_like(q), standard_parameters(robot)
    dynamics = InverseDynamics(robot)
    gravity = dynamics.torques(q, rest, rest)
    inertial = dynamics.torques(q, samples.v, samples.a) - gravity
    unsure = RigidBody(robot, phi, q, rest, rest).regressor * spread_of(robot, phi)
    deviation = np.sqrt(np.square(unsure).sum(axis=-1))
    k, m, heavy = np.ones(n), np.ones(n), np.zeros(n)
    judged = np.zeros(n, bool)
    dust = _DUST * np.abs(gravity).max(initial=0.0)
    for j in range(n):
        rows = samples.moves[:, j] & samples.known[:, j]
        if rows.sum() < _ROWS or not samples.tau[rows, j].any():
            continue
        g, v, tau = gravity[rows, j], samples.v[rows, j], samples.tau[rows, j]
        known = np.linalg.norm(g) > _KNOWN * np.linalg.norm(deviation[rows, j])
        known &= np.abs(g).max() > dust
        others = np.column_stack([inertial[rows, j], v, np.sign(v)])
        own = g - others @ np.linalg.lstsq(others, g, rcond=None)[0]
        judged[j] = known and np.square(own).sum() > _OWN * np.square(g).sum()
        if judged[j]:
            fitted = np.linalg.lstsq(np.column_stack([g, others]), tau, rcond=None)[0]
            k[j], m[j] = fitted[0], fitted[1]
            heavy[j] = np.linalg.norm(g) / np.linalg.norm(tau)
    return _Weight(k, m, judged, heavy)


def _left(robot: Robot, samples: Samples, joints: NDArray[np.bool_]) -> tuple[float, float]:
    """Share of the joints' torques that does not fit, as they are and with gravity added."""
    rest = np.zeros_like(samples.q)
    gravity = InverseDynamics(robot).torques(samples.q, rest, rest)
    both = [samples, replace(samples, tau=samples.tau + gravity)]
    left = RoughModel(robot).own_shares_left(both)[:, joints, 0]
    before, after = np.sqrt(np.mean(np.square(left), axis=1))
    return float(before), float(after)


def _without_gravity(
    found: _Weight, left: float, gone: NDArray[np.bool_], names: Sequence[str]
) -> Finding:
    joints = tuple(names[j] for j in np.flatnonzero(gone).tolist())
    shares = ", ".join(f"{found.k[j]:.2f}" for j in np.flatnonzero(gone))
    text = (
        f"gravity seems to be subtracted from torques: those of {', '.join(joints)} hold {shares} "
        "times the weight that these joints carry by the URDF; with it added, all but "
        f"{left:.0%} of them fits. Record the whole torque; or, if the controller subtracted "
        "the gravity of this URDF, write measurement.gravity: subtracted, and it is added again. "
        "If the data are right as they are, say so: measurement.trust: true"
    )
    return Finding("no_gravity", "warning", text, "", joints)


def _another_unit(
    found: _Weight, off: NDArray[np.bool_], declared: MeasurementSpec, names: Sequence[str]
) -> Finding:
    joints = tuple(names[j] for j in np.flatnonzero(off).tolist())
    shares = ", ".join(f"{found.k[j]:.3g}" for j in np.flatnonzero(off))
    k = np.log(np.maximum(np.abs(found.k), 1e-9))
    every = bool(1 < off.sum() > 0.5 * found.judged.sum() and np.ptp(k[off]) < 1.0)
    unit = {name: _unit(found.k[j]) if off[j] else 1.0 for j, name in enumerate(names)}
    if every:
        value = f"{_unit(float(np.exp(np.median(k[off])))):.3g}"
    else:
        value = "{" + ", ".join(f"{name}: {x:.3g}" for name, x in unit.items()) + "}"
    text = (
        f"torques of {', '.join(joints)} are {shares} times what the URDF's masses weigh: are they "
        "in another unit (mN·m, per cent), of the motor before its gear, or held by a "
        "counterbalance? "
    )
    if declared.torque == "link":
        text += (
            "Torque before the gear: write measurement.torque: motor and measurement.gear_ratio. "
            "Another unit: write measurement.torque: current and measurement.torque_constant: "
            f"{value}, N·m in a unit of the file as the masses have it. "
        )
    else:
        text += "Check measurement.torque_constant and gear_ratio. "
    if not every:
        text += f"Do without: measurement.without_torque: [{', '.join(joints)}]. "
    text += "If the data are right as they are, say so: measurement.trust: true"
    return Finding("torque_scale", "warning", text, "", joints)


def _unit(k: float) -> float:
    """N·m in a unit of the file: 1/k, or the power of ten next to it."""
    power = 10.0 ** -round(np.log10(abs(k))) if k else 1.0
    return float(power if abs(np.log(power * abs(k))) < _POWER else 1 / k)
