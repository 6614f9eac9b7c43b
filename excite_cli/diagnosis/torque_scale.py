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

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.diagnosis.torque_shares import RoughModel, Samples, those
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.measurement.dataset import Finding, Mask
from excite_cli.robot.model import Array

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
    judged: Mask
    heavy: Array


def check_scale(
    model: RoughModel, samples: Samples, declared: MeasurementSpec
) -> tuple[Finding, ...]:
    """At most one warning: torques of another unit, or without gravity."""
    names, found = model.robot.joint_names, _weights(model, samples)
    here = found.judged & (found.heavy > _HEAVY)
    gone = here & (found.k > _GONE[0]) & (found.k < _GONE[1]) & (found.m > _INERTIA)
    if gone.sum() > 1 and gone.sum() >= 0.5 * here.sum():
        left, whole = _left(model, samples, gone)
        if whole < min(_FITS, left):
            return (_without_gravity(found, whole, gone, names),)
    shown = np.abs(found.k) * found.heavy
    shows = (shown > _HEAVY) | ((shown > _SOME) & (found.k > _ABSURD))
    light = (found.k < 1 / _FACTOR) & (found.heavy > _FACTOR)
    off = found.judged & (((found.k > _FACTOR) & shows) | light)
    if not off.any():
        return ()
    return (_another_unit(found, off, declared, names),)


def _weights(model: RoughModel, samples: Samples) -> _Weight:
    q, n, rest = samples.q, model.robot.n, np.zeros_like(samples.q)
    gravity = model.gravity(q)
    inertial = model.dynamics.torques(q, samples.v, samples.a) - gravity
    unsure = RigidBody(model.robot, model.phi, q, rest, rest).regressor * model.spread
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


def _left(model: RoughModel, samples: Samples, joints: Mask) -> tuple[float, float]:
    """Share of the joints' torques that does not fit, as they are and with gravity added."""
    both = [samples, replace(samples, tau=samples.tau + model.gravity(samples.q))]
    left = model.own_shares_left(both)[:, joints, 0]
    before, after = np.sqrt(np.mean(np.square(left), axis=1))
    return float(before), float(after)


def _without_gravity(found: _Weight, left: float, gone: Mask, names: Sequence[str]) -> Finding:
    joints = those(names, gone)
    shares = ", ".join(f"{k:.2f}" for k in found.k[gone])
    text = (
        f"gravity seems to be subtracted from torques: those of {', '.join(joints)} hold {shares} "
        "times the weight that these joints carry by the URDF; with it added, all but "
        f"{left:.0%} of them fits. Record the whole torque; or, if the controller subtracted "
        "the gravity of this URDF, write measurement.gravity: subtracted, and it is added again. "
        "If the data are right as they are, say so: measurement.trust: true"
    )
    return Finding("no_gravity", "warning", text, "", joints)


def _another_unit(
    found: _Weight, off: Mask, declared: MeasurementSpec, names: Sequence[str]
) -> Finding:
    joints = those(names, off)
    shares = ", ".join(f"{k:.3g}" for k in found.k[off])
    k = np.log(np.maximum(np.abs(found.k[off]), 1e-9))
    every = bool(1 < off.sum() > 0.5 * found.judged.sum() and np.ptp(k) < 1.0)
    if every:
        value = f"{_unit(float(np.exp(np.median(k)))):.3g}"
    else:
        units = [_unit(each) if wrong else 1.0 for each, wrong in zip(found.k, off, strict=True)]
        value = "{" + ", ".join(f"{n}: {x:.3g}" for n, x in zip(names, units, strict=True)) + "}"
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
