"""Logs of motors that drive joints together, of a robot whose base has a wrench as well."""

from pathlib import Path

import numpy as np

from excite_cli import load_case, load_data
from excite_cli.robot.base_joints import BASE_JOINTS
from tests.robot.coupled_robots import HAND, written

MATRIX = np.array([[0.5, 0.5], [0.4, -0.6]])
CONFIG = """
robot:
  urdf: coupled.urdf
  base: floating
  rows: [base, joints]
  transmissions:
    - {joints: [shoulder, wrist], motors: [m1, m2], matrix: [[0.5, 0.5], [0.4, -0.6]]}
measurement: {torque: motor, position: motor, wrench: [{channel: foot}]}
"""


def test_motors_become_joints_beside_the_wrench(tmp_path: Path) -> None:
    written(tmp_path, HAND)
    (tmp_path / "hand.yaml").write_text(CONFIG)
    rng = np.random.default_rng(0)
    t = 0.004 * np.arange(1500)
    joints = 0.3 * np.sin(np.outer(t, [3.0, 4.0])) + 0.1
    finger = 0.02 + 0.01 * np.sin(2.0 * t)
    torques = rng.normal(size=(len(t), 3))
    columns = {"t": t, "q_finger_1": finger, "tau_finger_1": torques[:, 2]}
    for k, name in enumerate(("m1", "m2")):
        columns[f"q_{name}"] = np.linalg.solve(MATRIX, joints.T)[k]
        columns[f"tau_{name}"] = (torques[:, :2] @ MATRIX)[:, k]
    for part in ("fx", "fy", "fz", "mx", "my", "mz"):
        columns[f"foot_{part}"] = rng.normal(size=len(t))
    np.savetxt(tmp_path / "log.csv", np.column_stack(list(columns.values())), delimiter=",",
               header=",".join(columns), comments="", fmt="%.17g")  # fmt: skip
    case = load_case(tmp_path / "hand.yaml")
    data = load_data(case, tmp_path / "log.csv")
    assert data.joint_names == (*BASE_JOINTS, "shoulder", "wrist", "finger_1")
    (run,) = data.runs
    np.testing.assert_allclose(run.q[:, 6:], np.column_stack([joints, finger]), atol=1e-9)
    # The wrench acts on the base: it does nothing to the joints.
    np.testing.assert_allclose(run.tau[:, 6:], torques, atol=1e-9)
    assert np.abs(run.tau[:, :6]).min(axis=0).max() > 0.0
