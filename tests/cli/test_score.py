"""`excite score` and `excite compare` as a user runs them, on simulated data of the smoke arm."""

import json
import subprocess
from pathlib import Path
from shutil import copyfile

import h5py
import pytest

from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

pytestmark = pytest.mark.long

pytest.importorskip("mujoco")

DECLARED = ("--set", "effects=[{kind: viscous_friction}, {kind: coulomb_friction}]")
FRICTION = ("--effect", "coulomb_friction@all=2", "--effect", "viscous_friction@all=3")


@pytest.fixture(scope="session")
def days(tmp_path_factory: pytest.TempPathFactory, cache: Path, two_motions: Run) -> Program:
    """The program in a folder with a fit of the first day, data of that day and of others."""
    program = Program(tmp_path_factory.mktemp("days"), cache)
    for name, more in {
        "first": ("--repeat", "2"),
        "sound": ("--torque-noise", "0.011"),
        "loaded": ("--effect", "payload@slide=2"),
        "dry": ("--effect", "coulomb_friction@elbow=4"),
        "long": ("--repeat", "4"),
    }.items():
        arguments = ("-o", f"{name}.h5", "--rate", "200", *FRICTION, *more)
        program.good("simulate", SMOKE, two_motions.path, *arguments)
    program.good("identify", SMOKE, "first.h5", "-o", "fit.h5", *DECLARED)
    return program


def test_the_held_out_part_has_the_error_of_the_table(days: Program) -> None:
    fit = days.answer("identify", SMOKE, "first.h5", *DECLARED)
    found = days.answer("score", "fit.h5", "first.h5", "--held-out")
    assert found["good"]
    assert found["error"]["relative_moving"] == pytest.approx(fit["error"]["relative_moving"])
    assert found["runs"][0]["relative"] == pytest.approx(fit["error"]["relative"])
    assert not found["runs"][0]["alarm"]
    assert found["runs"][0]["samples"] == fit["error"]["samples"]


def test_a_payload_is_the_reason_of_the_alarm(days: Program) -> None:
    ran = days("score", "fit.h5", "sound.h5", "loaded.h5", "-o", "score.h5")
    assert ran.returncode == 1, ran.stderr
    assert ran.stdout.startswith("2 of 4 runs exceed the model's tolerance. loaded: ")
    assert "unmodelled payload at slide, mass 2.0" in ran.stdout
    asked = days("score", "fit.h5", "sound.h5", "loaded.h5", "--json")
    assert asked.returncode == 1
    found = json.loads(asked.stdout)
    assert [run["alarm"] for run in found["runs"]] == [False, False, True, True]
    for run in found["runs"][2:]:
        assert run["reasons"][0]["kind"] == "payload"
        mass = run["reasons"][0]["parameters"]["mass"]
        assert mass["value"] == pytest.approx(2.0, abs=0.1)
        assert run["reasons"][0]["share"] > 0.9
    with h5py.File(days.folder / "score.h5") as file:
        assert file.attrs["content"] == "score"
    days.good("report", "score.h5", "-o", "score.html")
    page = (days.folder / "score.html").read_text(encoding="utf-8")
    assert "2 of 4 runs exceed the model&#39;s tolerance" in page
    assert "RMS of the residual over the model&#39;s tolerance" in page
    found = days.answer("compare", "score.h5")
    assert found["days"][0] == "score: sound: motion_1"
    days.answer("score", "fit.h5", "sound.h5", "-o", "sound_score.h5")
    sound = days.answer("compare", "sound_score.h5")
    assert not any(each["significant"] for each in sound["changes"])  # two motions differ a little


