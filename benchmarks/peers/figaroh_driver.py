"""FIGAROH's identification of a robot, run by FIGAROH's own interpreter and nothing else.

    python figaroh_driver.py FOLDER ANSWER.npz CUT_OFF DECIMATION [JOINT JOINT]

Its pipeline as in its TX40 example: friction, armature and offset of every joint, its Butterworth
filter, its decimation, base parameters by QR, weighted least squares. It takes one recording:
several are put one after the other with a smooth second between them, and its sample mask leaves
out that, what is held out and the borders that its filters reach over. Predicted torques are its
regressor times its base parameters, as in its own validation. Two joints that are named have
coupled motors: the columns for these are those that the helper class of its TX40 example has.
"""

import json
import logging
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
from exchange import Given, Recording, read_given, write_answer
from figaroh.data.trajectory import JOINT_FORCE, JOINT_TORQUE, TrajectoryData
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced
from figaroh.tools.robot import load_robot
from scipy.interpolate import CubicHermiteSpline


# --- what a user writes
def config(given: Given, rate: float, cut_off: float) -> dict:
    return {
        "robot": {
            "name": "robot",
            "properties": {"joints": {"active_joints": list(given.joints)}},
        },
        "tasks": {
            "identification": {
                "enabled": True,
                "problem": {
                    "use_joint_torques": True,
                    "include_external_forces": False,
                    "wls": True,
                    "model_components": {
                        "friction": True,
                        "joint_offset": True,
                        "actuator_inertia": True,
                    },
                },
                "signal_processing": {
                    "sampling_frequency": rate,
                    "cutoff_frequency": cut_off,
                    "filter_type": "butterworth",
                    "filter_order": 4,
                },
            }
        },
    }


class Identification(BaseIdentification):
    def __init__(self, robot, file: Path, given: Given) -> None:
        super().__init__(robot, str(file))
        self.given = given
        model = robot.model
        joints = [model.joints[model.getJointId(name)] for name in given.joints]
        self.identif_config["act_idxq"] = [joint.idx_q for joint in joints]
        self.identif_config["act_idxv"] = [joint.idx_v for joint in joints]

    def load_trajectory_data(self, data_source=None):
        recordings = bridged(self.given.recordings)
        step = float(np.mean(np.diff(recordings[0].t)))
        sliding = [
            self.model.joints[self.model.getJointId(name)].shortname().startswith("JointModelP")
            for name in self.given.joints
        ]
        count = sum(len(r.t) for r in recordings)
        return TrajectoryData(
            t=step * np.arange(count),
            joint_names=self.given.joints,
            q=np.concatenate([r.q for r in recordings]),
            effort=np.concatenate([r.tau for r in recordings]),
            effort_kind=[JOINT_FORCE if s else JOINT_TORQUE for s in sliding],
            effort_unit=["N" if s else "N·m" for s in sliding],
            mask=np.concatenate([inner(r, self.ends, self.margin) for r in recordings]),
        )

    # --- until here, and more where motors are coupled
    @property
    def states(self):
        return [self.processed_data[x] for x in ("velocities", "accelerations")]

    def _compute_validation_metrics(self):
        # It builds the regressor anew, without the columns that were added.
        return None

    def beside(self, rows, v, a, coupled):
        """The regressor with armature, viscous and Coulomb friction of two coupled motors."""
        one, other = (self.model.joints[self.model.getJointId(name)].idx_v for name in coupled)
        more = np.zeros((self.model.nv, len(v), 3))
        for j, k in ((one, other), (other, one)):
            more[j] = np.stack([a[:, k], v[:, k], np.sign(v[:, one] + v[:, other])], axis=1)
        return np.hstack([rows, more.reshape(-1, 3)])


# --- what a user writes
def bridged(recordings):
    """The recordings with a smooth second of motion between them, which may not be used."""
    found = [recordings[0]]
    for one in recordings[1:]:
        last, step = found[-1], float(np.mean(np.diff(one.t)))
        t = np.arange(step, 1.0, step)
        q = CubicHermiteSpline(
            [0.0, t[-1] + step],
            [last.q[-1], one.q[0]],
            [(last.q[-1] - last.q[-11]) / (10 * step), (one.q[10] - one.q[0]) / (10 * step)],
        )(t)
        tau = last.tau[-1] + t[:, None] * (one.tau[0] - last.tau[-1])
        found += [Recording(t, q, None, tau, np.zeros(len(t), bool)), one]
    return found


def inner(recording, ends: int, margin: int) -> np.ndarray:
    """Samples that lie `margin` inside of what may be used, and `ends` inside of the recording."""
    kept = np.zeros(len(recording.t), bool)
    for part in recording.stretches:
        kept[part.start + margin : part.stop - margin] = True
    kept[:ends] = kept[-ends:] = False
    return kept


def identified(
    given: Given, folder: Path, cut_off: float, decimation: int, coupled
) -> Identification:
    rate = float((len(given.recordings[0].t) - 1) / np.ptp(given.recordings[0].t))
    file = folder / "figaroh.yaml"
    file.write_text(json.dumps(config(given, rate, cut_off)))
    robot = load_robot(str(given.urdf), package_dirs=str(folder), load_by_urdf=True)
    found = Identification(robot, file, given)
    found.ends = round(1.5 / cut_off * rate)
    found.margin = 3 * decimation if decimation > 1 else 0
    found.initialize()
    # --- until here, and more where motors are coupled
    if coupled:
        found.dynamic_regressor = found.beside(found.dynamic_regressor, *found.states, coupled)
        found.standard_parameter |= {"Iam": 0.0, "fvm": 0.0, "fsm": 0.0}
    # --- what a user writes
    found.solve(decimation > 1, decimation, plotting=False, wls=True)
    return found


# --- until here


def predicted(found: Identification, given: Given, coupled) -> list[np.ndarray]:
    at = {x: found.identif_config[f"act_idx{x}"] for x in "qv"}
    torques = []
    for s in given.asked:
        states = []
        for x, index, width in ((s.q, at["q"], found.model.nq), (s.v, at["v"], found.model.nv),
                                (s.a, at["v"], found.model.nv)):  # fmt: skip
            full = np.zeros((len(x), width))
            full[:, index] = x
            states.append(full)
        rows = build_regressor_basic(found.robot, *states, found.identif_config)
        if coupled:
            rows = found.beside(rows, *states[1:], coupled)
        rows = build_regressor_reduced(rows, found._idx_eliminated)[:, found._base_indices]
        tau = (rows @ found.phi_base).reshape(found.model.nv, len(s.q)).T
        torques.append(tau[:, at["v"]])
    return torques


def main() -> None:
    logging.disable(logging.WARNING)
    folder, cut_off, decimation = Path(sys.argv[1]), float(sys.argv[3]), int(sys.argv[4])
    coupled = sys.argv[5:]
    given = read_given(folder)
    found = identified(given, folder, cut_off, decimation, coupled)
    told = f"FIGAROH {metadata.version('figaroh')}, Pinocchio {metadata.version('pin')}"
    write_answer(Path(sys.argv[2]), predicted(found, given, coupled), told=told)


if __name__ == "__main__":
    main()
