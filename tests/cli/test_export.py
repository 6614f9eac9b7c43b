"""`excite export` and what takes its files: prior, start and simulation."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
import yaml

from excite_cli.cli.app import app
from excite_cli.cli.ending import run_guarded
from excite_cli.config.load import load_spec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.motion_files import read_own_motion
from excite_cli.robot.model import build_robot
from excite_cli.store.result_file import read_result
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.cli.conftest import Run
from tests.cli.program import BRIEF, SMOKE, Program
from tests.identification.synthetic import measured

SERIES = FourierTrajectory(4, 1.0471975511965976)
JOINTS = ["shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide"]


@dataclass(frozen=True)
class Here:
    """Runs the program in this process, which saves its start; `folder` is where it stands."""

    folder: Path
    capture: pytest.CaptureFixture[str]

    def __call__(self, *arguments: str | Path) -> tuple[int, str, str]:
        command = typer.main.get_command(app)
        words = list(map(str, arguments))
        status = run_guarded(lambda: command.main(words, standalone_mode=False))
        out, err = self.capture.readouterr()
        return status, out, err.replace("\n", " ")

    def answer(self, *arguments: str | Path) -> Any:
        status, out, err = self(*arguments, "--json")
        assert status == 0, err
        return json.loads(out)


@pytest.fixture
def here(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Here:
    monkeypatch.chdir(tmp_path)
    return Here(tmp_path, capsys)


def test_the_installed_program_writes_every_motion(excite: Program, two_motions: Run) -> None:
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
    name: str, here: Here, two_motions: Run
) -> None:
    arguments = ("export", two_motions.path, "-f", name, "--motion", "2", "--rate", "50")
    suffix = {"csv": ".csv", "ros2": ".yaml", "moveit": ".json", "npz": ".npz"}.get(name, "")
    status, out, _ = here(*arguments)
    assert status == 0
    assert out == f"arm_motion_2{suffix}: motion_2, 301 instants, 6 s\n"
    path = here.folder / f"arm_motion_2{suffix}"
    before = read_own_motion(path)
    status, _, err = here(*arguments, "--slow", "0.1")
    assert status == 2
    assert "exists already" in err
    assert np.array_equal(read_own_motion(path).q, before.q)
    assert here(*arguments, "--slow", "0.1", "--overwrite")[0] == 0
    assert read_own_motion(path).duration > 1.5 * before.duration


def test_slowed_and_repeated(here: Here, two_motions: Run) -> None:
    arguments = ("export", two_motions.path, "-f", "npz", "--motion", "1", "-o", "a.npz")
    more = ("--slow", "0.25", "--periods", "2", "--rate", "200", "--equidistant")
    answer = here.answer(*arguments, *more)
    pace = answer["motions"][0]["pace"]
    found = read_own_motion(here.folder / "a.npz")
    assert found.t[-1] == pytest.approx(2 * SERIES.duration / pace)
    assert np.diff(found.t) == pytest.approx(np.diff(found.t)[0])
    limits = build_robot(load_spec(SMOKE).robot, SMOKE.parent).limits
    assert found.v is not None
    assert found.a is not None
    speed = (np.abs(found.v).max(axis=0) / limits.velocity).max()
    acceleration = np.abs(found.a).max() / 10.0
    assert max(speed, acceleration) == pytest.approx(0.25, rel=1e-3)
    status, _, err = here(*arguments, "--overwrite", "--slow", "0.25")
    assert status == 0
    assert "`excite check CONFIG a.npz`" in " ".join(err.split())


def test_entered_from_rest(here: Here, two_motions: Run) -> None:
    arguments = ("export", two_motions.path, "-f", "csv", "--motion", "1", "-o", "a.csv")
    here.answer(*arguments, "--entry", "--from", "elbow=0.9", "--slow", "0.5")
    found = read_own_motion(here.folder / "a.csv")
    assert found.v is not None
    for end in (0, -1):
        assert found.q[end] == pytest.approx([0, 0.6, 0.9, 0, 0.05], abs=1e-9)
        assert found.v[end] == pytest.approx(np.zeros(5), abs=1e-9)
    jumps = np.abs(np.diff(found.v, axis=0)).max()
    assert jumps < 10.0 * 0.5 / 1000 * 1.001  # half of 10 rad/s², a millisecond
    assert here(*arguments, "--from", "elbow=0.9", "--overwrite")[0] == 2


def test_a_motion_of_others_is_written_in_another_format(here: Here) -> None:
    (here.folder / "m.csv").write_text("t,q_x\n0,0\n1,1\n2,0\n3,1\n")
    answer = here.answer("export", "m.csv", "-f", "ros2", "--rate", "10", "-o", "m.yaml")
    assert answer["motions"][0]["instants"] == 31
    tree = yaml.safe_load((here.folder / "m.yaml").read_text())
    assert tree["points"][10]["positions"] == pytest.approx([1.0])
    for option in (("--slow", "0.5"), ("--entry",)):
        status, _, err = here("export", "m.csv", "-f", "npz", *option)
        assert status == 2
        assert "does not say which robot and limits" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("-f", "cvs"), "--format cvs: unknown. Did you mean 'csv'?"),
        (("-f", "urdf"), "is no model: it cannot be exported as urdf. Its formats: csv, ros2"),
        (("-f", "csv", "--motion", "7"), "has no motion 7; it has 1, 2"),
        (("-f", "csv", "--motion", "x"), "--motion x: give the number"),
        (("-f", "csv", "--rate", "0"), "--rate 0: give instants per second"),
        (("-f", "csv", "--rate", "1e6", "--periods", "9"), "up to 2,000,000 are written"),
        (("-f", "csv", "--slow", "1.5"), "--slow 1.5: give a share"),
        (("-f", "csv", "--from", "elbow=1"), "--from says where --entry starts"),
    ],
)
def test_bad_requests(here: Here, two_motions: Run, arguments: tuple[str, ...], words: str) -> None:
    status, out, err = here("export", two_motions.path, *arguments)
    assert (status, out) == (2, "")
    assert words in err
    assert list(here.folder.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("gone.h5", "There is no file"),
        ("bad.h5", "not a readable HDF5 file"),
        ("bad.x", "HDF5"),
    ],
)
def test_bad_files(here: Here, name: str, words: str) -> None:
    if name != "gone.h5":
        (here.folder / name).write_text("nothing")
    status, _, err = here("export", name, "-f", "csv")
    assert status == 2
    assert words in err


def test_a_fit_gives_the_same_models_as_identification(here: Here) -> None:
    robot_part = yaml.safe_load(SMOKE.read_text())["robot"]
    robot_part["urdf"] = str((SMOKE.parent / robot_part["urdf"]).resolve())
    problem = {"robot": robot_part, "effects": [{"kind": "viscous_friction"}]}
    (here.folder / "arm.yaml").write_text(yaml.safe_dump(problem))
    robot = build_robot(load_spec(here.folder / "arm.yaml").robot)
    effects = declared_effects(load_spec(here.folder / "arm.yaml").effects, robot)
    phi, values = standard_parameters(robot), np.linspace(0.5, 2.0, robot.n)
    data = measured(robot, phi, effects, values, noise=0.1, seconds=4.0, seeds=(1, 2, 3))
    write_dataset(here.folder / "data.h5", data, {})
    models = {"urdf": "a.urdf", "mjcf": "a.xml", "yaml": "p.yaml"}
    wanted = ("--urdf", "a.urdf", "--mjcf", "a.xml", "--parameters", "p.yaml")
    status, _, err = here("identify", "arm.yaml", "data.h5", "-o", "fit.h5", *wanted, "--quiet")
    assert status == 0, err
    for name, made in models.items():
        assert here("export", "fit.h5", "-f", name, "-o", "again")[0] == 0
        again = here.folder / "again"
        assert again.read_text() == (here.folder / made).read_text()
        again.unlink()
    status, _, err = here("export", "fit.h5", "-f", "csv")
    assert status == 2
    assert (
        "fit.h5 is a model: it cannot be exported as csv. Its formats: urdf, mjcf, yaml, c." in err
    )
    (here.folder / "arm.yaml").unlink()
    status, _, err = here("export", "fit.h5", "-f", "urdf", "-o", "a.urdf")
    assert status == 2
    assert "a.urdf exists already" in err


def _planned(here: Here, *more: str | Path) -> tuple[Any, str]:
    status, out, err = here(
        "optimize", SMOKE, "-o", "out.h5", "--motions", "1", *BRIEF, "--json", "--overwrite", *more
    )
    assert status == 0, err
    return json.loads(out)["motions"][0], err


def test_exported_motions_as_prior_and_start(here: Here, two_motions: Run) -> None:
    here.answer("export", two_motions.path, "-f", "npz", "-o", "m.npz")
    both = ("--prior", "m_1.npz", "--prior", "m_2.npz")
    by_file, err = _planned(here, *both)
    by_result, _ = _planned(here, "--prior", two_motions.path)
    assert "--prior m_1.npz: 6 s of motion, 60 samples every 0.1 s" in err
    for key in ("condition_number", "stacked_condition_number"):
        assert by_file[key] == pytest.approx(by_result[key], rel=1e-6)
    (old, _) = read_result(two_motions.path).motions
    none = ("--set", "optimizer.max_iterations=1")
    started, err = _planned(here, "--start", "m_1.npz", *none)
    assert "the search started from m_1" in " ".join(err.split())
    assert started["condition_number"] < 1.05 * old.condition_number
    again, _ = _planned(here, "--start", two_motions.path, *none)
    assert again["condition_number"] == pytest.approx(started["condition_number"], rel=1e-3)
    fresh, _ = _planned(here, *none)
    assert fresh["condition_number"] > 1.2 * started["condition_number"]


def test_bad_priors_and_starts(here: Here) -> None:
    (here.folder / "m.csv").write_text("t,q_elbo\n0,0\n1,1\n2,0\n")
    for option in ("--prior", "--start"):
        status, _, err = here("optimize", SMOKE, "-o", "out.h5", option, "m.csv")
        assert status == 2
        assert "does not move joint 'shoulder_yaw'" in err
        status, _, err = here("optimize", SMOKE, "-o", "out.h5", option, "gone.csv")
        assert status == 2
        assert "There is no file gone.csv" in err
    assert not (here.folder / "out.h5").exists()


def test_an_exported_motion_is_simulated(here: Here, two_motions: Run) -> None:
    pytest.importorskip("mujoco")
    here.answer("export", two_motions.path, "-f", "moveit", "--motion", "1", "-o", "m.json")
    answer = here.answer("simulate", SMOKE, "m.json", "-o", "d.h5", "--rate", "100")
    (run,) = answer["runs"]
    assert (run["name"], run["samples"]) == ("m", 600)
    assert max(run["tracking_error"].values()) < 0.02