def test_friction_that_grew_is_named_with_its_size_and_since_when(days: Program) -> None:
    ran = days("score", "fit.h5", "dry.h5", "--json")
    assert ran.returncode == 1
    for run in json.loads(ran.stdout)["runs"]:
        assert run["joints"] == ["elbow"]
        (reason,) = run["reasons"]
        assert (reason["kind"], reason["joints"]) == ("coulomb_friction", ["elbow"])
        assert reason["values"][0] == pytest.approx(4.0, rel=0.05)
    days.answer("identify", SMOKE, "sound.h5", "-o", "sound_fit.h5", *DECLARED)
    days.answer("identify", SMOKE, "dry.h5", "-o", "dry_fit.h5", *DECLARED)
    found = days.answer("compare", "fit.h5", "sound_fit.h5", "dry_fit.h5")
    changed = [each for each in found["changes"] if each["significant"]]
    assert [each["name"] for each in changed] == ["coulomb_friction.coulomb[elbow]"]
    assert changed[0]["since"] == "dry_fit"
    assert changed[0]["before"] == pytest.approx(2.0, rel=0.03)
    assert changed[0]["after"] == pytest.approx(6.0, rel=0.03)
    shown = days("compare", "fit.h5", "dry_fit.h5", "-o", "days.html").stdout
    assert "Written: days.html (page)" in shown
    assert "Friction of the joints" in (days.folder / "days.html").read_text("utf-8")
    assert "coulomb_friction.coulomb[elbow] rose from 2" in shown


def test_the_exported_model_moves_as_the_robot_did(days: Program) -> None:
    found = days.answer("replay", "fit.h5", "first.h5", "--held-out")
    assert found["mean"]["after"] < 0.2 * found["mean"]["before"]
    assert found["mean"]["after"] < 2e-3
    assert set(found["after"]) == set(found["before"])
    assert "deviates from the robot by" in days("replay", "fit.h5", "first.h5").stdout


def test_a_torque_that_counts_the_other_way_is_told_before_what_may_have_changed(
    days: Program,
) -> None:
    copyfile(days.folder / "first.h5", days.folder / "turned.h5")
    with h5py.File(days.folder / "turned.h5", "r+") as file:
        for run in file["runs"].values():
            run["tau"][:, 3] *= -1.0
    ran = days("score", "fit.h5", "turned.h5")
    assert ran.returncode == 1
    assert "the torque of wrist_roll has the opposite sign" in ran.stdout + ran.stderr
    refused = days.refused("replay", "fit.h5", "turned.h5")
    assert "the measured data contradict the robot: the torque of wrist_roll" in refused


def test_thresholds_hold_for_sound_runs_and_not_for_a_load(days: Program) -> None:
    words = ("score", "fit.h5", "first.h5", "--thresholds", "limits.json")
    assert "s of usable data (ends are cut) are too few" in days.refused(*words)
    days.good("score", "fit.h5", "long.h5", "--thresholds", "limits.json")
    told = json.loads((days.folder / "limits.json").read_text())
    assert told["false_alarms_per_hour"] == 1.0
    assert set(told["joints"]["elbow"]) == {"c", "level"}
    assert all(joint["level"] > 1.0 for joint in told["joints"].values())
    to_c = ("export", "fit.h5", "--format", "c", "--thresholds", "limits.json")
    days.good(*to_c, "-o", "detector.c")
    build = ["cc", "-O2", "-DEXCITE_MAIN", "detector.c", "-lm", "-o", "arm"]
    subprocess.run(build, cwd=days.folder, check=True)
    subprocess.run(["./arm"], cwd=days.folder, check=True)
    broken = days.folder / "detector.c"
    text = broken.read_text()
    assert "#define EXCITE_JOINTS 5" in text
    assert "viscous_friction at shoulder_yaw" in text
    level = repr(told["joints"]["elbow"]["level"])
    assert level in text
    broken.write_text(text.replace(level, repr(1.01 * float(level))))
    subprocess.run(build, cwd=days.folder, check=True)
    assert subprocess.run(["./arm"], cwd=days.folder).returncode == 1
    refused = days.refused("export", "fit.h5", "--format", "urdf", "--thresholds", "limits.json")
    assert "only a model in C holds them" in refused


