import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

pytest.importorskip("mujoco")

EFFECTS = ("--effect", "coulomb_friction@elbow=1.5", "--effect", "payload@all=0.5;runs:motion_2")
WARM = (
    "--covariate", "temp=25,end:45,time_constant:600,noise:0.1", "--pause", "300",
    "--effect", "covariate_offset@elbow=0.2,reference:25;covariate:temp",
)  # fmt: skip
STANDING = (
    "--set", "robot.base=floating", "--set", "robot.rows=[base]",
    "--set", "measurement.base.imu.link=base",
)  # fmt: skip


@pytest.fixture(scope="module")
def simulated(
    tmp_path_factory: pytest.TempPathFactory, cache: Path, two_motions: Run
) -> tuple[Any, Path]:
    """The answer of `excite simulate`, and the file."""
    folder = tmp_path_factory.mktemp("simulate")
    path = folder / "data.h5"
    arguments = (SMOKE, two_motions.path, "-o", path, "--rate", "200", *EFFECTS, *WARM)
    return Program(folder, cache).answer("simulate", *arguments), path


def test_the_file_is_measured_data_with_its_truth(
    simulated: tuple[Any, Path], two_motions: Run
) -> None:
    answer, path = simulated
    assert answer["output"] == str(path)
    assert [run["name"] for run in answer["runs"]] == ["motion_1", "motion_2"]
    assert all(max(run["tracking_error"].values()) < 0.02 for run in answer["runs"])
    friction, payload, offset = (each for each in answer["effects"] if not each["declared"])
    assert (friction["kind"], friction["joints"]) == ("coulomb_friction", ["elbow"])
    assert friction["parameters"]["coulomb"] == {"value": 1.5, "unit": "N·m"}
    assert (payload["kind"], payload["joints"]) == ("payload", ["slide"])
    assert payload["runs"] == ["motion_2"]
    assert (offset["kind"], offset["covariate"]) == ("covariate_offset", "temp")
    with h5py.File(path) as file:
        names = list(file.attrs["joint_names"])
        assert json.loads(file.attrs["truth"])["effects"] == answer["effects"]
        assert file.attrs["seed"] == 1
        assert json.loads(file.attrs["settings"])["torque_noise"] == 0.01
        assert "smoke_arm.urdf" in file.attrs["config"]
        warmer = file["runs/motion_2/temp"][()]
        run = file["runs/motion_1"]
        t, q, tau, dq = (run[key][()] for key in ("t", "q", "tau", "dq"))
    assert names == ["shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide"]
    assert t == pytest.approx(np.arange(1200) / 200)
    assert warmer.mean() == pytest.approx(45.0 - 20.0 * np.exp(-309.0 / 600.0), abs=0.2)
    assert q.shape == tau.shape == dq.shape == (1200, 5)
    with h5py.File(two_motions.path) as planned:
        wanted, times = planned["motions/1/q"][()], planned["motions/1/t"][()]
    at = np.array([np.interp(times[:-1], t, column) for column in q.T]).T
    assert np.abs(at - wanted[:-1]).max() < 0.03


def test_repeats_seeds_and_chosen_motions(excite: Program, two_motions: Run) -> None:
    def taus(path: str, *more: str) -> list[np.ndarray]:
        excite.good("simulate", SMOKE, two_motions.path, "-o", path, "--motion", "2", *more)
        with h5py.File(excite.folder / path) as file:
            return [file[f"runs/{name}/tau"][()] for name in file["runs"]]

    first, second = taus("a.h5", "--repeat", "2", "--rate", "100")
    assert not np.array_equal(first, second)
    assert np.abs(first - second).max() < 0.1 * np.abs(first).max()
    (again,) = taus("b.h5", "--rate", "100", "--torque-noise", "0", "--encoder", "0")
    assert np.abs(first - again).max() < 0.1 * np.abs(first).max()
    (other,) = taus("c.h5", "--rate", "100", "--torque-noise", "0", "--seed", "5")
    assert not np.allclose(again, other, rtol=0.01)


def test_people_get_tables_and_quiet_ones_nothing_else(excite: Program, two_motions: Run) -> None:
    words = ("simulate", SMOKE, two_motions.path, "-o", "x.h5", "--motion", "1", "--rate", "100")
    run = excite.good(*words, *EFFECTS[:2])
    assert all(word in run.stdout for word in ("coulomb 1.5 N·m", "motion_1", "tracking"))
    assert run.stderr == ""
    assert "x.h5 exists already" in excite.refused(*words)
    run = excite.good(*words, "--overwrite", "--quiet")
    assert run.stderr == ""
    assert "motion_1" in run.stdout
    assert [path.name for path in excite.folder.iterdir()] == ["x.h5"]


DRIVES = (
    "--control", "position", "--kp", "400", "--kd", "20", "--kp", "wrist_roll=5",
    "--kd", "wrist_roll=0.1", "--effect", "armature@wrist_roll=0.02",
)  # fmt: skip


