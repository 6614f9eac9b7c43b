"""A robot that stands, in MuJoCo: its log as HDF5, as CSV, as a bag, tells the same load."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli import (
    Case,
    Dataset,
    FileError,
    Segment,
    SimulationSettings,
    identify,
    load_case,
    load_data,
    load_motions,
    simulate,
)
from excite_cli.api.motions import is_motion
from excite_cli.measurement.dataset import Run
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.api.conftest import SMOKE
from tests.measurement.bags import IMU, WRENCH, States, Topic, write_standing

pytest.importorskip("mujoco")

STANDING = [
    "robot.base=floating",
    "robot.rows=[base]",
    "measurement.wrench=[{channel: /foot/wrench}]",
    "measurement.base.imu={link: base, gyroscope: /imu, accelerometer: /imu}",
]
PARTS = {
    "foot_wrench": ("fx", "fy", "fz", "mx", "my", "mz"),
    "imu": ("wx", "wy", "wz", "ax", "ay", "az"),
}
LOAD = 0.5  # kg, at the tool, whose own mass is 0.4 kg


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case(SMOKE, STANDING)


@pytest.fixture(scope="module")
def played(case: Case, tmp_path_factory: pytest.TempPathFactory) -> tuple[Dataset, Path]:
    """Two motions with a load that the URDF does not know, and the file of them."""
    path = tmp_path_factory.mktemp("standing") / "log.h5"
    rng = np.random.default_rng(3)
    trajectory = FourierTrajectory(3, 2 * np.pi / 6.0)
    middle = [0.0, 0.6, 0.8, 0.0, 0.1]
    motions = []
    for name in ("first", "second"):
        size = np.array([0.2, 0.15, 0.2, 0.2, 0.01])
        coefficients = size * rng.normal(size=(trajectory.n_coefficients, case.robot.n))
        coefficients[-1] = middle
        motions.append(Segment(name, trajectory, coefficients))
    settings = SimulationSettings(
        rate=250.0, inertia_error=0.0, encoder=1e-6, force_noise=0.5, moment_noise=0.1
    )
    found = simulate(case, motions, [f"payload@slide={LOAD}"], settings, output=path)
    return found.dataset, path


def saved(path: Path, run: Run, joints: tuple[str, ...], *channels: str) -> Path:
    """A CSV of positions (`q`) and sensors of a run, without any torque."""
    columns = {"t": run.t}
    for channel in channels:
        values = run.q if channel == "q" else run.extra[channel]
        names = [f"q_{joint}" for joint in joints]
        if channel != "q":
            names = [f"{channel}_{part}" for part in PARTS[channel]]
        columns |= dict(zip(names, values.T, strict=True))
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, "%.17g", ",", header=",".join(columns), comments="")
    return path


def mass_of_tool(case: Case, data: Dataset) -> tuple[float, float]:
    """Identified mass of the sliding link, which carries the load, and its deviation [kg]."""
    fit = identify(case, data).fit
    place = fit.names.index("m[slide]")
    return float(fit.values[place]), float(fit.std[place])


@pytest.mark.long
def test_the_load_is_found_in_the_wrench(case: Case, played: tuple[Dataset, Path]) -> None:
    mass, std = mass_of_tool(case, load_data(case, played[1]))
    assert mass == pytest.approx(0.4 + LOAD, abs=4 * std)
    assert std < 0.05


def test_csv_of_one_file_and_of_several_hold_the_same(
    case: Case, played: tuple[Dataset, Path], tmp_path: Path
) -> None:
    data, path = played
    joints = data.joint_names
    first, second = data.runs
    files = [
        saved(tmp_path / "first.csv", first, joints, "q", *PARTS),
        saved(tmp_path / "second_positions.csv", second, joints, "q"),
        saved(tmp_path / "second_foot.csv", second, joints, "foot_wrench"),
        saved(tmp_path / "second_imu.csv", second, joints, "imu"),
    ]
    read = load_data(case, files)
    assert [run.name for run in read.runs] == ["first", "second"]
    assert not read.findings
    for run, stored in zip(read.runs, load_data(case, path).runs, strict=True):
        np.testing.assert_array_equal(run.q, stored.q)
        np.testing.assert_array_equal(run.tau, stored.tau)


@pytest.mark.long
def test_a_bag_with_stamps_of_its_own_tells_the_same_load(
    case: Case, played: tuple[Dataset, Path], tmp_path: Path
) -> None:
    bags = []
    for run in played[0].runs:
        joints = slice(None, None, 2)  # 125 Hz; sensors at 250 Hz, between these stamps
        states = States(played[0].joint_names, run.t[joints], run.q[joints])
        own = np.arange(run.t[0] - 0.0013, run.t[-1] + 0.004, 0.004)
        topics = {
            f"/{name.replace('_', '/')}": Topic(kind, own, _at(own, run, name))
            for name, kind in (("foot_wrench", WRENCH), ("imu", IMU))
        }
        bags.append(write_standing(tmp_path / run.name, states, topics))
    mass, std = mass_of_tool(case, load_data(case, bags))
    assert mass == pytest.approx(0.4 + LOAD, abs=4 * std)
    assert std < 0.05


def _at(t: np.ndarray, run: Run, name: str) -> np.ndarray:
    return np.column_stack([np.interp(t, run.t, column) for column in run.extra[name].T])


def test_a_sensor_that_is_in_no_file(
    case: Case, played: tuple[Dataset, Path], tmp_path: Path
) -> None:
    data, _ = played
    path = saved(tmp_path / "some.csv", data.runs[0], data.joint_names, "q", "imu")
    with pytest.raises(FileError, match=r"run 'some' has no channel 'foot_wrench' \(nor foot_wren"):
        load_data(case, path)


def test_a_log_without_torques_is_no_plan_but_its_motion_can_be_checked(
    case: Case, played: tuple[Dataset, Path], tmp_path: Path
) -> None:
    data, _ = played
    log = saved(tmp_path / "log.csv", data.runs[0], data.joint_names, "q", *PARTS)
    plan = saved(tmp_path / "plan.csv", data.runs[0], data.joint_names, "q")
    assert is_motion(plan, case.spec)
    assert not is_motion(log, case.spec)
    (measured,) = load_motions(case, log)
    t = np.linspace(0.0, measured.trajectory.duration, 50)
    q, *_ = measured.trajectory.states(t, measured.coefficients)
    assert q.shape == (50, case.robot.n)
    middle = data.runs[0].q[len(data.runs[0].q) // 2]  # as much is cut at both ends
    np.testing.assert_allclose(0.5 * (q[24] + q[25]), middle, atol=0.02)