def test_workers_share_the_files_and_one_that_cannot_be_read_is_left_out(days: Program) -> None:
    (days.folder / "broken.h5").write_bytes(b"no HDF5")
    files = ("sound.h5", "loaded.h5", "dry.h5")
    one, two = (
        json.loads(days("score", "fit.h5", *files, "--json", *more).stdout)
        for more in ((), ("--workers", "2"))
    )
    assert one == two
    told = days.good("score", "fit.h5", "sound.h5", "broken.h5").stderr
    assert "left out: broken.h5" in told.replace("\n", " ")
    days.refused("score", "fit.h5", "broken.h5")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("score", "none.h5", "sound.h5"), "There is no file none.h5"),
        (("score", "sound.h5", "sound.h5"), "sound.h5 holds no model. Give a fit"),
        (("score", "fit.h5", "sound.h5", "sound.h5"), "sound.h5"),
        (("score", "fit.h5", "sound.h5", "-o", "first.h5"), "first.h5 exists already"),
        (("score", "fit.h5", "sound.h5", "--held-out"), "these data have no run"),
        (("compare", "fit.h5"), "there is one day only. Give two files or more"),
        (("compare", "fit.h5", "sound.h5"), "sound.h5 is no fit, diagnosis or score"),
        (("compare", "fit.h5", "none.h5"), "There is no file none.h5"),
        (("compare", "fit.h5", "fit.h5", "--covariate", "temp=20"), "1 values for 2 days"),
        (("compare", "fit.h5", "fit.h5", "--covariate", "temp"), "give a name and numbers"),
        (("compare", "fit.h5", "fit.h5", "-o", "x.pdf"), "a report is a page, NAME.html"),
    ],
)
def test_bad_requests(days: Program, arguments: tuple[str, ...], told: str) -> None:
    assert told in days.refused(*arguments)


def test_a_config_without_numbers_is_the_urdf(days: Program) -> None:
    robot = f"robot: {{urdf: '{SMOKE.parents[1] / 'data' / 'smoke_arm.urdf'}'}}\n"
    config = days.folder / "declared.yaml"
    config.write_text(f"{robot}effects: [{{kind: viscous_friction}}]\n")
    told = days.refused("score", config, "sound.h5")
    assert "declares effects and holds no values for them" in told
    config.write_text(robot)
    told = days.good("score", config, "sound.h5").stderr
    assert "does not state how large its own errors were" in told.replace("\n", " ")


def test_a_job_is_forecast_before_it_is_played(days: Program, two_motions: Run) -> None:
    told = days.good("score", "fit.h5", "--job", str(two_motions.path)).stdout
    assert told.startswith("Expect an error of ")
    assert "on its own held-out data" in told
    found = days.answer("score", "fit.h5", "--job", "sound.h5")
    assert set(found["joints"]["elbow"]) >= {"torque", "error", "faster", "heavier"}


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("score", "fit.h5"), "DATA is missing: give measured data, or --job"),
        (("score", "fit.h5", "sound.h5", "--job", "sound.h5"), "--job: it takes no measured data"),
        (("score", "fit.h5", "--job", "none.csv"), "none.csv"),
    ],
)
def test_bad_jobs(days: Program, arguments: tuple[str, ...], told: str) -> None:
    assert told in days.refused(*arguments)


def test_a_file_of_other_joints_is_told_as_one_of_another_robot(days: Program) -> None:
    columns = ["t", *(f"{channel}_axis_{k}" for channel in ("q", "tau") for k in range(1, 6))]
    rows = [",".join(columns), *(",".join(map(str, [0.01 * k, *[0.1] * 10])) for k in range(400))]
    (days.folder / "other.csv").write_text("\n".join(rows), encoding="utf-8")
    run = days("score", "fit.h5", "other.csv")
    assert run.returncode == 2
    assert "the data are of another robot than smoke_arm" in run.stderr
