"""mujoco.sysid, the identification toolbox of MuJoCo's wheel, on inverse dynamics.

    python sysid_driver.py FOLDER ANSWER.npz [jac]

Inertias of every moved body (`InertiaType.Pseudo`, its default bounds), armature, damping, friction
loss and an offset of every joint, by its own Gauss-Newton (`sysid.optimize`) on a custom residual:
measured torque less `mj_inverse` at filtered states, scaled by `normalize_residual`. Its default
residual plays commands forward and compares sensors; logs of robots hold measured torques. `jac`
scales its steps by the Jacobian, another of its options.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np
from exchange import Given, read_given, write_answer
from mujoco import sysid
from mujoco.sysid import InertiaType, Parameter, ParameterDict
from scipy.signal import butter, sosfiltfilt

# --- what a user writes
CUT_OFF, RATE, MOST = 10.0, 25.0, 600  # Hz, Hz, samples
ITERATIONS = 60  # its default is 200


def smooth(x, step):
    return sosfiltfilt(butter(4, CUT_OFF, fs=1 / step, output="sos"), x, axis=0)


def states_of(recordings):
    """q, v, a, τ (T, n) of all training stretches, filtered and decimated, borders cut."""
    parts = []
    for recording in recordings:
        step = float(np.mean(np.diff(recording.t)))
        border, stride = round(0.15 / step), max(1, round(1 / (RATE * step)))
        for part in recording.stretches:
            if part.stop - part.start < 4 * border:
                continue
            q, tau = smooth(recording.q[part], step), smooth(recording.tau[part], step)
            v = np.gradient(q, step, axis=0)
            a = np.gradient(v, step, axis=0)
            parts.append([x[border:-border:stride] for x in (q, v, a, tau)])
    whole = [np.concatenate(each) for each in zip(*parts, strict=True)]
    every = -(-len(whole[0]) // MOST)
    return [x[::every] for x in whole]


def inverse(model, joints, q, v, a):
    data = mujoco.MjData(model)
    at = [model.joint(name).dofadr[0] for name in joints]
    tau = np.empty(q.shape)
    for k in range(len(q)):
        data.qpos[at], data.qvel[at], data.qacc[at] = q[k], v[k], a[k]
        mujoco.mj_inverse(model, data)
        tau[k] = data.qfrc_inverse[at]
    return tau


def parameters(spec, joints, largest):
    """What is identified; joints are bound by their largest torque, at 1 rad/s² and 0.1 rad/s."""
    model, params = spec.compile(), ParameterDict()
    for name, most in zip(joints, largest, strict=True):
        body = model.body(model.joint(name).bodyid[0])
        params.add(
            sysid.body_inertia_param(
                spec,
                model,
                body.name,
                InertiaType.Pseudo,
                modifier=lambda s, p, b=body.name: put_inertia(s, b, p),
            )
        )
        for what, top in (
            ("armature", 1.0 + most),
            ("damping", 10.0 * most),
            ("frictionloss", most),
        ):
            params.add(
                Parameter(
                    f"{name}_{what}",
                    0.01 * min(most, 1.0),
                    0.0,
                    top,
                    modifier=lambda s, p, n=name, w=what: put(s.joint(n), w, p.value[0]),
                )
            )
    params.add(Parameter("offset", 0.0 * largest, -largest, largest, modifier=lambda s, p: None))
    return params


def put_inertia(spec, body, param):
    sysid.apply_body_inertia(spec, body, param)
    # MuJoCo 4.0.0 refuses the NaN that its own function leaves here.
    spec.body(body).iquat = [1.0, 0.0, 0.0, 0.0]


def put(joint, what, value):
    old = getattr(joint, what)
    if np.ndim(old):
        old[0] = value
    else:
        setattr(joint, what, value)


def identified(given: Given, scale: str | None):
    spec = mujoco.MjSpec.from_file(str(given.urdf))
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    # Links without mass in the URDF: MuJoCo needs some, and bounds are multiples of it.
    spec.compiler.boundmass, spec.compiler.boundinertia = 0.1, 1e-3
    spec.compiler.balanceinertia = True
    q, v, a, tau = states_of(given.recordings)
    params = parameters(spec, given.joints, np.abs(tau).max(axis=0))
    params.move_off_bounds()  # as it asks for

    def residual(x, params):
        found = []
        for column in x.reshape(len(x), -1).T:
            params.update_from_vector(column)
            model = sysid.apply_param_modifiers(params, spec)
            told = inverse(model, given.joints, q, v, a) + params["offset"].value
            found.append(sysid.normalize_residual(tau - told, tau).ravel())
        return [np.array(found).T if x.ndim > 1 else found[0]], None, None

    best, _ = sysid.optimize(params, residual, verbose=False, max_iters=ITERATIONS, x_scale=scale)
    return sysid.apply_param_modifiers(best, spec), best["offset"].value


# --- until here


def main() -> None:
    given = read_given(Path(sys.argv[1]))
    model, offset = identified(given, sys.argv[3] if len(sys.argv) > 3 else None)
    torques = [inverse(model, given.joints, s.q, s.v, s.a) + offset for s in given.asked]
    bodies = [model.joint(name).bodyid[0] for name in given.joints]
    phi = np.array([ten(model, b) for b in bodies])
    write_answer(Path(sys.argv[2]), torques, phi, f"MuJoCo {mujoco.__version__}")


def ten(model, body) -> np.ndarray:
    """Mass, first moments and inertia about the body's frame, as Pinocchio orders them."""
    m, c = model.body_mass[body], model.body_ipos[body]
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    turn = turn.reshape(3, 3)
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    inertia += m * (c @ c * np.eye(3) - np.outer(c, c))
    at = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
    return np.array([m, *(m * c), *(inertia[i] for i in at)])


if __name__ == "__main__":
    main()
