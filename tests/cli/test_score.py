"""`excite score` and `excite compare` as a user runs them, on simulated data of the smoke arm."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from shutil import copyfile

import h5py
import pytest

from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

pytest.importorskip("mujoco")

DECLARED = ("--set", "effects=[{kind: viscous_friction}, {kind: coulomb_friction}]")
FRICTION = ("--effect", "coulomb_friction@all=2", "--effect", "viscous_friction@all=3")


@dataclass(frozen=True)
class Days:
    """A fit of the first day, data of that day and of others, the program in their folder."""

    program: Program
    motions: Path
    fit: Path
    first: Path
    sound: Path
    loaded: Path
    dry: Path


@pytest.fixture(scope="session")
def days(tmp_path_factory: pytest.TempPathFactory, cache: Path, two_motions: Run) -> Days:
    folder = tmp_path_factory.mktemp("days")
    program = Program(folder, cache)

    def day(name: str, *effects: str) -> Path:
        arguments = ("-o", f"{name}.h5", "--rate", "200", *FRICTION, *effects)
        program.answer("simulate", SMOKE, two_motions.path, *arguments)
        return folder / f"{name}.h5"

    first = day("first", "--repeat", "2")
    program.answer("identify", SMOKE, first, "-o", "fit.h5", *DECLARED)
    return Days(
        program,
        two_motions.path,
        folder / "fit.h5",
        first,
        day("sound", "--torque-noise", "0.011"),
        day("loaded", "--effect", "payload@slide=2"),
        day("dry", "--effect", "coulomb_friction@elbow=4"),
    )


def test_the_held_out_part_has_the_error_of_the_table(days: Days) -> None:
    fit = days.program.answer("identify", SMOKE, days.first, *DECLARED)
    found = days.program.answer("score", days.fit, days.first, "--held-out")
    assert found["good"]
    assert found["error"]["relative_moving"] == pytest.approx(fit["error"]["relative_moving"])
    assert found["runs"][0]["relative"] == pytest.approx(fit["error"]["relative"])
    assert not found["runs"][0]["alarm"]
    assert found["runs"][0]["samples"] == fit["error"]["samples"]


def test_a_payload_is_the_reason_of_the_alarm(days: Days) -> None:
    ran = days.program("score", days.fit, days.sound, days.loaded, "-o", "score.h5")
    assert ran.returncode == 1, ran.stderr
    assert ran.stdout.startswith("2 of 4 runs exceed the model's tolerance. loaded: ")
    assert "payload that the model does not have at slide, mass 2.0" in ran.stdout
    asked = days.program("score", days.fit, days.sound, days.loaded, "--json")
    assert asked.returncode == 1
    found = json.loads(asked.stdout)
    assert [run["alarm"] for run in found["runs"]] == [False, False, True, True]
    for run in found["runs"][2:]:
        assert run["reasons"][0]["kind"] == "payload"
        mass = run["reasons"][0]["parameters"]["mass"]
        assert mass["value"] == pytest.approx(2.0, abs=0.1)
        assert run["reasons"][0]["share"] > 0.9
    with h5py.File(days.program.folder / "score.h5") as file:
        assert file.attrs["content"] == "score"
    made = days.program("report", "score.h5", "-o", "score.html")
    assert made.returncode == 0, made.stderr
    page = (days.program.folder / "score.html").read_text(encoding="utf-8")
    assert "2 of 4 runs exceed the model&#39;s tolerance" in page
    assert "RMS of the residual over the model&#39;s tolerance" in page
    found = days.program.answer("compare", "score.h5")
    assert found["days"][0] == "score: sound: motion_1"
    days.program.answer("score", days.fit, days.sound, "-o", "sound_score.h5")
    sound = days.program.answer("compare", "sound_score.h5")
    assert not any(each["significant"] for each in sound["changes"])  # two motions differ a little


def test_friction_that_grew_is_named_with_its_size_and_since_when(days: Days) -> None:
    ran = days.program("score", days.fit, days.dry, "--json")
    assert ran.returncode == 1
    for run in json.loads(ran.stdout)["runs"]:
        assert run["joints"] == ["elbow"]
        (reason,) = run["reasons"]
        assert (reason["kind"], reason["joints"]) == ("coulomb_friction", ["elbow"])
        assert reason["values"][0] == pytest.approx(4.0, rel=0.05)
    days.program.answer("identify", SMOKE, days.sound, "-o", "sound_fit.h5", *DECLARED)
    days.program.answer("identify", SMOKE, days.dry, "-o", "dry_fit.h5", *DECLARED)
    found = days.program.answer("compare", days.fit, "sound_fit.h5", "dry_fit.h5")
    changed = [each for each in found["changes"] if each["significant"]]
    assert [each["name"] for each in changed] == ["coulomb_friction.coulomb[elbow]"]
    assert changed[0]["since"] == "dry_fit"
    assert changed[0]["before"] == pytest.approx(2.0, rel=0.03)
    assert changed[0]["after"] == pytest.approx(6.0, rel=0.03)
    shown = days.program("compare", days.fit, "dry_fit.h5", "-o", "days.html").stdout
    assert "Written: days.html (page)" in shown
    assert "Friction of the joints" in (days.program.folder / "days.html").read_text("utf-8")
    assert "coulomb_friction.coulomb[elbow] rose from 2" in shown


def test_a_model_in_c_is_exported_from_a_fit(days: Days) -> None:
    ran = days.program("export", days.fit, "--format", "c", "-o", "arm.c")
    assert ran.returncode == 0, ran.stderr
    text = (days.program.folder / "arm.c").read_text()
    assert "#define EXCITE_JOINTS 5" in text
    assert "viscous_friction at shoulder_yaw" in text


def test_the_exported_model_moves_as_the_robot_did(days: Days) -> None:
    ran = days.program("replay", days.fit, days.first, "--held-out", "--json")
    assert ran.returncode == 0, ran.stderr
    found = json.loads(ran.stdout)
    assert found["mean"]["after"] < 0.2 * found["mean"]["before"]
    assert found["mean"]["after"] < 2e-3
    assert set(found["after"]) == set(found["before"])
    assert "deviates from the robot by" in days.program("replay", days.fit, days.first).stdout


def test_a_torque_that_counts_the_other_way_is_told_before_what_may_have_changed(
    days: Days,
) -> None:
    turned = days.program.folder / "turned.h5"
    copyfile(days.first, turned)
    with h5py.File(turned, "r+") as file:
        for run in file["runs"].values():
            run["tau"][:, 3] = -run["tau"][:, 3]
    ran = days.program("score", days.fit, turned)
    assert ran.returncode == 1
    assert "the torque of wrist_roll has the opposite sign" in ran.stdout + ran.stderr
    refused = days.program("replay", days.fit, turned)
    assert refused.returncode == 2
    assert "the measured data contradict the robot: the torque of wrist_roll" in refused.stderr


def test_thresholds_hold_for_sound_runs_and_not_for_a_load(days: Days) -> None:
    made = days.program("score", days.fit, days.first, "--thresholds", "limits.json")
    assert made.returncode == 2
    assert "s of fault-free data are too few" in made.stderr.replace("\n", " ")
    arguments = ("-o", "long.h5", "--rate", "200", "--repeat", "4", *FRICTION)
    days.program.answer("simulate", SMOKE, days.motions, *arguments)
    made = days.program("score", days.fit, "long.h5", "--thresholds", "limits.json")
    assert made.returncode == 0, made.stderr
    told = json.loads((days.program.folder / "limits.json").read_text())
    assert told["false_alarms_per_hour"] == 1.0
    assert set(told["joints"]["elbow"]) == {"c", "level"}
    assert all(joint["level"] > 1.0 for joint in told["joints"].values())
    to_c = ("export", days.fit, "--format", "c", "--thresholds", "limits.json")
    made = days.program(*to_c, "-o", "detector.c")
    assert made.returncode == 0, made.stderr
    build = ["cc", "-O2", "-DEXCITE_MAIN", "detector.c", "-lm", "-o", "arm"]
    subprocess.run(build, cwd=days.program.folder, check=True)
    subprocess.run(["./arm"], cwd=days.program.folder, check=True)
    broken = days.program.folder / "detector.c"
    text = broken.read_text()
    level = repr(told["joints"]["elbow"]["level"])
    assert level in text
    broken.write_text(text.replace(level, repr(1.01 * float(level))))
    subprocess.run(build, cwd=days.program.folder, check=True)
    assert subprocess.run(["./arm"], cwd=days.program.folder).returncode == 1
    refused = days.program("export", days.fit, "--format", "urdf", "--thresholds", "limits.json")
    assert refused.returncode == 2
    assert "only a model in C holds them" in refused.stderr


def test_workers_share_the_files_and_one_that_cannot_be_read_is_left_out(days: Days) -> None:
    (days.program.folder / "broken.h5").write_bytes(b"no HDF5")
    files = ("sound.h5", "loaded.h5", "dry.h5")
    one, two = (
        json.loads(days.program("score", days.fit, *files, "--json", *more).stdout)
        for more in ((), ("--workers", "2"))
    )
    assert one == two
    ran = days.program("score", days.fit, "sound.h5", "broken.h5")
    assert ran.returncode == 0
    assert "left out: broken.h5" in ran.stderr.replace("\n", " ")
    assert days.program("score", days.fit, "broken.h5").returncode == 2


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
def test_bad_requests(days: Days, arguments: tuple[str, ...], told: str) -> None:
    ran = days.program(*arguments)
    assert ran.returncode == 2
    assert told in ran.stderr.replace("\n", " ")


def test_a_config_without_numbers_is_the_urdf(days: Days) -> None:
    declared = days.program.folder / "declared.yaml"
    robot = json.loads(json.dumps({"urdf": str(SMOKE.parents[1] / "data" / "smoke_arm.urdf")}))
    declared.write_text(f"robot: {json.dumps(robot)}\neffects: [{{kind: viscous_friction}}]\n")
    ran = days.program("score", declared, days.sound)
    assert ran.returncode == 2
    assert "declares effects and holds no values for them" in ran.stderr.replace("\n", " ")
    declared.write_text(f"robot: {json.dumps(robot)}\n")
    found = days.program("score", declared, days.sound)
    assert found.returncode == 0, found.stderr
    assert "does not state how large its own errors were" in found.stderr.replace("\n", " ")
