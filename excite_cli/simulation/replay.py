"""Recorded torques played on an exported model: how far does it drift from the robot?

Played alone, measured torques lead any model of an arm away within a second, whatever it is worth:
a wrist of 10 g·m² turns by half a revolution in a quarter of a second for want of 1 N·m. So a loose
position loop about the measured motion holds the model,

    τ = τ_measured − defects + K (q_measured − q) + D (v_measured − v),

of the bandwidth ω = 10 rad/s, and at least so stiff that 50 mrad ask for the joint's usual torque:

    K_j = max(M_jj ω², RMS τ_j / 50 mrad),   D_j = 2 √(K_j M_jj),

the same for all models that are compared (M of one of them). The deviation of the positions is the
judge; what a stiffer controller would leave is smaller, in about the same proportion.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.simulation.mujoco_model import load_mujoco

BANDWIDTH = 10.0  # rad/s
_SLACK = 0.05  # rad
_LIGHTEST = 1e-3  # kg·m²
_STEP = 1e-3  # s
_SETTLED = 5.0  # times 1/ω: what the beginning did is forgotten
_LOST = 1.0  # rad: more is a model that fell over


@dataclass(frozen=True)
class ReplayInput:
    """A measured motion `q`, `v` at equidistant `t` (T,), and the `torque` to play, each (T, n)."""

    t: Array
    q: Array
    v: Array
    torque: Array
    channel: ClassVar = "mjSTATE_QFRC_APPLIED"

    def acting(self, times: Array, step: float) -> Array:
        """Torques (K, n) in the middle of physics steps that begin at `times` (K,); 0: unknown."""
        played = np.where(np.isfinite(self.torque), self.torque, 0.0)
        middle = times + 0.5 * step
        return np.column_stack([np.interp(middle, self.t, column) for column in played.T])


@dataclass(frozen=True)
class Drift:
    """RMS deviation `rms` (n,) [rad] (m) over `seconds` of motion; `lost`: it left all bounds."""

    rms: Array
    seconds: float
    lost: bool


def inertias(xml: str, q: Array) -> Array:
    """Mean of the diagonal of the inertia matrix (n,) of the model over postures (T, n)."""
    mujoco = load_mujoco()
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    column, unit, total = np.zeros(model.nv), np.eye(model.nv), np.zeros(model.nv)
    for posture in q:
        data.qpos[:] = posture
        mujoco.mj_forward(model, data)
        for j in range(model.nv):
            mujoco.mj_mulM(model, data, column, unit[j])
            total[j] += column[j]
    return total / max(len(q), 1)


def drift(xml: str, runs: Sequence[ReplayInput], inertia: Array) -> Drift:
    """Deviation of the model `xml` (MJCF) from `runs`.

    `inertia` (n,) scales the loop that holds it.
    """
    mujoco = load_mujoco()
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    data = mujoco.MjData(model)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    torque = np.concatenate([run.torque for run in runs])
    known = np.isfinite(torque)  # never, of a joint whose torque was not measured
    usual = np.sqrt(np.square(np.where(known, torque, 0.0)).sum(axis=0) / known.sum(axis=0).clip(1))
    stiffness = np.maximum(inertia * BANDWIDTH**2, usual / _SLACK)
    damping = 2.0 * np.sqrt(stiffness * np.maximum(inertia, _LIGHTEST))
    model.dof_damping[:] += damping  # implicit, so that light joints stay calm
    squares, count, seconds, lost = np.zeros(model.nv), 0, 0.0, False
    for run in runs:
        h = float(run.t[1] - run.t[0])
        substeps = max(1, round(h / _STEP))
        model.opt.timestep = h / substeps
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = run.q[0], run.v[0]
        settled = int(_SETTLED / BANDWIDTH / h)
        played = np.where(np.isfinite(run.torque), run.torque, 0.0)
        for k in range(len(run.t) - 1):
            for i in range(substeps):
                x = i / substeps
                q = (1.0 - x) * run.q[k] + x * run.q[k + 1]
                v = (1.0 - x) * run.v[k] + x * run.v[k + 1]
                own = (1.0 - x) * played[k] + x * played[k + 1]
                held = stiffness * (q - data.qpos) + damping * v
                data.qfrc_applied[:] = own + held
                mujoco.mj_step(model, data)
            deviation = data.qpos - run.q[k + 1]
            if not (np.abs(deviation) < _LOST).all():
                lost = True
                deviation = np.full_like(deviation, _LOST)
                data.qpos[:], data.qvel[:] = run.q[k + 1], run.v[k + 1]
            if k >= settled:
                squares += np.square(deviation)
                count += 1
        seconds += float(run.t[-1] - run.t[0])
    return Drift(np.sqrt(squares / max(count, 1)), seconds, lost)
