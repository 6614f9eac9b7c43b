"""Weighted least squares as in textbooks: base parameters, viscous and Coulomb friction, offset.

    python wls_driver.py FOLDER ANSWER.npz

Zero-phase Butterworth at 10 Hz on positions and torques, central differences, every stretch
decimated to 50 Hz with its borders cut; base parameters by QR with pivoting (Gautier 1991); joints
weighted by the standard deviation of their residual (Gautier 1997).
"""

import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
from exchange import read_given, write_answer
from scipy.linalg import qr
from scipy.signal import butter, sosfiltfilt

# --- what a user writes
CUT_OFF, RATE = 10.0, 50.0  # Hz


def smooth(x, step):
    return sosfiltfilt(butter(4, CUT_OFF, fs=1 / step, output="sos"), x, axis=0)


def regressor(model, columns, q, v, a):
    """Rows joint by joint within a sample: inertias, then v, sgn v and 1 of every joint."""
    data, n = model.createData(), len(columns)
    order = np.argsort(columns)
    rows = []
    for at in range(len(q)):
        full = [x[at][order] for x in (q, v, a)]
        inertial = pin.computeJointTorqueRegressor(model, data, *full)[columns]
        rows.append(np.hstack([inertial, np.diag(v[at]), np.diag(np.sign(v[at])), np.eye(n)]))
    return np.concatenate(rows)


def rows_of(model, columns, recording):
    step = float(np.mean(np.diff(recording.t)))
    border, stride = round(0.15 / step), max(1, round(1 / (RATE * step)))
    for part in recording.stretches:
        if part.stop - part.start < 4 * border:
            continue
        q, tau = smooth(recording.q[part], step), smooth(recording.tau[part], step)
        v = np.gradient(q, step, axis=0)
        kept = slice(border, -border, stride)
        a = np.gradient(v, step, axis=0)
        yield regressor(model, columns, q[kept], v[kept], a[kept]), tau[kept]


def fit(model, columns, recordings):
    parts = [each for recording in recordings for each in rows_of(model, columns, recording)]
    y, tau = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    n = len(columns)
    scale = np.linalg.norm(y, axis=0)
    seen = np.flatnonzero(scale > 1e-8 * scale.max())
    _, r, pivot = qr(y[:, seen] / scale[seen], mode="economic", pivoting=True)
    base = seen[pivot[np.abs(np.diag(r)) > 1e-6 * abs(r[0, 0])]]
    scaled, weights = y[:, base] / scale[base], np.ones(n)
    for _ in range(5):
        w = np.tile(1 / weights, len(tau))
        found = np.linalg.lstsq(scaled * w[:, None], tau.ravel() * w, rcond=None)[0]
        weights = (tau - (scaled @ found).reshape(tau.shape)).std(axis=0)
    phi = np.zeros(y.shape[1])
    phi[base] = found / scale[base]
    return phi


# --- until here


def main() -> None:
    given = read_given(Path(sys.argv[1]))
    model = pin.buildModelFromUrdf(str(given.urdf))
    columns = np.array([model.joints[model.getJointId(name)].idx_v for name in given.joints])
    phi = fit(model, columns, given.recordings)
    torques = [
        (regressor(model, columns, s.q, s.v, s.a) @ phi).reshape(s.q.shape) for s in given.asked
    ]
    write_answer(Path(sys.argv[2]), torques)


if __name__ == "__main__":
    main()
