"""mujoco.sysid on a log of set points, judged as `excite replay --held-out` judges.

    python -m benchmarks.peers.sysid_set_points FIT.h5 LOG [--inertias] [--delays S …] [--step S]

Run it with an interpreter that has both excite and `mujoco[sysid]`. FIT is what `excite identify`
wrote of a robot with `torque: command`: mujoco.sysid gets the same training blocks, the URDF as the
same MJCF with the same actuators, and seeks armature, damping and friction loss of every joint,
with `--inertias` also every body (`InertiaType.Pseudo`, default bounds). It plays each block from
its measured state; its residual is of positions, its solver its own Gauss-Newton. Its delays are
those of sensors (a block that begins in the measured state has none: zero is found), so that it is
run once for each of `--delays` of the set points; the least error in training decides. The judge
plays the held-out set points on the MJCF that it leaves.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from excite_cli.api.loading import Case, dataset_of
from excite_cli.api.model import Model, load_model
from excite_cli.api.model_exports import for_simulators
from excite_cli.api.played_runs import set_points
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import urdf_friction
from excite_cli.export.drive import Drive, drive_of
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.split import split
from excite_cli.scoring.score import Scorer
from excite_cli.simulation.set_point_replay import SetPointInput, set_point_errors

_ITERATIONS = 60  # its default is 200


def parts_of(model: Model, log: str) -> tuple[str, Drive, list[list[SetPointInput]]]:
    """MJCF of the URDF with its drives, and what these got in training and in held-out blocks."""
    stored = model.made
    robot = stored.robot
    drive = drive_of(stored.spec, robot.joint_names)
    assert drive is not None
    dataset = dataset_of(Case(stored.spec, stored.folder, robot), log, lambda note: None)
    parts = split(dataset, None, stored.spec.diagnosis.block, ())
    scorer = Scorer(stored)
    both = [
        [set_points(robot, drive, run, each) for run in runs for each in scorer.prepared([run])]
        for runs in (parts.training, parts.held_out)
    ]
    untouched = IdentifiedModel(standard_parameters(robot), *urdf_friction(robot))
    return mjcf(robot, untouched, replace(drive, delay=0.0)).text, drive, both


def parameters(spec: Any, model: Any, inertias: bool) -> Any:
    """Bounds wide enough for legs: several times what is found of a Go2."""
    params = sysid.ParameterDict()
    starts_and_tops = {"armature": (0.01, 0.2), "damping": (0.1, 5.0), "frictionloss": (0.1, 5.0)}
    for joint in spec.joints:
        for what, (start, top) in starts_and_tops.items():
            put = _joint(joint.name, what)
            params.add(sysid.Parameter(f"{joint.name}_{what}", start, 0.0, top, modifier=put))
    for body in spec.bodies[1:] if inertias else ():
        kind, put = sysid.InertiaType.Pseudo, _body(body.name)
        params.add(sysid.body_inertia_param(spec, model, body.name, kind, modifier=put))
    return params


def _joint(name: str, what: str) -> Any:
    def put(spec: Any, param: Any) -> None:
        joint = spec.joint(name)
        old = getattr(joint, what)
        value = float(param.value[0])
        setattr(joint, what, [value, *old[1:]] if np.ndim(old) else value)

    return put


def _body(name: str) -> Any:
    def put(spec: Any, param: Any) -> None:
        sysid.apply_body_inertia(spec, name, param)
        # MuJoCo 4.0.0 refuses the NaN that its own function leaves here.
        spec.body(name).iquat = [1.0, 0.0, 0.0, 0.0]

    return put


def identified(text: str, blocks: Sequence[SetPointInput], late: float, given: Any) -> str:
    """MJCF that mujoco.sysid leaves, of set points that act `late` [s]."""
    spec = mujoco.MjSpec.from_string(text)
    spec.option.timestep = given.step
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    for joint in spec.joints:
        kind, of = mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtObj.mjOBJ_JOINT
        spec.add_sensor(name=joint.name, type=kind, objtype=of, objname=joint.name)
    model = spec.compile()
    params = parameters(spec, model, given.inertias)
    starts, controls, sensors = [], [], []
    for block in blocks:
        starts.append(sysid.create_initial_state(model, block.q[0], block.v[0]))
        t = np.arange(0.0, block.t[-1] - block.t[0] + 0.5 * given.step, given.step)
        newest = np.searchsorted(block.sent, block.t[0] + t - late + 1e-6, side="right") - 1
        controls.append(sysid.TimeSeries(t, block.ctrl[np.maximum(newest, 0)]))
        sensors.append(sysid.TimeSeries.from_names(block.t - block.t[0], block.q, model))
    groups = [  # blocks differ in length: a group each
        sysid.ModelSequences(f"block_{k}", spec, f"block_{k}", *each)
        for k, each in enumerate(zip(starts, controls, sensors, strict=True))
    ]
    residual = sysid.build_residual_fn(models_sequences=groups, n_threads=1)
    best, _ = sysid.optimize(params, residual, verbose=False, max_iters=_ITERATIONS)
    found = sysid.apply_param_modifiers_spec(best, spec)
    found.compile()
    found.option.timestep = 5e-4  # that of the judge's other models
    return found.to_xml()


def told(name: str, text: str, delay: float, runs: Sequence[SetPointInput]) -> float:
    """Error [rad] of a model, mean over joints."""
    found = set_point_errors(text, runs, delay)
    print(
        f"{name}: {1e3 * found.whole.mean():.2f} mrad RMS, delay {1e3 * delay:.1f} ms", flush=True
    )
    return float(found.whole.mean())


def main() -> None:
    parser = argparse.ArgumentParser()
    for name in ("fit", "log"):
        parser.add_argument(name)
    parser.add_argument("--inertias", action="store_true")
    parser.add_argument("--delays", type=float, nargs="+", default=[0.004, 0.008, 0.012])
    parser.add_argument("--step", type=float, default=1e-3)
    given = parser.parse_args()
    text, drive, (training, held_out) = parts_of(load_model(given.fit), given.log)
    told("URDF, held-out", text, drive.delay, held_out)
    own = load_model(given.fit).made
    ours = mjcf(own.robot, for_simulators(own, "mjcf")[0], replace(drive, delay=0.0)).text
    told("excite, training", ours, drive.delay, training)
    told("excite, held-out", ours, drive.delay, held_out)
    begun, models = time.process_time(), {}
    for delay in given.delays:
        model = identified(text, training, delay, given)
        print(f"{time.process_time() - begun:.0f} s of processor")
        error = told("mujoco.sysid, training", model, delay, training)
        told("mujoco.sysid, held-out", model, delay, held_out)
        models[error] = model, delay
    told("mujoco.sysid, least in training; held-out", *models[min(models)], held_out)


if __name__ == "__main__":
    main()
