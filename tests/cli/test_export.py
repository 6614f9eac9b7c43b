"""`excite export` and what takes its files: prior, start and simulation."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from excite_cli.config.load_spec import load_spec
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.motion_formats.catalogue import read_own_motion
from excite_cli.robot.model import build_robot
from excite_cli.store.result_file import read_result
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.cli.conftest import Run
from tests.cli.program import BRIEF, SMOKE, Program

SERIES = FourierTrajectory(4, 1.0471975511965976)
JOINTS = ["shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide"]


def test_every_motion_is_written(excite: Program, two_motions: Run) -> None:
    answer = excite.answer("export", two_motions.path, "-f", "csv", "-o", "out.csv")
    assert [each["output"] for each in answer["motions"]] == ["out_1.csv", "out_2.csv"]
    result = read_result(two_motions.path)
    for motion, each in zip(result.motions, answer["motions"], strict=True):
        found = read_own_motion(excite.folder / each["output"])
        assert found.joint_names == tuple(JOINTS)
        assert len(found.t) == each["instants"] == 6001
        assert found.t[-1] == SERIES.duration
        wanted = SERIES.states(found.t, motion.coefficients)
        for one, other in zip((found.q, found.v, found.a), wanted, strict=True):
            assert np.array_equal(one, other)
    assert sorted(path.name for path in excite.folder.iterdir()) == ["out_1.csv", "out_2.csv"]


@pytest.mark.parametrize("name", ["csv", "ros2", "moveit", "npz", "rosbag2", "mcap"])
def test_files_are_named_after_the_result_and_never_overwritten(
    name: str, excite: Program, two_motions: Run
) -> None:
    words = ("export", two_motions.path, "-f", name, "--motion", "2", "--rate", "50")
    suffix = {"csv": ".csv", "ros2": ".yaml", "moveit": ".json", "npz": ".npz"}.get(name, "")
    path = excite.folder / f"arm_motion_2{suffix}"
    written, missing, *_ = excite.good(*words).stdout.splitlines()
    assert written == f"{path.name}: motion_2, 301 samples, 6 s"
    assert missing.startswith("Not modelled: the floor and all else around the robot")
    before = read_own_motion(path)
    assert "exists already" in excite.refused(*words, "--slow", "0.1")
    assert np.array_equal(read_own_motion(path).q, before.q)
    excite.good(*words, "--slow", "0.1", "--overwrite")
    assert read_own_motion(path).duration > 1.5 * before.duration


def test_slowed_and_repeated(excite: Program, two_motions: Run) -> None:
    arguments = ("export", two_motions.path, "-f", "npz", "--motion", "1", "-o", "a.npz")
    more = ("--slow", "0.25", "--periods", "2", "--rate", "200", "--equidistant")
    answer = excite.answer(*arguments, *more)
    pace = answer["motions"][0]["pace"]
    found = read_own_motion(excite.folder / "a.npz")
    assert found.t[-1] == pytest.approx(2 * SERIES.duration / pace)
    assert np.diff(found.t) == pytest.approx(np.diff(found.t)[0])
    limits = build_robot(load_spec(SMOKE).robot, SMOKE.parent).limits
    assert found.v is not None
    assert found.a is not None
    speed = (np.abs(found.v).max(axis=0) / limits.velocity).max()
    acceleration = np.abs(found.a).max() / 10.0
    assert max(speed, acceleration) == pytest.approx(0.25, rel=1e-3)
    told = excite.good(*arguments, "--overwrite", "--slow", "0.25").stderr
    assert "`excite check CONFIG a.npz`" in " ".join(told.split())


def test_entered_from_rest(excite: Program, two_motions: Run) -> None:
    arguments = ("export", two_motions.path, "-f", "csv", "--motion", "1", "-o", "a.csv")
    excite.answer(*arguments, "--entry", "--from", "elbow=0.9", "--slow", "0.5")
    found = read_own_motion(excite.folder / "a.csv")
    assert found.v is not None
    for end in (0, -1):
        assert found.q[end] == pytest.approx([0, 0.6, 0.9, 0, 0.05], abs=1e-9)
        assert found.v[end] == pytest.approx(np.zeros(5), abs=1e-9)
    jumps = np.abs(np.diff(found.v, axis=0)).max()
    assert jumps < 10.0 * 0.5 / 1000 * 1.001  # half of 10 rad/s², a millisecond


def test_a_motion_of_others_is_written_in_another_format(excite: Program) -> None:
    (excite.folder / "m.csv").write_text("t,q_x\n0,0\n1,1\n2,0\n3,1\n")
    answer = excite.answer("export", "m.csv", "-f", "ros2", "--rate", "10", "-o", "m.yaml")
    assert answer["motions"][0]["instants"] == 31
    tree = yaml.safe_load((excite.folder / "m.yaml").read_text())
    assert tree["points"][10]["positions"] == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("-f", "cvs"), "--format cvs: unknown. Did you mean 'csv'?"),
        (("-f", "urdf"), "is no model: it cannot be exported as urdf. Its formats: csv, ros2"),
        (("-f", "csv", "--motion", "x"), "--motion x: give the number"),
        (("-f", "csv", "--rate", "0"), "--rate 0: give instants per second"),
        (("-f", "csv", "--rate", "1e6", "--periods", "9"), "up to 2,000,000 are written"),
        (("-f", "csv", "--slow", "1.5"), "--slow 1.5: give a share"),
        (("-f", "csv", "--from", "elbow=1"), "--from says where --entry starts"),
        (("-f", "csv", "--entry", "--from", "elbow=1,elbow=2"), "--from"),
        (("-f", "csv", "--entry", "--from", ""), "--from"),
    ],
)
def test_bad_requests(
    excite: Program, two_motions: Run, arguments: tuple[str, ...], words: str
) -> None:
    assert words in excite.refused("export", two_motions.path, *arguments)
    assert list(excite.folder.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "words"), [("gone.h5", "There is no file"), ("bad.h5", "HDF5"), ("bad.x", "HDF5")]
)
def test_bad_files(excite: Program, name: str, words: str) -> None:
    for each in ("bad.h5", "bad.x"):
        (excite.folder / each).write_text("nothing")
    assert words in excite.refused("export", name, "-f", "csv")


def _planned(excite: Program, *more: str | Path) -> tuple[Any, str]:
    asked = ("-o", "out.h5", "--motions", "1", *BRIEF, "--json", "--overwrite")
    run = excite.good("optimize", SMOKE, *asked, *more)
    return json.loads(run.stdout)["motions"][0], " ".join(run.stderr.split())


@pytest.mark.long
def test_exported_motions_as_prior_and_start(excite: Program, two_motions: Run) -> None:
    excite.answer("export", two_motions.path, "-f", "npz", "-o", "m.npz")
    both = ("--prior", "m_1.npz", "--prior", "m_2.npz")
    by_file, err = _planned(excite, *both)
    by_result, _ = _planned(excite, "--prior", two_motions.path)
    assert "--prior m_1.npz: 6 s of motion, 60 samples every 0.1 s" in err
    for key in ("condition_number", "stacked_condition_number"):
        assert by_file[key] == pytest.approx(by_result[key], rel=1e-6)
    (old, _) = read_result(two_motions.path).motions
    none = ("--set", "optimizer.max_iterations=1")
    started, err = _planned(excite, "--start", "m_1.npz", *none)
    assert "the search started from m_1" in err
    assert started["condition_number"] < 1.05 * old.condition_number
    again, _ = _planned(excite, "--start", two_motions.path, *none)
    assert again["condition_number"] == pytest.approx(started["condition_number"], rel=1e-3)
    fresh, _ = _planned(excite, *none)
    assert fresh["condition_number"] > 1.2 * started["condition_number"]


def test_bad_priors_and_starts(excite: Program) -> None:
    (excite.folder / "m.csv").write_text("t,q_elbo\n0,0\n1,1\n2,0\n")
    for option in ("--prior", "--start"):
        words = ("optimize", SMOKE, "-o", "out.h5", option)
        assert "does not move joint 'shoulder_yaw'" in excite.refused(*words, "m.csv")
        assert "There is no file gone.csv" in excite.refused(*words, "gone.csv")
    assert not (excite.folder / "out.h5").exists()


def test_an_exported_motion_is_simulated(excite: Program, two_motions: Run) -> None:
    pytest.importorskip("mujoco")
    excite.answer("export", two_motions.path, "-f", "moveit", "--motion", "1", "-o", "m.json")
    answer = excite.answer("simulate", SMOKE, "m.json", "-o", "d.h5", "--rate", "100")
    (run,) = answer["runs"]
    assert (run["name"], run["samples"]) == ("m", 600)
    assert max(run["tracking_error"].values()) < 0.02


@pytest.mark.long
def test_set_points_that_lead(excite: Program, two_motions: Run) -> None:
    """Those of the config's drives; refused where they are not known, and of what is no motion."""
    drives = "measurement={torque: command, command: {kp: 400, kd: 20, delay: 0.01}}"
    plan = ("optimize", SMOKE, *BRIEF, "--set", "sequence.motions=1", "-o", "set.h5")
    excite.good(*plan, "--set", drives)
    export = ("export", "set.h5", "-f", "csv", "-o", "lead.csv", "--rate", "500")
    excite.good(*export, "--lead")
    found = read_own_motion(excite.folder / "lead.csv")
    (motion,) = read_result(excite.folder / "set.h5").motions
    q, v, a = SERIES.states(found.t + 0.01 + 0.001, motion.coefficients)
    torque = InverseDynamics(build_robot(load_spec(SMOKE).robot, SMOKE.parent)).torques(q, v, a)
    set_points = q + (torque + 20.0 * v) / 400.0
    np.testing.assert_allclose(found.q[:-6], set_points[:-6], atol=1e-9)
    narrow = ("--set", "robot.limits.shoulder_pitch.position=[-2.2, 0.61]", "--overwrite")
    excite.good(*plan, "--set", drives.replace("400", "40"), *narrow)
    assert "would leave the joints' position limits" in excite.good(
        *export, "--lead", "--overwrite").stderr  # fmt: skip
    refused = excite.refused("export", two_motions.path, *export[2:4], "-o", "x.csv", "--lead")
    assert "--lead: the config stored in " in refused
    assert "it takes the gains of drives that follow set points" in refused
    assert "--lead: lead.csv does not say which robot and drives" in excite.refused(
        "export", "lead.csv", "-f", "npz", "--lead")  # fmt: skip
    assert "--lead: it is about set points of motions, and this is a model" in excite.refused(
        "export", SMOKE, "-f", "urdf", "--lead")  # fmt: skip