def test_drives_that_follow_set_points(excite: Program, two_motions: Run) -> None:
    """Positions, set points and no torque; how far they are apart; the law in the truth."""
    common = ("--motion", "1", "--rate", "100", "--command-rate", "50")
    arguments = (SMOKE, two_motions.path, "-o", "set.h5", *DRIVES, *common)
    done = excite.good("simulate", *arguments)
    assert "Largest distance to the set points: " in done.stdout
    assert "holds set points (q_cmd) and no torques" in done.stderr
    with h5py.File(excite.folder / "set.h5") as file:
        run = file["runs/motion_1"]
        assert set(run) == {"t", "q", "q_cmd"}
        q, sent = run["q"][()], run["q_cmd"][()]
        drive = json.loads(file.attrs["truth"])["drive"]
        assert json.loads(file.attrs["settings"])["drive"]["command_rate"] == 50.0
    assert np.array_equal(sent[::2][: len(sent[1::2])], sent[1::2])
    assert drive["kp"]["wrist_roll"] == 5.0
    assert drive["kd"]["elbow"] == 20.0
    slow = ("simulate", *arguments, "--overwrite", "--kp", "40", "--kp", "slide=500")
    far = excite.good(*slow, "--set-point-speeds")
    assert "from its set points: what moves is not the planned motion" in far.stderr
    with h5py.File(excite.folder / "set.h5") as file:
        assert set(file["runs/motion_1"]) == {"t", "q", "q_cmd", "v_cmd"}
    answer = excite.answer(*slow)
    largest = answer["runs"][0]["largest_error"]
    assert largest["wrist_roll"] > 0.0
    assert max(largest.values()) > np.abs(sent - q).max()


OWN = (
    "measurement={torque: command, command: {delay: 0.01, limit: {elbow: 90}, "
    "kp: {shoulder_yaw: 400, shoulder_pitch: 400, elbow: 400, wrist_roll: 5, slide: 400}, "
    "kd: {shoulder_yaw: 20, shoulder_pitch: 20, elbow: 20, wrist_roll: 0.1, slide: 20}}}"
)


def test_the_drives_of_the_config(excite: Program, two_motions: Run) -> None:
    """Gains, limit and delay are taken unless options say otherwise; no option is needed."""
    arguments = (
        "simulate",
        SMOKE,
        two_motions.path,
        "-o",
        "own.h5",
        "--motion",
        "1",
        "--overwrite",
    )
    own = (*arguments, "--set", OWN)

    def drive(*more: str) -> dict[str, Any]:
        excite.good(*own, *more)
        with h5py.File(excite.folder / "own.h5") as file:
            return dict(json.loads(file.attrs["truth"])["drive"])

    found = drive()
    assert (found["kp"]["elbow"], found["kd"]["slide"], found["delay"]) == (400.0, 20.0, 0.01)
    assert (found["limit"]["elbow"], found["lead"]) == (90.0, False)
    found = drive("--kp", "300", "--command-delay", "0", "--lead")
    assert (found["kp"]["elbow"], found["kd"]["slide"], found["delay"]) == (300.0, 20.0, 0.0)
    assert found["lead"] is True
    excite.good(*own, "--control", "tracking")
    with h5py.File(excite.folder / "own.h5") as file:
        assert "drive" not in json.loads(file.attrs["truth"])
    narrow = "robot.limits.shoulder_pitch.position=[-2.2, 0.9]"
    said = excite.good(*own, "--lead", "--kp", "40", "--set", narrow).stderr
    assert "would leave the joints' position limits" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--lead",), "--lead: only drives that follow set points have it. Add --control pos"),
        (
            ("--set", "measurement={torque: command, command: {kp: {elbow: 1}}}"),
            "measurement.command.kp: no value for shoulder_yaw",
        ),
        (("--kp", "20"), "--kp: only drives that follow set points have it. Add --control pos"),
        (("--command-delay", "0"), "--command-delay: only drives that follow set points"),
        (("--control", "position", "--kp", "9"), "--control position: --kd missing. Give the"),
        (("--control", "position", "--kp", "9", "--kd", "elbo=1"), "no joint 'elbo'. Did you"),
        ((*DRIVES, *STANDING), "--control position: only robots on a fixed base"),
        (("--effect", "coulomb_friction@elbw=1"), "Did you mean 'elbow'?"),
        (("--motion", "7"), "has no motion 7; it has 1, 2"),
        (("--effect", "covariate_offset@elbow=1;covariate:temp"), "--covariate temp=25,"),
        (("--covariate", "temp=warm"), "'warm' is not a finite number"),
        (("--rate", "9000"), "rate: 9000 Hz cannot be recorded"),
        (("--set", "robot.joints=[elbow]"), "moves other joints than"),
        ((*STANDING, "--wrench-noise", "2"), "--wrench-noise: '2' is not FORCE,MOMENT [N, N·m]"),
        ((*STANDING, "--imu-noise", "0.1,-1"), "'0.1,-1' is not ACCELERATION,RATE"),
        ((*STANDING, "--imu-noise", "0.1,inf"), "for example --imu-noise 0.02,0.001"),
        (("--wrench-noise", "2,0.5"), "--wrench-noise: no wrench is measured; robot.rows"),
        ((*STANDING[:4], "--imu-noise", "1,1"), "--imu-noise: no inertial unit is declared"),
    ],
)
def test_bad_input(
    excite: Program, two_motions: Run, arguments: tuple[str, ...], words: str
) -> None:
    assert words in excite.refused("simulate", SMOKE, two_motions.path, "-o", "x.h5", *arguments)
    assert not (excite.folder / "x.h5").exists()


def test_noise_of_the_sensors_of_a_standing_robot(excite: Program, two_motions: Run) -> None:
    found = {}
    for name, wrench, imu in (("a", "0,0", "0,0"), ("b", "3,0.2", "0.1,0.01")):
        excite.good(
            "simulate", SMOKE, two_motions.path, "-o", f"{name}.h5", "--motion", "1", *STANDING,
            "--wrench-noise", wrench, "--imu-noise", imu, "--torque-noise", "0",
        )  # fmt: skip
        with h5py.File(excite.folder / f"{name}.h5") as file:
            group = file["runs/motion_1"]
            keys = ("wrench", "accelerometer", "gyroscope")
            found[name] = np.hstack([group[key][()] for key in keys])
    noise = (found["b"] - found["a"]).std(axis=0)
    planted = np.repeat([3.0, 0.2, 0.1, 0.01], 3)
    np.testing.assert_allclose(noise, planted, rtol=0.1)
